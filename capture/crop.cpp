// Parts of pictures.
#include "capture/crop.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

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

void cut(Image& image, const Crop& crop) {
  if (crop.width == image.width && crop.height == image.height) {
    return;
  }
  Image part = make_image(crop.height, crop.width, image.channels);
  for (int y = 0; y < crop.height; ++y) {
    const auto from =
        image.pixels.begin() + static_cast<std::ptrdiff_t>(image.index(crop.y + y, crop.x));
    std::copy_n(from, crop.width * image.channels,
                part.pixels.begin() + static_cast<std::ptrdiff_t>(part.index(y, 0)));
  }
  image = std::move(part);
}

}  // namespace capture
