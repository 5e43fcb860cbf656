// Which pixels of a lightprobe's picture each texel of an environment takes, and how much of each.
#pragma once

#include <cstdint>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace render {

// The picture is first shrunk by a whole number of pixels, so that a texel takes a few pixels only.
// Entries first[t] to first[t + 1] belong to texel t of the (height, 2 * height) environment; their
// weights add up to 1 for a seen texel. Texels that are seen by less than half have none.
struct ProbeGather {
  int shrink = 1;
  int width = 0, height = 0;  // of the shrunk picture
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> pixel;  // of the shrunk picture, row by row
  std::vector<float> weight;
};

// Made once per camera. Throws as calibrate::check().
ProbeGather make_probe_gather(const calibrate::Lens& lens,
                              const calibrate::Pose& probe_from_set,
                              int environment_height);

}  // namespace render
