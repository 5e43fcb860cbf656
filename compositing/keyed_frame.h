// Where a keyer puts a frame: the picture, and where in it there is anything at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/image.h"

namespace compositing {

// A keyed frame that remembers which of its pixels are not 0, so that the next frame's bare screen
// is not written where it stands already. Only keyers and set() write it, and the memory of it goes
// wherever the picture goes: any frame may be given to any keyer at any time, copied, swapped or
// moved.
class KeyedFrame {
 public:
  static constexpr int run = 8;  // pixels that it remembers together

  // (height, width, 4): premultiplied, scene-linear.
  const capture::HalfImage& image() const { return image_; }
  // Whether any of the pixels x to x + run - 1 of a row may not be 0; x is a multiple of `run`.
  bool has_any(int y, int x) const { return written_[byte_at(y, x)] != 0; }

  // The same of a block of run x run pixels, by its column and row.
  bool has_any_in_block(int row, int column) const;

  // A picture that is not keyed: of 3 channels, opaque, or 4. Values that are not finite become 0,
  // those beyond half's range its largest.
  void set(const capture::Image& picture);

 private:
  friend class Keyer;

  std::size_t byte_at(int y, int x) const {
    const auto across = (static_cast<std::size_t>(image_.width) + run - 1) / run;
    return run * (static_cast<std::size_t>(y / run) * across + static_cast<std::size_t>(x / run)) +
           static_cast<std::size_t>(y % run);
  }
  // All 0 if the size changes.
  void resize(int height, int width);

  capture::HalfImage image_;
  std::vector<std::uint8_t> written_;  // of each 8x8 pixels, one byte a row
};

}  // namespace compositing
