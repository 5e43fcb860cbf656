// What a video camera makes of light: noise, clipping, sRGB, 4:2:0, 8 bits.
#pragma once

#include <cstdint>
#include <vector>

#include "capture/image.h"

namespace compositing {

struct MadeSensor {
  float noise_gain = 1e-4F;    // variance per light
  float noise_floor = 1e-6F;   // variance
  bool halved_chroma = false;  // BT.709 Y'CbCr, limited range, chroma averaged over 2x2 pixels and
                               // interpolated again, as a decoder would
};

// sRGB codes (height, width, 3) of scene-linear light, clipped to 0..1; odd sizes are legal. The
// same seed gives the same noise.
std::vector<std::uint8_t> photograph_light(const capture::Image& light,
                                           const MadeSensor& sensor,
                                           std::uint64_t seed);

}  // namespace compositing
