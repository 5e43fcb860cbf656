// Brackets of a made scene: radiance known, taken by a camera with known response and noise.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "capture/hdr.h"
#include "capture/response.h"

namespace made {

// A scene of many patches over 14 stops about 1, each of a slight ramp so that rounding to codes
// averages out.
struct Scene {
  int width = 0;
  int height = 0;
  std::vector<double> radiance;  // (height, width, 3)
};

inline Scene patches(int width, int height, unsigned seed) {
  constexpr int patch = 8;
  constexpr double stops = 14;
  constexpr double ramp = 0.1;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> level(-stops / 2, stops / 2);
  std::uniform_real_distribution<double> tint(-0.5, 0.5);
  Scene scene{width, height, {}};
  scene.radiance.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  for (int y0 = 0; y0 < height; y0 += patch) {
    for (int x0 = 0; x0 < width; x0 += patch) {
      const double grey = level(random);
      for (int c = 0; c < 3; ++c) {
        const double value = std::exp2(grey + tint(random));
        for (int y = y0; y < std::min(height, y0 + patch); ++y) {
          for (int x = x0; x < std::min(width, x0 + patch); ++x) {
            scene.radiance[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x)) *
                               3 +
                           static_cast<std::size_t>(c)] = value * (1 + ramp * (x - x0) / patch);
          }
        }
      }
    }
  }
  return scene;
}

// The shot's codes: light to code by the inverse of `light_of_code`, noise in light.
template <class LightOfCode>
capture::Still8 photograph(const Scene& scene,
                           double exposure_s,
                           LightOfCode light_of_code,
                           unsigned seed) {
  // Codes are looked up in the rising table of the light at the middle between two codes.
  std::vector<double> borders;
  for (int code = 0; code < 255; ++code) borders.push_back(light_of_code((code + 0.5) / 255));
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  capture::Still8 still{scene.width, scene.height, 3, {}};
  still.texels.reserve(scene.radiance.size());
  for (const double radiance : scene.radiance) {
    const double mean = radiance * exposure_s;
    const double light = mean + noise(random) * std::sqrt(1e-7 + 2e-5 * mean);
    still.texels.push_back(static_cast<std::uint8_t>(
        std::upper_bound(borders.begin(), borders.end(), light) - borders.begin()));
  }
  return still;
}

inline double normal_density(double x) {
  return std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi);
}
inline double normal_share(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }

// Fisher's information on radiance from one shot whose values from `saturation` on are known only
// to lie there.
inline double information(double radiance, double exposure_s, const capture::NoiseModel& noise) {
  const double mean = radiance * exposure_s;
  const double deviation = std::sqrt(noise.variance(mean));
  const double edge = (noise.saturation - mean) / deviation;
  // For a normal value cut off at `edge`: of the part below, the integral of u^2 density; of the
  // event above, density^2 / share.
  const double below = normal_share(edge) - edge * normal_density(edge);
  const double above = normal_share(-edge);
  const double event = above > 1e-12 ? normal_density(edge) * normal_density(edge) / above : 0;
  return exposure_s * exposure_s / (deviation * deviation) * (below + event);
}

}  // namespace made
