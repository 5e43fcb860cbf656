// The matrix of Y'CbCr.
#include "capture/ycbcr.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace capture {
namespace {

// Of the fixed-point numbers: value 1 is 2^scale_bits; the grid keeps grid_bits of them.
struct Precision {
  int scale_bits;
  int grid_bits;
};
constexpr Precision precision_8{28, 14};     // sums stay under 2^30: 32-bit integers
constexpr Precision precision_deep{44, 16};  // sums stay under 2^46: exact in doubles

constexpr Precision precision_of(int depth) { return depth == 8 ? precision_8 : precision_deep; }

std::int64_t fixed(double factor, int scale_bits) {
  return std::llround(std::ldexp(factor, scale_bits));
}

}  // namespace

YcbcrMatrix::YcbcrMatrix(const YcbcrCoding& coding) : depth_(coding.depth) {
  if (depth_ < 8 || depth_ > 16 || coding.chroma_units < 1) {
    throw std::invalid_argument("Y'CbCr has 8 to 16 bits");
  }
  const int deeper = 1 << (depth_ - 8);
  const int full = (1 << depth_) - 1;
  const int luma_span = coding.full_range ? full : 219 * deeper;
  const int chroma_span = coding.full_range ? full : 224 * deeper;
  black_ = coding.full_range ? 0 : 16 * deeper;
  middle_ = 128 * deeper * coding.chroma_units;

  const auto [scale_bits, grid_bits] = precision_of(depth_);
  const double kg = 1 - coding.kr - coding.kb;
  const double chroma = static_cast<double>(chroma_span) * coding.chroma_units;
  const double red = 2 * (1 - coding.kr) / chroma;
  const double blue = 2 * (1 - coding.kb) / chroma;
  from_y_ = fixed(1.0 / luma_span, scale_bits);
  r_from_cr_ = fixed(red, scale_bits);
  g_from_cb_ = fixed(-blue * coding.kb / kg, scale_bits);
  g_from_cr_ = fixed(-red * coding.kr / kg, scale_bits);
  b_from_cb_ = fixed(blue, scale_bits);

  const int one = 1 << grid_bits;
  grid_ = {one / 2, one / 2 + one, 2 * one + 1};
}

// The rows do not overlap: told to the compiler, since six pointers are more than it checks.
void YcbcrMatrix::convert(int width,
                          const std::int32_t* __restrict y,
                          const std::int32_t* __restrict cb,
                          const std::int32_t* __restrict cr,
                          std::int32_t* __restrict r,
                          std::int32_t* __restrict g,
                          std::int32_t* __restrict b) const {
  const std::int32_t black = black_;
  const std::int32_t middle = middle_;
  const std::int32_t zero = grid_.zero;
  const std::int32_t last = grid_.size - 1;
  if (depth_ == 8) {
    constexpr int shift = precision_8.scale_bits - precision_8.grid_bits;
    constexpr std::int32_t half = 1 << (shift - 1);
    const auto from_y = static_cast<std::int32_t>(from_y_);
    const auto r_from_cr = static_cast<std::int32_t>(r_from_cr_);
    const auto g_from_cb = static_cast<std::int32_t>(g_from_cb_);
    const auto g_from_cr = static_cast<std::int32_t>(g_from_cr_);
    const auto b_from_cb = static_cast<std::int32_t>(b_from_cb_);
    const auto index = [zero, last](std::int32_t step) {
      return std::min(std::max(step + zero, 0), last);
    };
    for (int x = 0; x < width; ++x) {
      const std::int32_t luma = from_y * (y[x] - black) + half;
      const std::int32_t u = cb[x] - middle;
      const std::int32_t v = cr[x] - middle;
      r[x] = index((luma + r_from_cr * v) >> shift);
      g[x] = index((luma + g_from_cb * u + g_from_cr * v) >> shift);
      b[x] = index((luma + b_from_cb * u) >> shift);
    }
    return;
  }
  // Doubles hold these integers exactly, and vectorise where 64-bit products do not.
  constexpr int shift = precision_deep.scale_bits - precision_deep.grid_bits;
  constexpr double step = 1.0 / static_cast<double>(std::int64_t{1} << shift);
  const auto from_y = static_cast<double>(from_y_);
  const auto r_from_cr = static_cast<double>(r_from_cr_);
  const auto g_from_cb = static_cast<double>(g_from_cb_);
  const auto g_from_cr = static_cast<double>(g_from_cr_);
  const auto b_from_cb = static_cast<double>(b_from_cb_);
  const double zero_and_half = zero + 0.5;
  const double top = last;
  const auto index = [=](double sum) {
    const double nearest = std::floor(sum * step + zero_and_half);
    return static_cast<std::int32_t>(std::min(std::max(nearest, 0.0), top));
  };
  for (int x = 0; x < width; ++x) {
    const double luma = from_y * static_cast<double>(y[x] - black);
    const auto u = static_cast<double>(cb[x] - middle);
    const auto v = static_cast<double>(cr[x] - middle);
    r[x] = index(luma + r_from_cr * v);
    g[x] = index(luma + g_from_cb * u + g_from_cr * v);
    b[x] = index(luma + b_from_cb * u);
  }
}

}  // namespace capture
