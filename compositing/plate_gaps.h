// Whether frames show the screen where their clean plate shows something else.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compositing/clean_plate.h"
#include "compositing/screen_key.h"

namespace compositing {

// What stood before the screen while its plate was taken, and has gone since, is in the way for
// good: the screen there is taken for the person. Such places are looked for in cells of 8x8 pixels
// that have, as all around them, nothing of the screen in the plate: a picture that is off by less
// than a cell changes nothing.
class PlateGaps {
 public:
  // `bare` is without gain; one of PlateUse::difference has no gaps. `masked`: of each 8x8 pixels
  // whether a mask covers any, or empty; such cells do not count.
  explicit PlateGaps(const LitPlate& bare, std::span<const std::uint8_t> masked = {});

  // Share of the picture, of what no mask covers, that shows the screen in a gap: its colour, and
  // .5 to 2 of the light that the screen around it says, times `gain`. Frames of the plate's size,
  // with channels in the plate's order. Allocates nothing.
  template <class Rows>
  float look(const Rows& frame, float gain) const;

 private:
  static constexpr int cell = 8;

  struct Gap {
    int row = 0, column = 0;
    ScreenLight screen{};  // as it would be there
  };

  int height_, width_;
  ScreenColour colour_;
  float counted_ = 0;  // cells that no mask covers
  std::vector<Gap> gaps_;
};

}  // namespace compositing
