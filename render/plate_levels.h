// The plate as rays see it that clear bodies bend, or that mirrors send on. Private to the kernel.
#pragma once

#include <algorithm>
#include <vector>

#include "calibrate/lens.h"
#include "capture/half.h"
#include "capture/image.h"

namespace render {

// What light of the plate is divided by where it is seen elsewhere.
inline float sensitivity_of_plate(float sensitivity) { return std::max(sensitivity, 0.05F); }

// The plate as a lens without vignetting would give it, and its halves until the shorter side is 1
// pixel: (height, width, 3), scene-linear. Of odd sides the last row, or column, is left out.
//
// fill() on one thread, for each frame; its memory is taken once for each size.
class PlateLevels {
 public:
  // `lens`: that it was taken with; where this is less than a twentieth as sensitive as in its
  // middle, it counts as that. Throws std::invalid_argument if sizes do not match.
  void fill(const capture::HalfImage& plate, const calibrate::DirectionTable& lens);
  const std::vector<capture::Image>& all() const { return levels_; }

 private:
  std::vector<capture::Image> levels_;
};

}  // namespace render
