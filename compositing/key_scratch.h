// What keying a frame keeps: rows at hand, and alpha of the frame before.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compositing/key_lanes.h"
#include "compositing/key_texel.h"

namespace compositing {

// Eight pixels of a row on their way.
struct KeyBlock {
  int x = 0;
  int count = 0;                       // of pixels that are in the frame
  std::array<F8, 3> light{}, plate{};  // in the keyer's order
  F8 plate_last{};                     // the last value of the plate's cell
  TexelShare<F8> share{};
  TexelMatte<F8> matte{};
};

struct KeyScratch {
  std::array<std::vector<KeyBlock>, 2> blocks;  // of two rows
  std::vector<float> change;                    // of alpha, of three rows
  std::vector<std::uint16_t> previous;  // smoothed alpha, 1 = 65535, rows padded to whole blocks
  std::vector<CodeBounds> bare_codes;   // what is screen, of each 8x8 pixels; empty: nothing
  std::vector<LightBounds> bare_light;
  bool has_previous = false;
};

}  // namespace compositing
