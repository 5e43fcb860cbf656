// The reference: a plain path tracer, for truth.
#pragma once

#include <array>

#include "capture/image.h"
#include "render/renderer.h"

namespace render {

struct ReferenceSettings {
  int samples = 1024;  // paths per pixel in the mean: noisy pixels get more, from 32 on
  // Then Russian roulette has long ended paths, but for those that clear bodies mirror inside: two
  // crossed boxes of index 2.4 hold one in a hundred for more than 128 crossings.
  int max_depth = 4096;
  std::uint32_t seed = 1;
  // Bounces of light between surfaces. Off: virtual objects see the environment, and each other
  // only by mirror and glass, as the live kernel does. On: everything (the photograph). A job with
  // lamps of bounced light has them on, and those lamps left out.
  bool bounces = false;
};

// The composite that the kernel would show with endless samples, with every light in the whole
// environment (not a table): stand-ins catch shadows by the same formula, in float.
// Where the job asks for caustic photons, clear bodies bend all light that stand-ins and dull
// surfaces get; else it goes straight through them to those.
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

// Where a reference (height, width, 4) shows anything but its plate (height, width, 3), as a mask
// (height, width, 1) of ones and zeros: where it is covered, or its light differs by more than a
// thousandth, which neither an eye nor eight bits can tell. Throws std::invalid_argument if sizes
// differ.
capture::Image affected_mask(const capture::Image& reference, const capture::Image& plate);

// The design's error of a picture: sqrt(sum (x - r)^2 / sum r^2) over pixels where `mask` (height,
// width, 1) is above 0, both clamped at `clamp`; and the unclamped 99th percentile of |x - r| over
// the root mean square of r.
struct PictureError {
  double relative_rms = 0;
  double p99 = 0;
  double delta_e_mean = 0, delta_e_p95 = 0, delta_e_p99 = 0;  // OK Lab x 100 in display space
  std::size_t pixels = 0;
  double reference_noise = 0;  // relative_rms of the reference itself; 0 if that is not known
};
PictureError picture_error(const capture::Image& x,
                           const capture::Image& r,
                           const capture::Image& mask,
                           float clamp = 4.0F);

// The same against two references of independent noise, which then does not count as an error of
// the picture: sqrt(sum (x - a)(x - b) / sum a b), 0 if the sum is negative. All else is against
// their mean, whose noise is sqrt(sum (a - b)^2 / 4 / sum a b).
PictureError picture_error(const capture::Image& x,
                           const std::array<capture::Image, 2>& references,
                           const capture::Image& mask,
                           float clamp = 4.0F);

}  // namespace render
