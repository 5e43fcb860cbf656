// OpenCV's HDR merges, to measure ours against.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "capture/image.h"

namespace studio {

enum class OpenCvMerge { debevec, robertson };

// One shot of 8-bit codes: (height, width, 3), interleaved.
struct OpenCvShot {
  const std::uint8_t* codes = nullptr;
  double exposure_s = 0;
};

// Merges shots of one size. `light_of_code` is the light of each of the 256 codes, above 0, the
// same in all channels. Returns radiance up to a factor; 0 where OpenCV gives none. The picture
// keeps its memory from call to call.
void merge_with_opencv(OpenCvMerge method,
                       std::span<const OpenCvShot> shots,
                       int width,
                       int height,
                       std::span<const float> light_of_code,
                       capture::Image& radiance);

}  // namespace studio
