// The reference: a plain path tracer, for truth.
#pragma once

#include "capture/image.h"
#include "render/renderer.h"

namespace render {

struct ReferenceSettings {
  int samples = 1024;  // paths per pixel
  int max_depth = 16;  // then Russian roulette has long ended them
  std::uint32_t seed = 1;
  // Bounces of light between surfaces. Off: virtual objects see the environment, and each other
  // only by mirror and glass, as the live kernel does. On: everything (the photograph).
  bool bounces = false;
};

// The composite that the kernel would show with endless samples, with every light in the whole
// environment (not a table): stand-ins catch shadows by the same formula, in float.
// Returns (height, width, 4): RGB and coverage. `plate` linear (height, width, 3).
capture::Image render_reference(const FrameInputs& inputs,
                                const FrameJob& job,
                                const capture::Image& plate,
                                const ReferenceSettings& settings);

// The photograph: every instance is taken as a real surface of the shader "standard", lit by the
// environment and its own emission, path-traced with bounces; where a ray leaves the scene, the
// environment is seen. Returns radiance (height, width, 3) before lens noise and response.
capture::Image photograph(const FrameInputs& inputs,
                          const calibrate::Pose& cam_from_set,
                          const ReferenceSettings& settings);

// The design's error of a picture: sqrt(sum (x - r)^2 / sum r^2) over pixels where `mask` (height,
// width, 1) is above 0, both clamped at `clamp`; and the unclamped 99th percentile of |x - r| over
// the root mean square of r.
struct PictureError {
  double relative_rms = 0;
  double p99 = 0;
  double delta_e_mean = 0, delta_e_p95 = 0, delta_e_p99 = 0;  // OK Lab x 100 in display space
  std::size_t pixels = 0;
};
PictureError picture_error(const capture::Image& x,
                           const capture::Image& r,
                           const capture::Image& mask,
                           float clamp = 4.0F);

}  // namespace render
