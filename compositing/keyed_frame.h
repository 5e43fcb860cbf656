// Where a keyer puts a frame: the picture, and where in it there is anything at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/image.h"

namespace compositing {

// A keyed frame that remembers which of its pixels are not 0, so that the next frame's bare screen
// is not written where it stands already. Only keyers write it, and the memory of it goes wherever
// the picture goes: any frame may be given to any keyer at any time, copied, swapped or moved.
class KeyedFrame {
 public:
  // (height, width, 4): premultiplied, scene-linear.
  const capture::HalfImage& image() const { return image_; }

 private:
  friend class Keyer;

  // All 0 if the size changes.
  void resize(int height, int width);
  // Of each 8x8 pixels, one byte a row; 0 = all of the eight pixels are 0.
  std::span<std::uint8_t> written() { return written_; }

  capture::HalfImage image_;
  std::vector<std::uint8_t> written_;
};

}  // namespace compositing
