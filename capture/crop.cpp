// Parts of pictures.
#include "capture/crop.h"

#include <stdexcept>
#include <string>

namespace capture {

Crop crop_within(const std::optional<std::array<int, 4>>& wanted, int width, int height) {
  if (!wanted) {
    return {0, 0, width, height};
  }
  const auto [x, y, crop_width, crop_height] = *wanted;
  if (x < 0 || y < 0 || crop_width < 1 || crop_height < 1 || crop_width > width - x ||
      crop_height > height - y) {
    throw std::runtime_error("the crop [" + std::to_string(x) + ", " + std::to_string(y) + ", " +
                             std::to_string(crop_width) + ", " + std::to_string(crop_height) +
                             "] (x, y, width, height) is not inside its " + std::to_string(width) +
                             " x " + std::to_string(height) + " pixels");
  }
  return {x, y, crop_width, crop_height};
}

}  // namespace capture
