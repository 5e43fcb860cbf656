// Pictures of 8-bit grey, in which boards are looked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "calibrate/vec.h"
#include "capture/image.h"

namespace calibrate {

// (height, width), row by row. Codes may follow any rising curve: corners lie where they lie.
struct GreyPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  bool empty() const { return pixels.empty(); }
  std::size_t index(int y, int x) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  std::uint8_t& at(int y, int x) { return pixels[index(y, x)]; }
  std::uint8_t at(int y, int x) const { return pixels[index(y, x)]; }
};

// Throws std::invalid_argument unless the sizes are from 1 to 16384 and match the pixels.
void check(const GreyPicture& picture);

// Codes of a scene-linear picture of 1 (grey), 3 or 4 (RGB) channels: by a gamma of 2.2, the
// brightest half percent at 255, however bright it is. Throws std::invalid_argument if it is empty
// or has other channels.
GreyPicture grey_picture(const capture::Image& image);

// The value at a point inside the picture by Catmull-Rom interpolation; outside, that of the
// nearest edge.
float value_at(const GreyPicture& picture, Vec2 q);

// Of another size; pixel edges map to pixel edges. Shrinks by areas, grows bilinearly.
GreyPicture resized(const GreyPicture& picture, int width, int height);

// The codes between the darkest and the brightest twentieth spread over 0 to 255: a lamp or a
// window in a dark room leaves a board no contrast otherwise.
GreyPicture stretched(const GreyPicture& picture);

}  // namespace calibrate
