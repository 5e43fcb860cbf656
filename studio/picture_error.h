// How far a shown frame is from the truth.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "render/reference.h"
#include "studio/show.h"

namespace studio {

// Two references of a frame, with independent noise, and where anything virtual changed it.
struct Truth {
  std::array<capture::Image, 2> references;  // (height, width, 4)
  capture::Image mask;                       // (height, width, 1)
};

// Two references, rendered with the seeds 1 and 2, of a picture over `plate` (height, width, 3).
Truth truth_of(const capture::Image& plate,
               const std::function<capture::Image(std::uint32_t seed)>& reference);

// Renders the reference of a frame twice, with half of `samples` (at least 2) paths per pixel each.
// Takes minutes at high samples.
Truth truth_of(const ShownFrame& shown, int samples);

// What both together show, (height, width, 4): half the noise of the one, in squares.
capture::Image mean_of(const Truth& truth);

// The same frame at another effort may be compared as well. The references' noise is reported, and
// is no part of the error.
render::PictureError error_against(const Truth& truth, const ShownFrame& shown);

}  // namespace studio
