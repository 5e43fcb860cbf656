// Images in memory.
#include "capture/image.h"

#include <stdexcept>

namespace capture {

Image make_image(int height, int width, int channels) {
  if (height < 1 || width < 1 || channels < 1) {
    throw std::invalid_argument("an image needs at least one row, column and channel");
  }
  Image image{height, width, {}, channels};
  image.pixels.assign(static_cast<std::size_t>(height) * static_cast<std::size_t>(width) *
                          static_cast<std::size_t>(channels),
                      0.0F);
  return image;
}

HalfImage to_half(const Image& image) {
  HalfImage half{image.height, image.width, std::vector<Half>(image.pixels.size()), image.channels};
  halves_from_floats(image.pixels, half.pixels.data());
  return half;
}

Image to_float(const HalfImage& half) {
  Image image{half.height, half.width, std::vector<float>(half.pixels.size()), half.channels};
  for (std::size_t i = 0; i < half.pixels.size(); ++i) {
    image.pixels[i] = float_from_half(half.pixels[i]);
  }
  return image;
}

}  // namespace capture
