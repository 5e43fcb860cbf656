// A picture in memory: floats, scene-linear unless said otherwise.
#pragma once

#include <cstddef>
#include <vector>

#include "capture/half.h"

namespace capture {

// (height, width, channels), row by row, channels interleaved. Pixel (0, 0) is the centre of the
// top-left pixel.
struct Image {
  int height = 0;
  int width = 0;
  std::vector<float> pixels;
  int channels = 3;

  bool empty() const { return pixels.empty(); }
  std::size_t index(int y, int x, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels) +
           static_cast<std::size_t>(c);
  }
  float& at(int y, int x, int c = 0) { return pixels[index(y, x, c)]; }
  float at(int y, int x, int c = 0) const { return pixels[index(y, x, c)]; }
};

// The same in half floats: what the kernel reads as background, and what it delivers.
struct HalfImage {
  int height = 0;
  int width = 0;
  std::vector<Half> pixels;
  int channels = 3;

  bool empty() const { return pixels.empty(); }
  std::size_t index(int y, int x, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels) +
           static_cast<std::size_t>(c);
  }
};

// Rounded to half, and back. Values beyond half's range become infinity: clamp if that hurts.
HalfImage to_half(const Image& image);
Image to_float(const HalfImage& image);

// An image of zeros. Throws std::invalid_argument unless every size is at least 1.
Image make_image(int height, int width, int channels = 3);

}  // namespace capture
