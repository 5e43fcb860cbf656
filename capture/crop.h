// Parts of pictures.
#pragma once

#include <array>
#include <optional>

#include "capture/image.h"

namespace capture {

// Part of a picture, in its pixels.
struct Crop {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

// The part that x, y, width, height name, or all of it. Throws std::runtime_error, without a file
// name, if it is not wholly inside a picture of that size.
Crop crop_within(const std::optional<std::array<int, 4>>& wanted, int width, int height);

// Leaves that part of a picture, which must have it.
void cut(Image& image, const Crop& crop);

}  // namespace capture
