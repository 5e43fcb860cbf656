// The plate as rays see it that clear bodies bend, or that mirrors send on. Private to the kernel.
#pragma once

#include <vector>

#include "capture/half.h"
#include "capture/image.h"

namespace render {

// The plate, and its halves until the shorter side is 1 pixel: (height, width, 3), scene-linear. Of
// odd sides the last row, or column, is left out.
//
// fill() on one thread, for each frame; its memory is taken once for each size.
class PlateLevels {
 public:
  void fill(const capture::HalfImage& plate);
  const std::vector<capture::Image>& all() const { return levels_; }

 private:
  std::vector<capture::Image> levels_;
};

}  // namespace render
