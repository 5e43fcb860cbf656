// Directions of an environment, chosen in proportion to their light.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "render/environment.h"

namespace render {

struct EnvironmentSample {
  Vec3f direction;  // unit
  Vec3f radiance;
  float density = 0;  // with which it is chosen, per steradian
};

// Works on every texel of the map at its full size. Keeps a copy with counted radiance
// (environment.h).
class EnvironmentSampler {
 public:
  explicit EnvironmentSampler(const Environment& environment);

  // Nothing if the map is black.
  std::optional<EnvironmentSample> sample(std::array<float, 2> random) const;
  // Density of a direction; 0 where the map (between texels, too) is black.
  float density(Vec3f direction) const;
  Vec3f radiance(Vec3f direction) const { return radiance_of(environment_, direction, 0); }

 private:
  Environment environment_;
  int width_ = 0;
  int height_ = 0;
  std::vector<double> rows_;      // cumulative, up to 1
  std::vector<float> columns_;    // per row cumulative, up to 1
  std::vector<float> densities_;  // per texel, times the sine of the angle from the pole
};

}  // namespace render
