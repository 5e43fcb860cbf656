// Light from all directions, as the probe sees it.
#include "render/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "calibrate/angles.h"
#include "render/lobe_filter.h"

namespace render {
namespace {

using calibrate::pi_f;

struct Texel {
  int x, y;
};

// Beyond a pole lies the row itself, half way around.
Texel wrapped(int x, int y, int width, int height) {
  if (y < 0 || y >= height) {
    y = std::clamp(y, 0, height - 1);
    x += width / 2;
  }
  if (x < 0) x += width;
  if (x >= width) x -= width;
  return {x, y};
}

Vec3f texel(const capture::Image& map, Texel at) {
  const float* p = &map.pixels[map.index(at.y, at.x)];
  return {p[0], p[1], p[2]};
}

// atan2 to 1e-7 radians, several times as fast as the C library's, and alike everywhere.
//
// Abramowitz and Stegun, "Handbook of Mathematical Functions", formula 4.4.49.
float arc_tangent(float y, float x) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float larger = std::max(ax, ay);
  if (!(larger > 0)) return 0;
  const float t = std::min(ax, ay) / larger;
  const float s = t * t;
  float angle = 0.0028662257F;
  for (const float k : {-0.0161657367F, 0.0429096138F, -0.0752896400F, 0.1065626393F,
                        -0.1420889944F, 0.1999355085F, -0.3333314528F, 1.0F}) {
    angle = angle * s + k;
  }
  angle *= t;
  if (ay > ax) angle = pi_f / 2 - angle;
  if (x < 0) angle = pi_f - angle;
  return y < 0 ? -angle : angle;
}

// Where a direction lies in a map of any size: 0..1 from the left, and from the top.
struct MapPoint {
  float u, v;
};

MapPoint map_point(Vec3f direction) {
  const float across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  return {0.5F - arc_tangent(direction.y, direction.x) / (2 * pi_f),
          arc_tangent(across, direction.z) / pi_f};
}

constexpr float mirror_alpha = 4e-4F;  // of standard.h's mirror_roughness

// Half of what a lobe mirrors head-on lies within 2 alpha of the mirrored direction, as half of a
// disc of this width times alpha does.
constexpr float lobe_width = 5.6F;

// Interpolation between texels blurs as a disc of so many texels does.
constexpr float blur_texels = 1.7F;
constexpr float most_steps = 8;

// GGX's lobe is a sum of discs: the share s^2 / (1 + s)^2 of its light is in those whose radius, as
// seen by the mirrored direction, is at most 2 alpha sqrt(s). Here they stand for octaves of s:
// radius over alpha, and share. The far ones are weak, but a sun in them is not.
struct LobeDisc {
  float radius, share;
};
constexpr std::array<LobeDisc, 6> lobe_discs{
    {{1, .1111F}, {2, .3333F}, {4, .3457F}, {8, .1502F}, {16, .0443F}, {32, .0154F}}};

// Where a lobe lies among the smoothed levels: at 1 or above it is all of them, below it mixes the
// first of them with narrower cones.
float level_of(const Environment& env, float alpha, float spread_rad) {
  const float width_rad = calibrate::hypotenuse(lobe_width * alpha, spread_rad);
  return std::min(std::sqrt(width_rad / lobe_width), 1.0F) *
         static_cast<float>(env.smoothed.size() - 1);
}
float share_of_smoothed(const Environment& env, float alpha, float spread_rad) {
  return std::clamp(2 * level_of(env, alpha, spread_rad) - 1, 0.0F, 1.0F);
}

float alpha_of(float roughness) {
  return roughness > 0 ? std::min(roughness * roughness, 1.0F) : 0.0F;
}

// The axes of an ellipse that has `spread` as conjugate diameters.
Spread axes_of(const Spread& spread) {
  const Vec3f &a = spread.a, &b = spread.b;
  const float twice = 2 * dot(a, b), less = dot(a, a) - dot(b, b);
  const float whole = std::sqrt(twice * twice + less * less);
  if (!(std::abs(twice) > 1e-3F * whole)) return spread;
  // The cosine and sine of half of the angle whose tangent is twice / less.
  const float cosine = std::sqrt(0.5F + 0.5F * less / whole);
  const float sine = std::copysign(std::sqrt(std::max(0.5F - 0.5F * less / whole, 0.0F)), twice);
  return {a * cosine + b * sine, b * cosine - a * sine};
}

// A cone that is longer than wide, taken in steps along its longer side.
struct ConeSteps {
  float count = 1;
  float width_rad = 0;  // of each
  Vec3f step{};
};
ConeSteps cone_steps(const Environment& env, float alpha, const Spread& spread) {
  const float texel_rad = pi_f / static_cast<float>(env.smoothed[0].height);
  const float squares = dot(spread.a, spread.a) + dot(spread.b, spread.b);  // of axes, too
  if (!(squares > 0) || !std::isfinite(squares)) return {};
  if (alpha < mirror_alpha) {
    // Nearly all mirrors and all that is behind: as one ray, whatever its axes.
    const auto intervals = static_cast<float>(env.smoothed.size() - 1);
    const float of_smoothed = lobe_width / (4 * intervals * intervals);
    const float narrow = std::min(blur_texels * texel_rad, of_smoothed);
    if (squares < narrow * narrow) return {};
  }
  const auto [a, b] = axes_of(spread);
  const float aa = dot(a, a), bb = dot(b, b);
  const float longer = std::sqrt(std::max(aa, bb)), shorter = std::sqrt(std::min(aa, bb));
  // No finer than what the lobe or the map blurs.
  const float narrow = std::max({shorter, lobe_width * alpha, blur_texels * texel_rad});
  const float count = std::clamp(std::ceil(0.99F * longer / narrow), 1.0F, most_steps);
  return {count, std::sqrt(std::max(longer / count, shorter) * shorter),
          (aa > bb ? a : b) * (1 / count)};
}

// Gathers the samples of one direction.
class MapSampler {
 public:
  MapSampler(const Environment& env,
             std::span<MapSample, most_map_samples> samples,
             bool diffused = false)
      : env_(env),
        samples_(samples),
        diffused_(diffused ? static_cast<std::uint32_t>(env.halved.size() + env.smoothed.size())
                           : 0) {}

  std::size_t count() const { return count_; }

  // A lobe, seen by a sample whose cone is so wide.
  void add_lobe(MapPoint at, float alpha, float spread_rad, float share) {
    const float level = level_of(env_, alpha, spread_rad);
    if (level >= 1) {
      const auto below = std::min(static_cast<std::size_t>(level), env_.smoothed.size() - 2);
      const float f = level - static_cast<float>(below);
      add_smoothed(below, at, share * (1 - f));
      add_smoothed(below + 1, at, share * f);
      return;
    }
    const float f = share_of_smoothed(env_, alpha, spread_rad);
    if (alpha < mirror_alpha) {
      add_cone(at, spread_rad, share * (1 - f));
    } else {
      for (const auto& [radius, disc_share] : lobe_discs) {
        add_cone(at, calibrate::hypotenuse(2 * radius * alpha, spread_rad),
                 share * (1 - f) * disc_share);
      }
    }
    if (f > 0) add_smoothed(1, at, share * f);
  }

  // A disc of directions.
  void add_cone(MapPoint at, float width_rad, float share) {
    const float texel_rad = pi_f / static_cast<float>(env_.smoothed[0].height);
    const float texels = width_rad / (blur_texels * texel_rad);
    if (!(texels > 1) || env_.halved.empty()) return add(0, env_.smoothed[0], at, share);
    const float level = std::min(std::log2(texels), static_cast<float>(env_.halved.size()));
    const auto below = std::min(static_cast<std::size_t>(level), env_.halved.size() - 1);
    const float f = level - static_cast<float>(below);
    add(below, below == 0 ? env_.smoothed[0] : env_.halved[below - 1], at, share * (1 - f));
    add(below + 1, env_.halved[below], at, share * f);
  }

  void add(std::size_t level, const capture::Image& map, MapPoint at, float share) {
    if (!(share > 0)) return;
    samples_[count_++] = {at.u * static_cast<float>(map.width) - 0.5F,
                          at.v * static_cast<float>(map.height) - 0.5F, share,
                          static_cast<std::uint32_t>(level) + diffused_};
  }

 private:
  void add_smoothed(std::size_t level, MapPoint at, float share) {
    add(level == 0 ? 0 : env_.halved.size() + level, env_.smoothed[level], at, share);
  }

  const Environment& env_;
  std::span<MapSample, most_map_samples> samples_;
  std::uint32_t diffused_;  // from where on levels are counted
  std::size_t count_ = 0;
};

// `level` = `map` with every value as it counts.
void copy_counted(const capture::Image& map, capture::Image& level) {
  level.height = map.height;
  level.width = map.width;
  level.channels = map.channels;
  level.pixels.resize(map.pixels.size());
  std::ranges::transform(map.pixels, level.pixels.begin(), counted_radiance);
}

// `diffused` from the first level.
void diffuse(Environment& env, const CompactTexels& compact) {
  const capture::Image& whole = env.smoothed[0];
  env.diffused.resize(1 + env.halved.size());
  capture::Image& first = env.diffused[0];
  first = whole;
  const int side = whole.height / compact.height;
  for (int y = 0; y < compact.height; ++y) {
    for (int x = 0; x < 2 * compact.height; ++x) {
      if (compact.is_compact[static_cast<std::size_t>(y * 2 * compact.height + x)] == 0) continue;
      for (int row = y * side; row < (y + 1) * side; ++row) {
        std::fill_n(&first.pixels[first.index(row, x * side)], 3 * side, 0.0F);
      }
    }
  }
  for (std::size_t k = 0; k < env.halved.size(); ++k) {
    area_average(env.diffused[k], env.diffused[k].height / 2, env.diffused[k + 1]);
  }
}

// Down to 8 rows: cones as wide as those texels are lobes of the smoothed levels.
std::size_t halvings_of(int height) {
  std::size_t count = 0;
  for (; height % 2 == 0 && height >= 16; height /= 2) ++count;
  return count;
}

bool is_whole(const capture::Image& map) {
  return map.height >= 1 && map.width == 2 * map.height && map.channels == 3 &&
         map.pixels.size() == map.index(map.height, 0);
}

}  // namespace

void check(const Environment& env) {
  if (!is_whole(env.radiance))
    throw std::invalid_argument("an environment must be twice as wide as high, with 3 channels");
}

void check_levels(const Environment& env) {
  const auto fail = [](const std::string& what) {
    throw std::invalid_argument("an environment's levels: " + what);
  };
  const auto check_all = [&fail](const std::vector<capture::Image>& levels, const char* name) {
    const auto at = std::ranges::find_if_not(levels, is_whole);
    if (at != levels.end())
      fail(std::string(name) + " " + std::to_string(at - levels.begin()) +
           " is not twice as wide as high, with 3 channels");
  };
  check_all(env.smoothed, "smoothed"), check_all(env.halved, "halved");
  check_all(env.diffused, "diffused");
  if (env.smoothed.empty()) {  // then the map is the only one
    if (!env.radiance.empty()) check(env);
    if (!env.halved.empty() || !env.diffused.empty() || env.compact_apart)
      fail("there are others, or lights apart, but none smoothed");
    return;
  }
  if (levels_of(env).size() > most_environment_levels)
    fail("more than " + std::to_string(most_environment_levels));
  std::vector<int> heights{env.smoothed[0].height};
  if (heights[0] != env.radiance.height) fail("smoothed 0 is of another size than the map");
  for (const capture::Image& level : env.halved) {
    if (2 * level.height != heights.back())
      fail("halved " + std::to_string(heights.size() - 1) + " is not half as high as before");
    heights.push_back(level.height);
  }
  if (!env.diffused.empty() &&
      !std::ranges::equal(env.diffused, heights, {}, &capture::Image::height))
    fail("those diffused are of other sizes than its own");
}

Vec3f direction_of_texel(float x, float y, int width, int height) {
  const float azimuth_rad = (0.5F - (x + 0.5F) / static_cast<float>(width)) * 2 * pi_f;
  const float polar_rad = (y + 0.5F) / static_cast<float>(height) * pi_f;
  const float sine = std::sin(polar_rad);
  return {sine * std::cos(azimuth_rad), sine * std::sin(azimuth_rad), std::cos(polar_rad)};
}

std::array<float, 2> texel_of_direction(Vec3f direction, int width, int height) {
  const auto [u, v] = map_point(direction);
  return {u * static_cast<float>(width) - 0.5F, v * static_cast<float>(height) - 0.5F};
}

double texel_solid_angle(int row, int width, int height) {
  const double step_rad = std::numbers::pi / height;
  return (std::cos(row * step_rad) - std::cos((row + 1) * step_rad)) * 2 * std::numbers::pi / width;
}

std::size_t find_map_samples(const Environment& env,
                             Vec3f direction,
                             float roughness,
                             const Spread& spread,
                             std::span<MapSample, most_map_samples> samples) {
  if (!std::isfinite(direction.x + direction.y + direction.z)) return 0;
  MapSampler sampler(env, samples);
  if (env.smoothed.empty()) {
    if (!env.radiance.empty()) sampler.add(0, env.radiance, map_point(direction), 1);
    return sampler.count();
  }
  const float alpha = alpha_of(roughness);
  const ConeSteps steps = cone_steps(env, alpha, spread);
  Vec3f at = direction - steps.step * (0.5F * (steps.count - 1));
  for (float k = 0; k < steps.count; ++k, at += steps.step) {
    sampler.add_lobe(map_point(at), alpha, steps.width_rad, 1 / steps.count);
  }
  return sampler.count();
}

std::size_t find_diffused_samples(const Environment& env,
                                  Vec3f direction,
                                  const Spread& spread,
                                  std::span<MapSample, most_map_samples> samples) {
  if (env.diffused.empty()) return find_map_samples(env, direction, 0, spread, samples);
  if (!std::isfinite(direction.x + direction.y + direction.z)) return 0;
  MapSampler sampler(env, samples, true);
  const ConeSteps steps = cone_steps(env, 0, spread);
  Vec3f at = direction - steps.step * (0.5F * (steps.count - 1));
  for (float k = 0; k < steps.count; ++k, at += steps.step) {
    sampler.add_cone(map_point(at), steps.width_rad, 1 / steps.count);
  }
  return sampler.count();
}

std::vector<const capture::Image*> levels_of(const Environment& env) {
  if (env.smoothed.empty()) return {&env.radiance};
  std::vector<const capture::Image*> levels{&env.smoothed[0]};
  for (const capture::Image& level : env.halved) levels.push_back(&level);
  for (std::size_t k = 1; k < env.smoothed.size(); ++k) levels.push_back(&env.smoothed[k]);
  for (const capture::Image& level : env.diffused) levels.push_back(&level);
  return levels;
}

std::size_t halved_level(const Environment& env, std::size_t level) {
  if (env.smoothed.empty()) return level;
  const std::size_t diffused = env.halved.size() + env.smoothed.size();
  const bool has_one = level < env.halved.size() ||
                       (level >= diffused && level + 1 < diffused + env.diffused.size());
  return has_one ? level + 1 : level;
}

Vec3f radiance_at(const capture::Image& level, float x, float y) {
  const int w = level.width;
  const int h = level.height;
  const float x_floor = std::floor(x);
  const float y_floor = std::floor(y);
  const float fx = x - x_floor;
  const float fy = y - y_floor;
  const int x0 = static_cast<int>(x_floor);
  const int y0 = static_cast<int>(y_floor);
  if (x0 >= 0 && y0 >= 0 && x0 + 1 < w && y0 + 1 < h) {
    const float* p = &level.pixels[level.index(y0, x0)];
    const float* q = p + static_cast<std::ptrdiff_t>(w) * 3;
    const float a = (1 - fx) * (1 - fy), b = fx * (1 - fy), c = (1 - fx) * fy, d = fx * fy;
    return {p[0] * a + p[3] * b + q[0] * c + q[3] * d, p[1] * a + p[4] * b + q[1] * c + q[4] * d,
            p[2] * a + p[5] * b + q[2] * c + q[5] * d};
  }
  const Vec3f top =
      texel(level, wrapped(x0, y0, w, h)) * (1 - fx) + texel(level, wrapped(x0 + 1, y0, w, h)) * fx;
  const Vec3f bottom = texel(level, wrapped(x0, y0 + 1, w, h)) * (1 - fx) +
                       texel(level, wrapped(x0 + 1, y0 + 1, w, h)) * fx;
  return top * (1 - fy) + bottom * fy;
}

Vec3f radiance_of(const Environment& env, Vec3f direction, float roughness, const Spread& spread) {
  std::array<MapSample, most_map_samples> samples;
  const std::size_t count = find_map_samples(env, direction, roughness, spread, samples);
  const std::size_t halved = env.halved.size();
  Vec3f sum{};
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [x, y, share, level] = samples[i];
    const capture::Image& map = env.smoothed.empty() ? env.radiance
                                : level == 0         ? env.smoothed[0]
                                : level <= halved    ? env.halved[level - 1]
                                                     : env.smoothed[level - halved];
    sum += radiance_at(map, x, y) * share;
  }
  return sum;
}

namespace {

struct LitFrom {
  Vec3f irradiance;
  double cosines = 0;  // over their solid angles
};

// Of the texels that count.
template <class Counts>
LitFrom sum_irradiance(const Environment& env, Vec3f normal, const Counts& counts) {
  const capture::Image& map = env.radiance;
  // What the cosine owes to a column, before the row's sine.
  std::vector<float> across(static_cast<std::size_t>(map.width));
  for (int x = 0; x < map.width; ++x) {
    const float azimuth_rad =
        (0.5F - (static_cast<float>(x) + 0.5F) / static_cast<float>(map.width)) * 2 * pi_f;
    across[static_cast<std::size_t>(x)] =
        normal.x * std::cos(azimuth_rad) + normal.y * std::sin(azimuth_rad);
  }
  std::array<double, 3> sum{};
  double cosines = 0;
  for (int y = 0; y < map.height; ++y) {
    const float polar_rad = (static_cast<float>(y) + 0.5F) / static_cast<float>(map.height) * pi_f;
    const float sine = std::sin(polar_rad);
    const float along = normal.z * std::cos(polar_rad);
    std::array<float, 3> row{};
    float row_cosines = 0;
    const float* p = &map.pixels[map.index(y, 0)];
    const std::size_t first = map.index(y, 0) / 3;
    for (std::size_t x = 0; x < across.size(); ++x, p += 3) {
      if (!counts(first + x)) continue;
      const float cosine = std::max(sine * across[x] + along, 0.0F);
      for (std::size_t c = 0; c < 3; ++c) row[c] += cosine * counted_radiance(p[c]);
      row_cosines += cosine;
    }
    const double solid_angle = texel_solid_angle(y, map.width, map.height);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += row[c] * solid_angle;
    cosines += row_cosines * solid_angle;
  }
  return {{static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])},
          cosines};
}

}  // namespace

Vec3f irradiance_of(const Environment& env, Vec3f normal) {
  return sum_irradiance(env, normal, [](std::size_t) { return true; }).irradiance;
}

SplitIrradiance split_irradiance_of(const Environment& env, Vec3f normal) {
  const auto is_seen = [&](std::size_t t) { return env.seen.empty() || env.seen[t] != 0; };
  const LitFrom seen = sum_irradiance(env, normal, is_seen);
  const LitFrom filled = sum_irradiance(env, normal, [&](std::size_t t) { return !is_seen(t); });
  return {seen.irradiance, filled.irradiance,
          static_cast<float>(seen.cosines / (seen.cosines + filled.cosines))};
}

void smooth_for_reflections(Environment& env, int levels) {
  smooth_for_reflections(env, {}, levels);
}

void smooth_for_reflections(Environment& env, const CompactTexels& compact, int levels) {
  check(env);
  if (levels < 2)
    throw std::invalid_argument("an environment needs at least 2 levels of roughness");
  const int compact_height = compact.height;
  const auto side = static_cast<std::size_t>(compact_height);
  if (compact_height > 0 &&
      (env.radiance.height % compact_height != 0 || compact.is_compact.size() != 2 * side * side))
    throw std::invalid_argument("the map of compact sources does not fit the environment");
  env.smoothed.resize(static_cast<std::size_t>(levels));
  copy_counted(env.radiance, env.smoothed[0]);
  env.halved.resize(halvings_of(env.radiance.height));
  for (std::size_t k = 0; k < env.halved.size(); ++k) {
    const capture::Image& from = k == 0 ? env.smoothed[0] : env.halved[k - 1];
    area_average(from, from.height / 2, env.halved[k]);
  }
  env.compact_apart = compact_height > 0;
  capture::Image shrunk;
  const capture::Image* source = &env.smoothed[0];
  if (env.compact_apart) {
    shrunk = area_averaged(*source, compact_height);
    for (std::size_t i = 0; i < compact.is_compact.size(); ++i) {
      if (compact.is_compact[i] != 0) std::fill_n(&shrunk.pixels[3 * i], 3, 0.0F);
    }
    source = &shrunk;
    diffuse(env, compact);
  } else {
    env.diffused.clear();
  }
  for (int k = 1; k < levels; ++k) {
    const float roughness = static_cast<float>(k) / static_cast<float>(levels - 1);
    const LobeFilter& filter = shared_lobe_filter(roughness * roughness);
    if (source->height != filter.height()) {
      // From what the level before was made of: the rougher, the smaller.
      shrunk = area_averaged(*source, filter.height());
      source = &shrunk;
    }
    filter.apply(*source, env.smoothed[static_cast<std::size_t>(k)]);
  }
}

float share_without_compact(const Environment& env, float roughness, const Spread& spread) {
  if (!env.compact_apart) return 0;
  const float alpha = alpha_of(roughness);
  return share_of_smoothed(env, alpha, cone_steps(env, alpha, spread).width_rad);
}

Environment environment_from_map(const capture::Image& map, double yaw_rad, int height) {
  Environment env;
  env.radiance = map;
  check(env);
  if (height < 1 || height > 4096 || !std::isfinite(yaw_rad)) {
    throw std::invalid_argument("an environment's height must be from 1 to 4096");
  }
  const capture::Image level = area_averaged(map, height);
  env.radiance = capture::make_image(height, 2 * height);
  env.seen.assign(env.radiance.pixels.size() / 3, 1);
  // Turned to the left by yaw, the map's columns move left; what lies between two is shared.
  const int width = 2 * height;
  const double turns = yaw_rad / (2 * std::numbers::pi);
  const double moved = (turns - std::floor(turns)) * width;
  const int whole = static_cast<int>(moved) % width;
  const auto part = static_cast<float>(moved - std::floor(moved));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int from = (x + whole) % width;
      const int next = (from + 1) % width;
      for (int c = 0; c < 3; ++c) {
        env.radiance.at(y, x, c) = level.at(y, from, c) * (1 - part) + level.at(y, next, c) * part;
      }
    }
  }
  return env;
}

}  // namespace render
