// The gain that brings the lightprobe's radiance to the plate's units.
#include "render/match.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "capture/median.h"

namespace render {
namespace {

using std::numbers::pi;
// Plate pixels to look at along a texel's side, and the largest step that leaves out others.
constexpr double pixels_along_texel = 3;
constexpr int most_step = 16;
// Fewer plate pixels than this in a texel are its rim.
constexpr int least_pixels_per_texel = 4;

using Colour = std::array<float, 3>;

// Median per channel, and the largest channel's relative robust deviation from it.
struct Robust {
  std::array<double, 3> median{};
  double spread = 0;
};

Robust robust_mean(const std::vector<Colour>& values) {
  Robust result;
  std::vector<float> channel(values.size());
  for (std::size_t c = 0; c < 3; ++c) {
    std::ranges::transform(values, channel.begin(), [c](const Colour& v) { return v[c]; });
    const double m = capture::median_in_place(channel);
    std::ranges::transform(values, channel.begin(), [c, m](const Colour& v) {
      return static_cast<float>(std::abs(v[c] - m));
    });
    result.median[c] = m;
    if (m > 0)
      result.spread =
          std::max(result.spread, capture::sigma_by_median * capture::median_in_place(channel) / m);
  }
  return result;
}

bool usable(const float* p, const MatchSettings& settings) {
  return std::all_of(p, p + 3,
                     [&](float v) { return v >= settings.darkest && v < settings.clipped; });
}

// The usable pixels of a patch.
std::vector<Colour> patch_pixels(const capture::Image& plate,
                                 const Patch& patch,
                                 const MatchSettings& settings) {
  if (plate.channels != 3 || patch.x < 0 || patch.y < 0 || patch.width < 1 || patch.height < 1 ||
      patch.width > plate.width - patch.x || patch.height > plate.height - patch.y) {
    throw std::invalid_argument("the patch to match by does not lie in the plate");
  }
  std::vector<Colour> pixels;
  for (int y = patch.y; y < patch.y + patch.height; ++y) {
    for (int x = patch.x; x < patch.x + patch.width; ++x) {
      const float* p = &plate.pixels[plate.index(y, x)];
      if (usable(p, settings)) pixels.push_back({p[0], p[1], p[2]});
    }
  }
  return pixels;
}

// The plate's light in a texel of the environment.
struct Texel {
  Colour sum{};
  int pixels = 0;  // not_usable once one of them is clipped or dark
};
constexpr int not_usable = -1;

// Pixels from one to the next that is looked at, so that a texel still has enough of them.
int pixel_step(const calibrate::DirectionTable& directions, int environment_height) {
  const auto at = [&](int x) {
    const std::size_t i = directions.index(directions.height / 2, x);
    return Vec3f{directions.x[i], directions.y[i], directions.z[i]};
  };
  const Vec3f a = at(directions.width / 2 - 1);
  const Vec3f b = at(directions.width / 2);
  const double pixel_rad = length(a - b);
  if (dot(a, a) == 0 || dot(b, b) == 0 || pixel_rad == 0) return 1;
  return std::clamp(static_cast<int>(pi / environment_height / pixel_rad / pixels_along_texel), 1,
                    most_step);
}

std::vector<Texel> average_over_texels(const capture::Image& plate,
                                       const calibrate::DirectionTable& directions,
                                       const calibrate::Pose& cam_from_set,
                                       const Environment& env,
                                       const MatchSettings& settings) {
  const int width = env.radiance.width;
  const int height = env.radiance.height;
  std::vector<Texel> texels(env.radiance.pixels.size() / 3);
  const calibrate::Mat3 set_from_cam = cam_from_set.R.transposed();
  const int step = pixel_step(directions, height);
  for (int y = step / 2; y < plate.height; y += step) {
    for (int x = step / 2; x < plate.width; x += step) {
      const std::size_t i = directions.index(y, x);
      const calibrate::Vec3 v_cam{directions.x[i], directions.y[i], directions.z[i]};
      if (dot(v_cam, v_cam) == 0) continue;
      const auto at = texel_of_direction(to_float(set_from_cam * v_cam), width, height);
      const int column = std::clamp(static_cast<int>(std::lround(at[0])), 0, width - 1);
      const int row = std::clamp(static_cast<int>(std::lround(at[1])), 0, height - 1);
      Texel& texel = texels[static_cast<std::size_t>(row * width + column)];
      const float* p = &plate.pixels[plate.index(y, x)];
      if (texel.pixels == not_usable) continue;
      if (!usable(p, settings)) {
        texel.pixels = not_usable;
        continue;
      }
      for (std::size_t c = 0; c < 3; ++c) texel.sum[c] += p[c];
      ++texel.pixels;
    }
  }
  return texels;
}

bool is_lit(Vec3f irradiance) {
  return irradiance.x > 0 && irradiance.y > 0 && irradiance.z > 0 &&
         std::isfinite(irradiance.x + irradiance.y + irradiance.z);
}

}  // namespace

std::vector<OverlapTexel> find_overlap(const capture::Image& plate,
                                       const calibrate::DirectionTable& plate_directions,
                                       const calibrate::Pose& cam_from_set,
                                       const Environment& env,
                                       const MatchSettings& settings) {
  check(env);
  if (plate.width != plate_directions.width || plate.height != plate_directions.height ||
      plate.channels != 3) {
    throw std::invalid_argument("the plate is not of its lens's size");
  }
  const std::vector<Texel> texels =
      average_over_texels(plate, plate_directions, cam_from_set, env, settings);
  std::vector<OverlapTexel> overlap;
  for (std::size_t t = 0; t < texels.size(); ++t) {
    const Texel& texel = texels[t];
    const bool seen = env.seen.empty() || env.seen[t] != 0;
    if (!seen || texel.pixels < least_pixels_per_texel) continue;
    OverlapTexel both;
    both.pixels = texel.pixels;
    both.texel = t;
    for (std::size_t c = 0; c < 3; ++c) {
      both.plate[c] = texel.sum[c] / static_cast<float>(texel.pixels);
      both.probe[c] = counted_radiance(env.radiance.pixels[3 * t + c]);
    }
    overlap.push_back(both);
  }
  return overlap;
}

MatchResult match_by_overlap(const capture::Image& plate,
                             const calibrate::DirectionTable& plate_directions,
                             const calibrate::Pose& cam_from_set,
                             const Environment& env,
                             const MatchSettings& settings) {
  MatchResult result;
  std::vector<Colour> ratios;
  for (const OverlapTexel& both :
       find_overlap(plate, plate_directions, cam_from_set, env, settings)) {
    Colour ratio{};
    for (std::size_t c = 0; c < 3; ++c) ratio[c] = both.plate[c] / both.probe[c];
    if (!std::isfinite(ratio[0] + ratio[1] + ratio[2])) continue;
    ratios.push_back(ratio);
    result.pixels += both.pixels;
  }
  if (ratios.empty()) {
    result.note =
        "no direction is seen by both cameras, unclipped and not dark: " + settings.else_gain +
        "; state a patch of known albedo, or a gain";
    return result;
  }
  const Robust robust = robust_mean(ratios);
  for (std::size_t c = 0; c < 3; ++c) result.gain[c] = static_cast<float>(robust.median[c]);
  result.spread = robust.spread;
  result.note =
      "median over " + std::to_string(ratios.size()) + " directions that both cameras see";
  result.doubtful = result.spread > doubtful_spread;
  if (result.doubtful) {
    result.note +=
        "; doubtful: they disagree, so things may be near, poses wrong, or the plate not linear";
  }
  return result;
}

MatchResult match_by_patch(const capture::Image& plate,
                           const Patch& patch,
                           std::array<float, 3> albedo,
                           Vec3f irradiance,
                           const MatchSettings& settings,
                           Vec3f filled) {
  for (const float a : albedo) {
    if (!(a > 0 && a <= 1)) throw std::invalid_argument("an albedo must be above 0 and at most 1");
  }
  const std::vector<Colour> pixels = patch_pixels(plate, patch, settings);
  MatchResult result;
  if (pixels.empty() || !is_lit(irradiance)) {
    result.note = (pixels.empty() ? "the patch is clipped or dark: "
                                  : "the lightprobe puts no light on the patch: ") +
                  settings.else_gain;
    return result;
  }
  const Robust robust = robust_mean(pixels);
  const std::array light{irradiance.x, irradiance.y, irradiance.z};
  const std::array filled_in{filled.x, filled.y, filled.z};
  for (std::size_t c = 0; c < 3; ++c) {
    const double missing = pi * robust.median[c] / albedo[c] - filled_in[c];
    if (!(missing > 0)) {
      result.gain = {1, 1, 1};
      result.note =
          "the floor that is filled in from the plate lights the patch more than it is: " +
          settings.else_gain;
      return result;
    }
    result.gain[c] = static_cast<float>(missing / light[c]);
  }
  result.implied_albedo = albedo;
  result.pixels = static_cast<int>(pixels.size());
  result.spread = robust.spread;
  result.note = "a patch of stated albedo";
  return result;
}

std::string doubt_of_patch(float seen_share) {
  constexpr float enough = 0.5F;
  if (seen_share >= enough) return "";
  return "doubtful: the probe sees only " + std::to_string(std::lround(100 * seen_share)) +
         " % of what lights the patch: is the probe's pose right, and the patch's normal?";
}

MatchResult match_given(std::array<float, 3> gain, double exposure) {
  MatchResult result;
  for (std::size_t c = 0; c < 3; ++c) result.gain[c] = gain[c] * static_cast<float>(exposure);
  result.exposure = exposure;
  result.note = "given";
  return result;
}

MatchResult match_by_matrix(const ColourMatrix& matrix, double exposure) {
  MatchResult result = match_given(gain_of_grey(matrix), exposure);
  result.matrix = scaled(matrix, static_cast<float>(exposure));
  return result;
}

ColourMatrix matrix_of(const MatchResult& match) {
  return match.matrix ? *match.matrix : diagonal(match.gain);
}

void imply_albedo(const capture::Image& plate,
                  const Patch& patch,
                  Vec3f irradiance,
                  MatchResult& result,
                  const MatchSettings& settings) {
  const std::vector<Colour> pixels = patch_pixels(plate, patch, settings);
  if (pixels.empty() || !is_lit(irradiance)) return;
  const Robust robust = robust_mean(pixels);
  const std::array light{irradiance.x, irradiance.y, irradiance.z};
  for (std::size_t c = 0; c < 3; ++c) {
    result.implied_albedo[c] =
        static_cast<float>(pi * robust.median[c] / (result.gain[c] * light[c]));
  }
}

}  // namespace render
