// Bright compact things in a picture: lamps, windows, the sun.
#include "calibrate/bright_sources.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "capture/median.h"

namespace calibrate {
namespace {

constexpr double above_median = 4;
constexpr float of_peak = 0.5F;
constexpr std::size_t fewest_pixels = 3;
// Local maxima that are looked at, most of which may be parts of what is too wide.
constexpr int most_peaks = 2000;

// A picture's brightness and directions, by pixel.
class Brightness {
 public:
  Brightness(const capture::Image& image, const Lens& lens)
      : width_(image.width), height_(image.height), table_(make_direction_table(lens)) {
    const auto channels = static_cast<std::size_t>(image.channels);
    light_.resize(image.pixels.size() / channels);
    for (std::size_t i = 0; i < light_.size(); ++i) {
      float sum = 0;
      for (std::size_t c = 0; c < channels; ++c) sum += image.pixels[i * channels + c];
      const float mean = sum / static_cast<float>(channels);
      light_[i] = std::isfinite(mean) && sees(i) ? mean : 0;
    }
  }

  std::size_t size() const { return light_.size(); }
  float light(std::size_t i) const { return light_[i]; }
  Vec3 direction(std::size_t i) const { return at(row(i), column(i)); }
  bool sees(std::size_t i) const { return dot(direction(i), direction(i)) > 0; }
  int row(std::size_t i) const { return static_cast<int>(i / static_cast<std::size_t>(width_)); }
  int column(std::size_t i) const { return static_cast<int>(i % static_cast<std::size_t>(width_)); }

  // At the picture's edge, or at that of what the lens sees.
  bool at_rim(std::size_t i) const {
    const int y = row(i);
    const int x = column(i);
    if (y == 0 || x == 0 || y + 1 == height_ || x + 1 == width_) return true;
    for (const std::size_t n : neighbours(i)) {
      if (!sees(n)) return true;
    }
    return false;
  }

  // Of a pixel that is not at the picture's edge.
  std::array<std::size_t, 4> neighbours(std::size_t i) const {
    const auto w = static_cast<std::size_t>(width_);
    return {i - 1, i + 1, i - w, i + w};
  }

  double solid_angle(std::size_t i) const {
    const int y = row(i);
    const int x = column(i);
    return length(cross(at(y, x + 1) - at(y, x - 1), at(y + 1, x) - at(y - 1, x))) / 4;
  }

 private:
  Vec3 at(int y, int x) const {
    const std::size_t i = table_.index(y, x);
    return {table_.x[i], table_.y[i], table_.z[i]};
  }

  int width_;
  int height_;
  DirectionTable table_;
  std::vector<float> light_;
};

float median_light(const Brightness& picture) {
  std::vector<float> lights;
  for (std::size_t i = 0; i < picture.size(); ++i) {
    if (picture.sees(i)) lights.push_back(picture.light(i));
  }
  return lights.empty() ? 0 : capture::median_in_place(lights);
}

struct Region {
  std::vector<std::size_t> pixels;
  bool at_rim = false;
};

// What is joined to `peak` above half its light, and not taken yet.
Region region_around(const Brightness& picture,
                     std::size_t peak,
                     std::vector<std::uint8_t>& taken) {
  Region region;
  const float level = of_peak * picture.light(peak);
  std::vector<std::size_t> pending{peak};
  taken[peak] = 1;
  while (!pending.empty()) {
    const std::size_t i = pending.back();
    pending.pop_back();
    region.pixels.push_back(i);
    if (picture.at_rim(i)) {
      region.at_rim = true;
      continue;
    }
    for (const std::size_t n : picture.neighbours(i)) {
      // What was taken from a brighter peak, or is brighter than this one, makes this its flank.
      if (taken[n] != 0 || picture.light(n) < level) continue;
      taken[n] = 1;
      pending.push_back(n);
    }
  }
  return region;
}

// Whether the region is the flank of one that was taken before.
bool is_flank(const Brightness& picture,
              const Region& region,
              const std::vector<std::size_t>& owner,
              std::size_t own) {
  for (const std::size_t i : region.pixels) {
    if (picture.at_rim(i)) continue;
    for (const std::size_t n : picture.neighbours(i)) {
      if (owner[n] != 0 && owner[n] != own) return true;
    }
  }
  return false;
}

BrightSource source_of(const Brightness& picture, const Region& region) {
  BrightSource source;
  Vec3 sum;
  double solid_angle = 0;
  for (const std::size_t i : region.pixels) {
    const double power = picture.light(i) * picture.solid_angle(i);
    source.power += power;
    solid_angle += picture.solid_angle(i);
    sum += picture.direction(i) * power;
  }
  source.v_cam = normalize(sum);
  source.radius_rad = std::sqrt(solid_angle / std::numbers::pi);
  const double pixel_rad = std::sqrt(solid_angle / static_cast<double>(region.pixels.size()));
  source.sigma_rad = std::hypot(0.2 * pixel_rad, 0.05 * source.radius_rad);
  return source;
}

}  // namespace

std::vector<BrightSource> find_bright_sources(const capture::Image& radiance,
                                              const Lens& lens,
                                              std::size_t most,
                                              double largest_rad) {
  if (radiance.width != lens.width || radiance.height != lens.height || radiance.empty()) {
    throw std::invalid_argument("the picture has not the lens's size");
  }
  const Brightness picture(radiance, lens);
  const auto floor = static_cast<float>(above_median * median_light(picture));
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < picture.size(); ++i) {
    if (picture.light(i) > floor) order.push_back(i);
  }
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::size_t i) { return picture.light(i); });
  std::vector<std::uint8_t> taken(picture.size(), 0);
  std::vector<std::size_t> owner(picture.size(), 0);
  std::vector<BrightSource> sources;
  std::size_t peaks = 0;
  for (const std::size_t peak : order) {
    if (taken[peak] != 0) continue;
    if (++peaks > most_peaks) break;
    const Region region = region_around(picture, peak, taken);
    for (const std::size_t i : region.pixels) owner[i] = peaks;
    if (region.at_rim || region.pixels.size() < fewest_pixels ||
        is_flank(picture, region, owner, peaks)) {
      continue;
    }
    BrightSource source = source_of(picture, region);
    if (source.radius_rad > largest_rad) continue;
    if (const auto q = project(lens, source.v_cam)) source.q = *q;
    sources.push_back(source);
  }
  std::ranges::stable_sort(sources, std::ranges::greater{}, &BrightSource::power);
  if (sources.size() > most) sources.resize(most);
  return sources;
}

}  // namespace calibrate
