// From Y'CbCr codes to R'G'B' on a fine grid, in exact integers.
#pragma once

#include <cstdint>

namespace capture {

// Where R'G'B' values lie on a grid of indices 0 .. size-1: value = (index - zero) / (one - zero).
struct ValueGrid {
  int zero = 0;
  int one = 0;
  int size = 0;
  double value(int index) const {
    return static_cast<double>(index - zero) / static_cast<double>(one - zero);
  }
  friend bool operator==(const ValueGrid&, const ValueGrid&) = default;
};

struct YcbcrCoding {
  double kr = 0;  // luma weights of red and blue
  double kb = 0;
  bool full_range = false;
  int depth = 8;         // bits, 8 to 16
  int chroma_units = 1;  // chroma comes in 1 / chroma_units of a code (interpolated samples)
};

// The matrix of a coding, as integers. The arithmetic is defined in colour.md: the same codes give
// the same indices on every machine.
class YcbcrMatrix {
 public:
  explicit YcbcrMatrix(const YcbcrCoding& coding);

  // Values -0.5 to 1.5, in steps of 1/16384 for 8 bits and 1/65536 for more.
  const ValueGrid& grid() const { return grid_; }

  // One row: `y` in codes, `cb` and `cr` in 1 / chroma_units of a code, to indices of the grid.
  void convert(int width,
               const std::int32_t* y,
               const std::int32_t* cb,
               const std::int32_t* cr,
               std::int32_t* r,
               std::int32_t* g,
               std::int32_t* b) const;

 private:
  int depth_;
  std::int32_t black_;   // codes of Y' = 0
  std::int32_t middle_;  // units of chroma 0
  std::int64_t from_y_;
  std::int64_t r_from_cr_;
  std::int64_t g_from_cb_;
  std::int64_t g_from_cr_;
  std::int64_t b_from_cb_;
  ValueGrid grid_;
};

}  // namespace capture
