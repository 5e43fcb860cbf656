// Directions of an environment, chosen in proportion to their light.
#include "render/environment_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render {
namespace {

using std::numbers::pi;

// First entry above `value`; the last one that is above its predecessor if rounding passes the end.
template <class Iterator, class T>
std::ptrdiff_t pick(Iterator first, Iterator last, T value) {
  const auto found = std::upper_bound(first, last, value);
  if (found != last) return found - first;
  return std::lower_bound(first, last, *(last - 1)) - first;
}

// Light between texels, at half-integer steps: corner k of a row or column lies at texel k / 2 -
// 1/2.
std::vector<float> corner_light(const capture::Image& map) {
  const auto w = static_cast<std::size_t>(map.width);
  const auto h = static_cast<std::size_t>(map.height);
  const auto light = [&](std::size_t row, std::size_t x) {  // row 0 is the one beyond the pole
    std::size_t y = row - 1;
    if (row == 0 || row == h + 1) {  // the row itself, half way around
      y = row == 0 ? 0 : h - 1;
      x += w / 2;
    }
    const float* rgb = &map.pixels[(y * w + x % w) * 3];
    return rgb[0] + rgb[1] + rgb[2];
  };
  std::vector<float> corners;
  corners.reserve((2 * h + 1) * (2 * w + 1));
  for (std::size_t j = 0; j <= 2 * h; ++j) {
    const std::size_t above = (j + 1) / 2;  // odd j lies on a row of texels, even j between two
    const std::size_t below = j % 2 == 0 ? above + 1 : above;
    for (std::size_t i = 0; i <= 2 * w; ++i) {
      const std::size_t left = (i + 2 * w - 1) / 2 % w;
      const std::size_t right = i % 2 == 0 ? (left + 1) % w : left;
      corners.push_back(0.25F * (light(above, left) + light(above, right) + light(below, left) +
                                 light(below, right)));
    }
  }
  return corners;
}

// Where a density that goes from `a` to `b` over 0..1 has the share `u` of its whole below.
double sample_slope(double a, double b, double u) {
  const double root = a + std::sqrt(a * a + u * (b * b - a * a));
  return root > 0 ? std::min(u * (a + b) / root, 1.0) : u;
}

}  // namespace

EnvironmentSampler::EnvironmentSampler(const Environment& environment)
    : width_(2 * static_cast<std::size_t>(environment.radiance.width)),
      height_(2 * static_cast<std::size_t>(environment.radiance.height)) {
  environment_.radiance = environment.radiance;
  for (float& value : environment_.radiance.pixels) value = counted_radiance(value);
  corners_ = corner_light(environment_.radiance);
  rows_.resize(height_);
  columns_.resize(width_ * height_);
  double total = 0;
  for (std::size_t y = 0; y < height_; ++y) {
    const double sine =
        std::sin(pi * (static_cast<double>(y) + 0.5) / static_cast<double>(height_));
    const float* above = &corners_[y * (width_ + 1)];
    const float* below = above + width_ + 1;
    double row = 0;
    for (std::size_t x = 0; x < width_; ++x) {
      row += sine * (double{above[x]} + above[x + 1] + below[x] + below[x + 1]);
      columns_[y * width_ + x] = static_cast<float>(row);
    }
    for (std::size_t x = 0; x < width_; ++x) {
      float& column = columns_[y * width_ + x];
      column = row > 0 ? static_cast<float>(column / row) : 1.0F;
    }
    total += row;
    rows_[y] = total;
  }
  if (!(total > 0)) {
    rows_.clear();
    return;
  }
  for (double& row : rows_) row /= total;
}

// What is sampled is what the rounded tables say.
EnvironmentSampler::Patch EnvironmentSampler::patch(std::size_t row, std::size_t column) const {
  const float* above = &corners_[row * (width_ + 1) + column];
  const float* below = above + width_ + 1;
  const std::size_t i = row * width_ + column;
  const double row_chance = rows_[row] - (row > 0 ? rows_[row - 1] : 0);
  const double column_chance = columns_[i] - (column > 0 ? columns_[i - 1] : 0.0F);
  return {{{above[0], above[1]}, {below[0], below[1]}}, row_chance * column_chance};
}

float EnvironmentSampler::per_steradian(const Patch& patch, double s, double t, double sine) const {
  const auto& v = patch.light;
  const double mean = 0.25 * (double{v[0][0]} + v[0][1] + v[1][0] + v[1][1]);
  if (!(mean > 0) || !(sine > 1e-9)) return 0;
  const double here = std::lerp(std::lerp(double{v[0][0]}, double{v[0][1]}, s),
                                std::lerp(double{v[1][0]}, double{v[1][1]}, s), t);
  const double patches = static_cast<double>(width_) * static_cast<double>(height_);
  return static_cast<float>(patch.chance * here / mean * patches / (2 * pi * pi * sine));
}

std::optional<EnvironmentSample> EnvironmentSampler::sample(std::array<float, 2> random) const {
  if (rows_.empty()) return std::nullopt;
  const auto y =
      static_cast<std::size_t>(pick(rows_.begin(), rows_.end(), static_cast<double>(random[1])));
  const auto first = columns_.begin() + static_cast<std::ptrdiff_t>(y * width_);
  const auto x =
      static_cast<std::size_t>(pick(first, first + static_cast<std::ptrdiff_t>(width_), random[0]));
  // The rest of each number says where inside the patch.
  const double y_from = y > 0 ? rows_[y - 1] : 0;
  const double x_from = x > 0 ? columns_[y * width_ + x - 1] : 0;
  const double y_span = rows_[y] - y_from;
  const double x_span = columns_[y * width_ + x] - x_from;
  const double v = y_span > 0 ? std::clamp((random[1] - y_from) / y_span, 0.0, 1.0) : 0.5;
  const double u = x_span > 0 ? std::clamp((random[0] - x_from) / x_span, 0.0, 1.0) : 0.5;
  const Patch here = patch(y, x);
  const auto& light = here.light;
  const double t =
      sample_slope(double{light[0][0]} + light[0][1], double{light[1][0]} + light[1][1], v);
  const double s = sample_slope(std::lerp(double{light[0][0]}, double{light[1][0]}, t),
                                std::lerp(double{light[0][1]}, double{light[1][1]}, t), u);
  const double azimuth =
      (0.5 - (static_cast<double>(x) + s) / static_cast<double>(width_)) * 2 * pi;
  const double angle = (static_cast<double>(y) + t) / static_cast<double>(height_) * pi;
  const double sine = std::sin(angle);
  EnvironmentSample sample;
  sample.density = per_steradian(here, s, t, sine);
  if (!(sample.density > 0)) return std::nullopt;
  sample.direction = {static_cast<float>(sine * std::cos(azimuth)),
                      static_cast<float>(sine * std::sin(azimuth)),
                      static_cast<float>(std::cos(angle))};
  sample.radiance = radiance(sample.direction);
  return sample;
}

float EnvironmentSampler::density(Vec3f direction) const {
  if (rows_.empty()) return 0;
  const double sine = std::hypot(direction.x, direction.y);
  const auto w = static_cast<double>(width_);
  const auto h = static_cast<double>(height_);
  const double u = std::clamp(0.5 - std::atan2(direction.y, direction.x) / (2 * pi), 0.0, 1.0) * w;
  const double v = std::clamp(std::atan2(sine, double{direction.z}) / pi, 0.0, 1.0) * h;
  const double x = std::min(std::floor(u), w - 1);
  const double y = std::min(std::floor(v), h - 1);
  return per_steradian(patch(static_cast<std::size_t>(y), static_cast<std::size_t>(x)), u - x,
                       v - y, sine);
}

}  // namespace render
