// The squares of a cell: all of it, its 8x8 and its 4x4 blocks. Private to the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "render/cell_visibility.h"

namespace render {

struct Square {
  std::size_t side, first;  // its top left pixel
};
// By number: the cell, its 8x8 blocks, row by row, its 4x4 blocks.
inline constexpr std::size_t all_squares = 21;
inline Square square_of(std::size_t bit) {
  if (bit == 0) return {16, 0};
  if (bit < 5) return {8, (bit - 1) / 2 * 8 * cell_size + (bit - 1) % 2 * 8};
  return {4, (bit - 5) / 4 * 4 * cell_size + (bit - 5) % 4 * 4};
}
// The four squares within one.
inline std::array<std::size_t, 4> parts_of(std::size_t bit) {
  if (bit == 0) return {1, 2, 3, 4};
  const std::size_t first = 5 + (bit - 1) / 2 * 8 + (bit - 1) % 2 * 2;
  return {first, first + 1, first + 4, first + 5};
}
inline std::array<std::size_t, 4> corners_of(const Square& s) {
  const std::size_t last = s.side - 1, below = s.first + last * cell_size;
  return {s.first, s.first + last, below, below + last};
}
inline bool holds_all(const CellMask& mask, const Square& s) {
  for (std::size_t y = 0; y < s.side; ++y) {
    const std::size_t k = s.first + y * cell_size;
    const std::uint64_t row = (std::uint64_t{1} << s.side) - 1;
    if ((mask[k / 64] >> (k % 64) & row) != row) return false;
  }
  return true;
}
inline void take_out(CellMask& mask, const Square& s) {
  for (std::size_t y = 0; y < s.side; ++y) {
    const std::size_t k = s.first + y * cell_size;
    mask[k / 64] &= ~(((std::uint64_t{1} << s.side) - 1) << (k % 64));
  }
}

}  // namespace render
