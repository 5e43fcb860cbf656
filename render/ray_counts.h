// What each pixel of a picture took of the kernel.
#pragma once

#include <cstdint>
#include <vector>

namespace render {

// Of one pixel, whichever frame its rays were traced in.
struct RayCount {
  std::uint32_t rays = 0;         // camera rays, and those that surfaces sent on
  std::uint32_t shadow_rays = 0;  // from all that they met
  std::uint32_t depth = 0;  // of the tree: surfaces before its last ray; 0 = camera rays alone
  // Standard error of the mean of its further samples, in radiance as the kernel decides by it; 0
  // where there is only the centre's.
  float error = 0;
  friend bool operator==(const RayCount&, const RayCount&) = default;
};

struct RayCounts {
  int width = 0, height = 0;
  std::vector<RayCount> pixels;  // row by row
};

}  // namespace render
