// How far a shown frame is from the truth.
#pragma once

#include "render/reference.h"
#include "studio/show.h"

namespace studio {

// The reference of a frame, and where anything virtual changed it.
struct Truth {
  capture::Image picture;  // (height, width, 3)
  capture::Image mask;     // (height, width, 1)
};

// Renders the reference of a frame with `samples` paths per pixel. Takes minutes at high samples.
Truth truth_of(const ShownFrame& shown, int samples);

// The same frame at another effort may be compared as well.
render::PictureError error_against(const Truth& truth, const ShownFrame& shown);

}  // namespace studio
