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

// Follows the map at its full size, and between texels too: look-ups are bilinear, and so is each
// quarter of a texel, which is sampled exactly in proportion to its light. So radiance over density
// hardly varies, however few texels hold the sun. Keeps a copy with counted radiance
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
  // A quarter of a texel: the light (all colours together) at its corners, and its chance.
  struct Patch {
    float light[2][2];  // [lower][right]
    double chance = 0;
  };
  Patch patch(std::size_t row, std::size_t column) const;
  // Density over the unit square of the patch, times its chance, to density per steradian.
  float per_steradian(const Patch& patch, double s, double t, double sine) const;

  Environment environment_;
  std::size_t width_ = 0;  // of the grid of patches
  std::size_t height_ = 0;
  std::vector<float> corners_;  // (height_ + 1, width_ + 1)
  std::vector<double> rows_;    // cumulative, up to 1
  std::vector<float> columns_;  // per row cumulative, up to 1
};

}  // namespace render
