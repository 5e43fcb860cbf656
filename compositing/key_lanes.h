// Eight pixels at a time, and rows of frames as such: for the files that key.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#if defined(__AVX__)
#include <immintrin.h>
#endif

#include "capture/colour.h"
#include "capture/image.h"
#include "compositing/screen_colour.h"

namespace compositing {

// Vectors of the compiler: AVX2 has them in one register, baseline machines in two.
using F8 = float __attribute__((vector_size(32)));
using I8 = std::int32_t __attribute__((vector_size(32)));
inline constexpr int key_lanes = 8;

inline F8 all_of(float value) { return F8{} + value; }
inline F8 load_lanes(const float* from) {
  F8 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
inline void store_lanes(float* to, F8 v) { std::memcpy(to, &v, sizeof v); }
inline F8 to_float_lanes(I8 v) { return __builtin_convertvector(v, F8); }
inline I8 to_int_lanes(F8 v) { return __builtin_convertvector(v, I8); }
inline float to_float_lanes(std::int32_t v) { return static_cast<float>(v); }
inline std::int32_t to_int_lanes(float v) { return static_cast<std::int32_t>(v); }

#if defined(__AVX__)
// The compiler does not make single instructions of a choice between vectors.
inline F8 least(F8 a, F8 b) {
  return std::bit_cast<F8>(_mm256_min_ps(std::bit_cast<__m256>(a), std::bit_cast<__m256>(b)));
}
inline F8 most(F8 a, F8 b) {
  return std::bit_cast<F8>(_mm256_max_ps(std::bit_cast<__m256>(a), std::bit_cast<__m256>(b)));
}
#endif

// Whether any bit of the lanes is set.
inline bool any_of(I8 lanes) {
#if defined(__AVX__)
  return _mm256_testz_si256(std::bit_cast<__m256i>(lanes), std::bit_cast<__m256i>(lanes)) == 0;
#else
  std::int32_t any = 0;
  for (int i = 0; i < key_lanes; ++i) any |= lanes[i];
  return any != 0;
#endif
}

// Light of a transfer curve by a polynomial: value * p(value), within 2e-4 of it over 0..1.
struct LightPolynomial {
  std::array<float, 6> factors{};
  F8 operator()(F8 v) const {
    F8 sum = all_of(factors[5]);
    for (std::size_t i = 5; i-- > 0;) sum = sum * v + factors[i];
    return sum * v;
  }
};

LightPolynomial light_polynomial(capture::Transfer transfer);

// Loads channels in the keyer's order. Values that are not finite, and negative ones, become 0.
class LightRows {
 public:
  LightRows(const capture::Image& frame, std::array<int, 3> order)
      : pixels_(frame.pixels.data()), width_(frame.width), order_(order) {}

  // `count` pixels from (y, x) on; lanes beyond repeat the last one.
  void load(int y, int x, int count, std::array<F8, 3>& channels) const {
    const float* from =
        pixels_ + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(x));
    for (int i = 0; i < key_lanes; ++i) {
      const float* pixel = from + 3 * std::min(i, count - 1);
      for (std::size_t c = 0; c < 3; ++c) channels[c][i] = pixel[order_[c]];
    }
    for (F8& c : channels) c = (c > 0.0F) & (c < 1e9F) ? c : F8{};
  }

 private:
  const float* pixels_;
  int width_;
  std::array<int, 3> order_;
};

// The greatest and least codes, red in the lowest byte; the highest byte lets any alpha through.
struct CodeBounds {
  std::uint32_t most = 0xFF000000U;
  std::uint32_t least = 0;
};

// The same of RGBA codes of 8 bits; alpha is not read.
class CodeRows {
 public:
  CodeRows(const std::uint8_t* codes, int width, std::array<int, 3> order, LightPolynomial light)
      : codes_(codes), width_(width), light_(light) {
    for (std::size_t c = 0; c < 3; ++c) shifts_[c] = 8 * order[c];
    float scale = 1;
    for (float& factor : light_.factors) factor *= scale /= 255;  // of codes instead of values
  }

  void load(int y, int x, int count, std::array<F8, 3>& channels) const {
    const std::uint8_t* from =
        codes_ + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                      static_cast<std::size_t>(x));
    I8 texels;
    if (count == key_lanes) {
      std::memcpy(&texels, from, sizeof texels);
    } else {
      for (int i = 0; i < key_lanes; ++i) {
        std::int32_t texel;
        std::memcpy(&texel, from + 4 * std::min(i, count - 1), sizeof texel);
        texels[i] = texel;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      channels[c] = light_(to_float_lanes((texels >> shifts_[c]) & 255));
    }
  }

  // Whether eight pixels lie within bounds: the greatest codes of each channel, then the least.
  bool within(int y, int x, const CodeBounds& bounds) const {
#if defined(__AVX2__)
    const auto* from =
        codes_ + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                      static_cast<std::size_t>(x));
    const __m256i texels = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
    const __m256i over = _mm256_subs_epu8(texels, _mm256_set1_epi32(static_cast<int>(bounds.most)));
    const __m256i under =
        _mm256_subs_epu8(_mm256_set1_epi32(static_cast<int>(bounds.least)), texels);
    const __m256i off = _mm256_or_si256(over, under);
    return _mm256_testz_si256(off, off) != 0;
#else
    const auto* from =
        codes_ + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                      static_cast<std::size_t>(x));
    for (int i = 0; i < 4 * key_lanes; ++i) {
      const int shift = 8 * (i % 4);
      if (from[i] > (bounds.most >> shift & 255) || from[i] < (bounds.least >> shift & 255))
        return false;
    }
    return true;
#endif
  }

 private:
  const std::uint8_t* codes_;
  int width_;
  std::array<int, 3> shifts_{};
  LightPolynomial light_;
};

}  // namespace compositing
