// Directions of an environment, chosen in proportion to their light.
#include "render/environment_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render {
namespace {

constexpr double pi = std::numbers::pi;

// First entry above `value`; the last one that is above its predecessor if rounding passes the end.
template <class Iterator, class T>
std::ptrdiff_t pick(Iterator first, Iterator last, T value) {
  const auto found = std::upper_bound(first, last, value);
  if (found != last) return found - first;
  return std::lower_bound(first, last, *(last - 1)) - first;
}

}  // namespace

EnvironmentSampler::EnvironmentSampler(const Environment& environment)
    : width_(environment.radiance.width), height_(environment.radiance.height) {
  environment_.radiance = environment.radiance;
  for (float& value : environment_.radiance.pixels) value = counted_radiance(value);
  const auto w = static_cast<std::size_t>(width_);
  const auto h = static_cast<std::size_t>(height_);
  std::vector<float> light(w * h);
  for (std::size_t i = 0; i < light.size(); ++i) {
    const float* rgb = &environment_.radiance.pixels[i * 3];
    light[i] = rgb[0] + rgb[1] + rgb[2];
  }
  // Look-ups are bilinear: a texel's mean takes 1/8 from each neighbour along each axis.
  std::vector<float> across(w * h);
  for (std::size_t y = 0; y < h; ++y)
    for (std::size_t x = 0; x < w; ++x)
      across[y * w + x] = 0.75F * light[y * w + x] + 0.125F * light[y * w + (x + 1) % w] +
                          0.125F * light[y * w + (x + w - 1) % w];
  densities_.resize(w * h);
  rows_.resize(h);
  columns_.resize(w * h);
  double total = 0;
  for (std::size_t y = 0; y < h; ++y) {
    const double solid_angle = texel_solid_angle(static_cast<int>(y), width_, height_);
    double row = 0;
    for (std::size_t x = 0; x < w; ++x) {
      // Beyond a pole lies the row itself, half way around.
      const float above = y > 0 ? across[(y - 1) * w + x] : across[(x + w / 2) % w];
      const float below = y + 1 < h ? across[(y + 1) * w + x] : across[y * w + (x + w / 2) % w];
      const double weight =
          solid_angle * (0.75 * across[y * w + x] + 0.125 * above + 0.125 * below);
      densities_[y * w + x] = static_cast<float>(weight);
      row += weight;
      columns_[y * w + x] = static_cast<float>(row);
    }
    for (std::size_t x = 0; x < w; ++x)
      columns_[y * w + x] = row > 0 ? static_cast<float>(columns_[y * w + x] / row) : 1.0F;
    total += row;
    rows_[y] = total;
  }
  if (!(total > 0)) {
    densities_.assign(densities_.size(), 0);
    rows_.clear();
    return;
  }
  for (double& row : rows_) row /= total;
  // What is sampled is what the rounded table says, texel by texel.
  for (std::size_t y = 0; y < h; ++y) {
    const double row = rows_[y] - (y > 0 ? rows_[y - 1] : 0);
    for (std::size_t x = 0; x < w; ++x) {
      const double share = columns_[y * w + x] - (x > 0 ? columns_[y * w + x - 1] : 0.0F);
      densities_[y * w + x] =
          static_cast<float>(row * share * static_cast<double>(w * h) / (2 * pi * pi));
    }
  }
}

std::optional<EnvironmentSample> EnvironmentSampler::sample(std::array<float, 2> random) const {
  if (rows_.empty()) return std::nullopt;
  const auto w = static_cast<std::size_t>(width_);
  const auto y =
      static_cast<std::size_t>(pick(rows_.begin(), rows_.end(), static_cast<double>(random[1])));
  const auto row = columns_.begin() + static_cast<std::ptrdiff_t>(y * w);
  const auto x = static_cast<std::size_t>(pick(row, row + width_, random[0]));
  // The rest of each number says where inside the texel.
  const double y_from = y > 0 ? rows_[y - 1] : 0;
  const float x_from = x > 0 ? columns_[y * w + x - 1] : 0;
  const double fy = std::clamp((random[1] - y_from) / (rows_[y] - y_from), 0.0, 1.0);
  const float x_span = columns_[y * w + x] - x_from;
  const float fx = x_span > 0 ? std::clamp((random[0] - x_from) / x_span, 0.0F, 1.0F) : 0.5F;
  const double azimuth = (0.5 - (static_cast<double>(x) + fx) / width_) * 2 * pi;
  const double angle = (static_cast<double>(y) + fy) / height_ * pi;
  const double sine = std::sin(angle);
  const float density = densities_[y * w + x];
  if (!(density > 0) || !(sine > 1e-9)) return std::nullopt;
  EnvironmentSample sample;
  sample.direction = {static_cast<float>(sine * std::cos(azimuth)),
                      static_cast<float>(sine * std::sin(azimuth)),
                      static_cast<float>(std::cos(angle))};
  sample.radiance = radiance(sample.direction);
  sample.density = static_cast<float>(density / sine);
  return sample;
}

float EnvironmentSampler::density(Vec3f direction) const {
  if (rows_.empty()) return 0;
  const float across = std::hypot(direction.x, direction.y);
  if (!(across > 1e-9F)) return 0;
  const double u = 0.5 - std::atan2(direction.y, direction.x) / (2 * pi);
  const double v = std::atan2(across, direction.z) / pi;
  const int x = std::clamp(static_cast<int>(u * width_), 0, width_ - 1);
  const int y = std::clamp(static_cast<int>(v * height_), 0, height_ - 1);
  return densities_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                    static_cast<std::size_t>(x)] /
         across;
}

}  // namespace render
