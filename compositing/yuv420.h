// Display RGB of 8 bits to the Y'CbCr 4:2:0 that video files hold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace compositing {

// Where the three planes begin and how many bytes lie between rows. Chroma has half the rows and
// half the columns.
struct Yuv420Planes {
  std::uint8_t* y = nullptr;
  std::uint8_t* cb = nullptr;
  std::uint8_t* cr = nullptr;
  std::ptrdiff_t y_stride = 0;
  std::ptrdiff_t cb_stride = 0;
  std::ptrdiff_t cr_stride = 0;
};

// Converts pictures of one size; keeps the row buffers, so it belongs to one thread.
//
// ITU-R BT.709-6, limited range (Y 16..235, chroma 16..240), each value within 0.51 of a code of
// the exact one. Chroma is sited left, as H.264 decoders assume: the mean of two rows, filtered
// 1-2-1 across.
class Yuv420Converter {
 public:
  // Throws std::invalid_argument unless width and height are even and positive.
  Yuv420Converter(int width, int height);

  // rgb is (height, width, 3); throws std::invalid_argument if its size differs.
  void convert(std::span<const std::uint8_t> rgb, const Yuv420Planes& planes);

 private:
  std::size_t width_ = 0;
  std::size_t height_ = 0;
  std::vector<std::uint8_t> rows_;   // r, g, b of an even row, then of the odd one below
  std::vector<std::uint16_t> sums_;  // r, g, b of both rows added
};

}  // namespace compositing
