// The plain alternative to a table of lights: every pixel draws its own. For charts.
#pragma once

#include <cstdint>

#include "capture/image.h"
#include "render/renderer.h"

namespace render {

struct SampledLightSettings {
  int samples = 16;  // of the light, per pixel: 1 to 16384
  std::uint32_t seed = 1;
};

// The composite under the whole environment: one camera ray through each pixel's centre, and from
// what it meets `samples` shadow rays in directions that are drawn in proportion to the
// environment's light, well spread over it, others from pixel to pixel. It does for a pixel what
// the kernel does with one sample and every light tested: the same shaders, the same streams of
// rays. Directions are drawn once a call, 16384 of them, and each pixel takes a run of these.
//
// Returns (height, width, 4): RGB and coverage. `plate` linear (height, width, 3). What mirrors
// show and what lamps light is left out. Throws std::invalid_argument for sizes that differ,
// samples out of range, and scenes with glass, holes or stand-ins that block light.
capture::Image render_sampled_light(const FrameInputs& inputs,
                                    const FrameJob& job,
                                    const capture::Image& plate,
                                    const SampledLightSettings& settings);

}  // namespace render
