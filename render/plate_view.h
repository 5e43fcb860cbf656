// How a ray that is not straight on sees the plate. Private to the kernel.
#pragma once

#include "render/environment.h"

namespace render {

// And what it sees where that is not.
struct PlateView {
  Vec3f sees;  // the environment, there
  float roughness = 0;
  Spread spread;
  bool one_of_many = false;
  bool mirrored = false;  // else bent
  float share = 0;        // of the plate
  double x = 0, y = 0;    // in its pixels
};

}  // namespace render
