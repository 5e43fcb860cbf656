// What keying a frame keeps: rows at hand, and alpha of the frame before.
#pragma once

#include <cstdint>
#include <vector>

#include "compositing/key_lanes.h"

namespace compositing {

struct KeyScratch {
  std::vector<float> rows;              // laid out by key_pass.h
  std::vector<std::uint16_t> previous;  // smoothed alpha, 1 = 65535, rows padded to whole blocks
  std::vector<char> clear;              // blocks of two rows that are clear at a glance
  std::vector<CodeBounds> bare;         // codes that are, for each 8x8 pixels
  bool has_previous = false;
};

}  // namespace compositing
