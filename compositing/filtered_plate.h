// The clean plate, filtered over as much as a look-up of its frame is.
#pragma once

#include <array>

#include "compositing/clean_plate.h"
#include "compositing/keyed_texture.h"

namespace compositing {

// A frame that is filtered first and keyed then has to be compared with a plate that is filtered
// alike: of a background that is no smooth screen, one pixel stands for nothing around it.
class FilteredPlate {
 public:
  // Of a plate before it is lit (PlateLight::bare).
  explicit FilteredPlate(const LitPlate& bare);

  // A cell of `lit`, which must be of the same plate, as seen from (u, v); `nearest` is the one
  // there, whose light over the bare plate's is taken for that of all that is filtered.
  std::array<float, 4> at(
      const LitPlate& lit, const float* nearest, float u, float v, float footprint_uv) const;

 private:
  KeyedTexture cells_;   // channels in the keyer's order
  float across_, down_;  // of the cells' size, the frame's
  float fine_uv_;        // up to which the nearest cell will do
};

}  // namespace compositing
