// Keying many texels of a frame at once, wherever they lie: for rays that come in bundles.
#pragma once

#include <array>
#include <span>

#include "compositing/clean_plate.h"
#include "compositing/key_lanes.h"
#include "compositing/key_texel.h"

namespace compositing {

// Eight texels of a frame.
struct TexelLanes {
  I8 y{}, x{};  // pixels; beyond the frame the nearest counts
  std::array<F8, 3>
      light{};  // red, green and blue, scene-linear; what is not finite, or negative, is 0
};

// Premultiplied RGB and alpha of each, by the nearest cell of the plate: key_texel() (keyer.h) of
// eight times as many as there are `texels`. `keyed` has as many places. Allocates nothing.
void key_texels(const LitPlate& plate,
                const KeyDials& dials,
                std::span<const TexelLanes> texels,
                std::array<F8, 4>* keyed);

}  // namespace compositing
