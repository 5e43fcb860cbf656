// What is laid on the made car's body: lamps, grille, plates, windows. Private to made_car.
#pragma once

#include <vector>

#include "render/made_car_shape.h"
#include "render/surface_patches.h"

namespace render {

struct CarTrim {
  Mesh mesh;
  std::vector<CoveredArea> on_band, on_cabin;  // what it hides of these
};
CarTrim make_car_trim(const CarShape& shape);

}  // namespace render
