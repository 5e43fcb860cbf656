// How near bare screen is to each place of a frame: what a colour means depends on it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compositing/key_lanes.h"

namespace compositing {

// On cells of 8x8 pixels: 1 near screen that is in sight .. 0 deep within what stands before it.
// Between cells' centres it is bilinear.
struct ScreenNear {
  static constexpr int cell = 8;
  int rows = 0, columns = 0;
  std::vector<float> cells;        // (rows, columns)
  std::vector<std::uint8_t> even;  // of each: whether it and the eight around it are alike
  std::vector<float> squares;      // of find_near()

  float at(int y, int x) const;  // of a pixel; 1 if there are no cells
};

// From which cells show the screen (above 0): 1 up to `near` cells from the next of them, 0 from
// `deep` on. `found` has as many cells.
void find_near(std::span<const float> shows, float near, float deep, ScreenNear& found);

// Eights of pixels of a row of the frame.
class NearRow {
 public:
  // For a picture with cells.
  NearRow(const ScreenNear& near, int y);

  // Eight pixels from x on, a multiple of 8: whether all are as their cell is, and that is 0.
  bool is_even(int x) const { return even_[x / ScreenNear::cell] != 0; }
  bool is_deep(int x) const { return is_even(x) && nearest_[x / ScreenNear::cell] == 0; }
  F8 at(int x) const {
    const int column = x / ScreenNear::cell;
    const float here = blended(column);
    const float left = blended(column > 0 ? column - 1 : 0);
    const float right = blended(column < last_ ? column + 1 : last_);
    // Halves of each cell lean to the one beside them.
    constexpr F8 to_left{.4375F, .3125F, .1875F, .0625F, 0, 0, 0, 0};
    constexpr F8 to_right{0, 0, 0, 0, .0625F, .1875F, .3125F, .4375F};
    return here + (left - here) * to_left + (right - here) * to_right;
  }

 private:
  float blended(int column) const { return between(above_[column], below_[column], down_); }

  const std::uint8_t* even_;  // of the row of cells that it lies in
  const float* nearest_;
  const float* above_;
  const float* below_;
  float down_;  // of the way between them
  int last_;
};

}  // namespace compositing
