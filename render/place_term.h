// What a cell's slot takes of a picture at a place. Private to the kernel.
#pragma once

#include <cstdint>

#include "calibrate/vec.h"

namespace render {

// Slot += weight * a level of a picture at a place.
struct PlaceTerm {
  calibrate::Vec3f weight;
  float x, y;  // in the level's pixels; in the environment's from -1 to its width or height
  std::uint16_t slot, level;
};

}  // namespace render
