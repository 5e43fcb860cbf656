// What keying a frame keeps: rows at hand, and alpha of the frame before.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compositing/key_lanes.h"
#include "compositing/key_texel.h"

namespace compositing {

// Eight pixels of a row on their way; set before they are read.
struct KeyBlock {
  int x;
  int count;                       // of pixels that are in the frame
  std::array<F8, 3> light, plate;  // in the keyer's order
  TexelMatte<F8> matte;
  F8 before;  // alpha of the frame before
};

// What smoothed alpha of eight pixels was in the frame before.
enum class KeyPast : std::uint8_t {
  clear,  // 0
  faint,  // haze, which counts as none
  mixed,
  whole  // 1
};

// What quick keying sees of 8x8 pixels at a glance.
struct KeyLook {
  std::uint8_t bare = 0;  // rows that are screen, a bit each
  bool open = false;      // any are, or a mask hides it
  bool plain = false;     // has none of the screen's colour
};

struct KeyScratch {
  std::array<std::vector<int>, 8> places;        // x of blocks that are not bare, of eight rows
  std::array<std::vector<KeyBlock>, 2> waiting;  // of two rows, for the one below
  std::vector<float> change;                     // of alpha, of three rows
  std::array<std::vector<int>, 3> changed;       // x of blocks whose change may not be 0
  std::vector<KeyPast> past;                     // for each 8x8 pixels, one of each row
  std::vector<std::uint16_t> previous;  // smoothed alpha where it is mixed or faint, 1 = 65535, of
                                        // each 8x8 pixels; halves if keyed quickly
  std::vector<std::uint8_t> written;    // as KeyedFrame has it, for pictures that do not
  std::vector<CodeBounds> bare_codes;   // what is screen, of each 8x8 pixels; empty: nothing
  std::vector<LightBounds> bare_light;
  std::array<std::vector<KeyLook>, 3> looks;  // of three rows of blocks, and one on either side
  bool has_previous = false;
};

}  // namespace compositing
