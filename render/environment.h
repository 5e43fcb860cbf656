// Light from all directions, as the probe sees it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "calibrate/vec.h"
#include "capture/image.h"

namespace render {

using calibrate::Vec3f;

// Latitude-longitude map in the set's frame: row 0 looks up (+z); column u = (x + .5) / width stands
// for azimuth atan2(y, x) = (0.5 - u) * 2 pi. Radiance in the plate's units (match applied).
struct Environment {
  capture::Image radiance;         // (height, 2 * height, 3)
  std::vector<std::uint8_t> seen;  // per texel, 1 = the probe saw it, 0 = filled
  // The map smoothed by GGX lobes of growing roughness, for reflections: level k is for roughness
  // k / (levels - 1), each (level_height[k], 2 * level_height[k], 3). Level 0 is `radiance` itself.
  std::vector<capture::Image> smoothed;
};

// Direction of texel centre (x, y), continuous, and back. 0 <= x <= width.
Vec3f direction_of_texel(float x, float y, int width, int height);
std::array<float, 2> texel_of_direction(Vec3f direction, int width, int height);

// Radiance in a direction (unit), bilinear; `roughness` 0..1 picks between smoothed levels.
Vec3f radiance_of(const Environment& env, Vec3f direction, float roughness);

// Fills `smoothed` with `levels` levels. About 2 ms for 512x256.
void smooth_for_reflections(Environment& env, int levels = 6);

// How directions that the probe did not see are filled.
enum class Unseen { floor, mirror, mean };

}  // namespace render
