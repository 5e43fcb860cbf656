// Photographs under conditions that no camera knows.
#pragma once

#include <span>

#include "capture/image.h"
#include "render/light_table.h"
#include "render/reference.h"

namespace render {

struct PhotographView {
  // The camera looks through virtual objects: it sees the real things (instances of kind stand_in,
  // here of the shader "standard") with the shadows and the light that virtual ones give them.
  bool behind_virtual = false;
  // Stand for all that glows, where it lights diffuse surfaces: a small lamp is met by few paths.
  std::span<const LocalLight> lamps = {};
};

// As photograph(), in that view. Returns radiance (height, width, 3).
capture::Image photograph(const FrameInputs& inputs,
                          const calibrate::Pose& cam_from_set,
                          const ReferenceSettings& settings,
                          const PhotographView& view);

}  // namespace render
