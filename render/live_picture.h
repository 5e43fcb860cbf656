// Pictures that change from frame to frame and decide what rays see: persons, keyed.
#pragma once

#include <array>

namespace render {

// One frame of it. Immutable while frames are rendered that see it; many threads look at once.
class LivePicture {
 public:
  virtual ~LivePicture() = default;
  // Premultiplied scene-linear red, green, blue, at least 0, and alpha, 0 to 1, at (u, v), 0..1
  // from the picture's top left: the mean of a square that is footprint_uv squared of the picture's
  // area. Beyond the picture there is nothing; nor is there where numbers are not finite.
  virtual std::array<float, 4> look_up(float u, float v, float footprint_uv) const = 0;
};

}  // namespace render
