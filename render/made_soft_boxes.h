// The light of a made room or studio: soft boxes on dim walls, as a map.
#pragma once

#include <span>

#include "calibrate/vec.h"
#include "capture/image.h"

namespace render {

using calibrate::Vec3f;

// A glowing rectangle far away.
struct SoftBox {
  Vec3f direction;  // of its middle; need not be unit, not straight up or down
  float width_rad = 0, height_rad = 0;
  Vec3f radiance;
};

// Latitude-longitude map (height, 2 * height, 3) as in render::Environment: `above` straight up,
// `level` around, `below` straight down, smooth between, with the boxes over it, their edges soft.
capture::Image make_soft_box_map(
    int height, Vec3f above, Vec3f level, Vec3f below, std::span<const SoftBox> boxes);

}  // namespace render
