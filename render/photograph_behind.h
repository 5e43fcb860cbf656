// The photograph of what stands behind virtual objects.
#pragma once

#include "capture/image.h"
#include "render/reference.h"

namespace render {

// As photograph(), but the camera looks through virtual objects: it sees the real things (instances
// of kind stand_in, here of the shader "standard") with the shadows and the light that the virtual
// objects give them. Returns radiance (height, width, 3).
capture::Image photograph_behind(const FrameInputs& inputs,
                                 const calibrate::Pose& cam_from_set,
                                 const ReferenceSettings& settings);

}  // namespace render
