// How far a shown frame is from the truth.
#pragma once

#include "render/reference.h"
#include "studio/show.h"

namespace studio {

// Renders the reference of a frame with `samples` paths per pixel, and compares: over the pixels
// that anything virtual changed. Takes minutes at high samples.
render::PictureError error_of(const ShownFrame& shown, int samples);

}  // namespace studio
