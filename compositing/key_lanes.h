// Eight pixels at a time, and rows of frames as such: for the files that key.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
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
using F4 = float __attribute__((vector_size(16)));
inline constexpr int key_lanes = 8;

inline F8 all_of(float value) { return F8{} + value; }
inline F8 load_lanes(const float* from) {
  F8 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
inline F4 load_four(const float* from) {
  F4 v;
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

// a * b + c, rounded once where processors can.
inline F8 times_plus(F8 a, F8 b, F8 c) {
#if defined(__FMA__)
  return std::bit_cast<F8>(_mm256_fmadd_ps(std::bit_cast<__m256>(a), std::bit_cast<__m256>(b),
                                           std::bit_cast<__m256>(c)));
#else
  return a * b + c;
#endif
}
inline float times_plus(float a, float b, float c) {
#if defined(__FMA__)
  return std::fma(a, b, c);
#else
  return a * b + c;
#endif
}
// c - a * b
inline F8 less_times(F8 c, F8 a, F8 b) { return times_plus(-a, b, c); }
inline float less_times(float c, float a, float b) { return times_plus(-a, b, c); }
// `share` of the way from a to b.
template <class V>
[[gnu::always_inline]] inline V between(V a, V b, V share) {
  return times_plus(share, b - a, a);
}

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

inline bool any_of(bool value) { return value; }

// How many of the lanes are -1, of lanes that are 0 or -1.
inline int count_of(I8 lanes) {
#if defined(__AVX__)
  return std::popcount(static_cast<unsigned>(_mm256_movemask_ps(std::bit_cast<__m256>(lanes))));
#else
  std::int32_t count = 0;
  for (int i = 0; i < key_lanes; ++i) count -= lanes[i];
  return count;
#endif
}

inline float sum_of(F8 v) {
  const F4 four =
      __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
  const F4 two = four + __builtin_shufflevector(four, four, 2, 3, 0, 1);
  return two[0] + two[1];
}

// Channels of four texels, from texels of four channels.
inline std::array<F4, 4> transposed(F4 a, F4 b, F4 c, F4 d) {
  const F4 ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const F4 ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const F4 cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const F4 cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  return {__builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5),
          __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7),
          __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5),
          __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7)};
}

// Light of a transfer curve by a polynomial: value * p(value), within 2e-4 of it over 0..1.
struct LightPolynomial {
  std::array<float, 6> factors{};
  // Side by side, for each step waits for the one before.
  void apply(std::array<F8, 3>& v) const {
    std::array<F8, 3> sum{all_of(factors[5]), all_of(factors[5]), all_of(factors[5])};
    for (std::size_t i = 5; i-- > 0;) {
      for (std::size_t c = 0; c < 3; ++c) sum[c] = times_plus(sum[c], v[c], all_of(factors[i]));
    }
    for (std::size_t c = 0; c < 3; ++c) v[c] = sum[c] * v[c];
  }
};

LightPolynomial light_polynomial(capture::Transfer transfer);

// What has so much of the least excess of bare screen, or less, may have none of its colour.
inline constexpr float hardly_of_excess = 0.25F;

// Light between which a block of pixels is screen at a glance, in the keyer's order.
struct LightBounds {
  std::array<float, 3> most{};  // 0 lets nothing through
  float least = 1;              // of the first
};

// Loads channels in the keyer's order. Values that are not finite, and negative ones, become 0.
class LightRows {
 public:
  using Bounds = LightBounds;

  LightRows(const capture::Image& frame, std::array<int, 3> order)
      : pixels_(frame.pixels.data()), width_(frame.width), order_(order) {}

  // `count` pixels from (y, x) on; lanes beyond repeat the last one.
  void load(int y, int x, int count, std::array<F8, 3>& channels) const {
    const float* from = at(y, x);
    if (count == key_lanes) {
      load_raw(from, channels);
    } else {
      for (int i = 0; i < key_lanes; ++i) {
        const float* pixel = from + 3 * std::min(i, count - 1);
        for (std::size_t c = 0; c < 3; ++c) channels[c][i] = pixel[order_[c]];
      }
    }
    for (F8& c : channels) c = (c > 0.0F) & (c < 1e9F) ? c : F8{};
  }

  // Eight pixels in the picture's order: red, green, blue.
  void load_rgb(int y, int x, std::array<F8, 3>& rgb) const {
    load_apart(at(y, x), rgb);
    for (F8& c : rgb) c = (c > 0.0F) & (c < 1e9F) ? c : F8{};
  }

  // Which of `rows` rows from y on have eight pixels, from x on, within bounds: a bit each.
  unsigned rows_within(int y, int x, int rows, const LightBounds& bounds) const {
    unsigned within = 0;
    for (int row = 0; row < rows; ++row) {
      std::array<F8, 3> c;
      load_raw(at(y + row, x), c);
      const I8 inside = (c[0] >= bounds.least) & (c[0] <= bounds.most[0]) &
                        (c[1] <= bounds.most[1]) & (c[2] <= bounds.most[2]);
      within |= static_cast<unsigned>(!any_of(~inside)) << row;
    }
    return within;
  }

  // The same of the means of pairs of rows, both of which are told by one bit each.
  unsigned pairs_within(int y, int x, int rows, const LightBounds& bounds) const {
    unsigned within = 0;
    for (int row = 0; row < rows; row += 2) {
      std::array<F8, 3> c, d;
      load_raw(at(y + row, x), c);
      load_raw(at(y + std::min(row + 1, rows - 1), x), d);
      for (std::size_t i = 0; i < 3; ++i) c[i] = 0.5F * (c[i] + d[i]);
      const I8 inside = (c[0] >= bounds.least) & (c[0] <= bounds.most[0]) &
                        (c[1] <= bounds.most[1]) & (c[2] <= bounds.most[2]);
      if (!any_of(~inside)) within |= 3U << row;
    }
    return within & ((1U << rows) - 1);
  }

  // Whether eight pixels of `rows` rows from (y, x) on have all no more of the first channel than
  // of the mean of the others, or hardly: much less than what is within the bounds has.
  bool lacks_first(int y, int x, int rows, const LightBounds& bounds) const {
    const float excess = bounds.least - 0.5F * (bounds.most[1] + bounds.most[2]);
    const float hardly = std::clamp(hardly_of_excess * excess, 0.0F, 0.03F);
    for (int row = 0; row < rows; ++row) {
      std::array<F8, 3> c;
      load_raw(at(y + row, x), c);
      if (any_of(~(c[0] <= 0.5F * (c[1] + c[2]) + hardly))) return false;
    }
    return true;
  }

 private:
  const float* at(int y, int x) const {
    return pixels_ + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                          static_cast<std::size_t>(x));
  }

  void load_raw(const float* from, std::array<F8, 3>& channels) const {
    std::array<F8, 3> rgb;
    load_apart(from, rgb);
    for (std::size_t i = 0; i < 3; ++i) {
      channels[i] = order_[i] == 0 ? rgb[0] : order_[i] == 1 ? rgb[1] : rgb[2];
    }
  }

  // Eight pixels of three channels, apart.
  static void load_apart(const float* from, std::array<F8, 3>& rgb) {
    const F4 a = load_four(from), b = load_four(from + 4), c = load_four(from + 8);
    const F4 d = load_four(from + 12), e = load_four(from + 16), f = load_four(from + 20);
    const F8 ad = __builtin_shufflevector(a, d, 0, 1, 2, 3, 4, 5, 6, 7);
    const F8 be = __builtin_shufflevector(b, e, 0, 1, 2, 3, 4, 5, 6, 7);
    const F8 cf = __builtin_shufflevector(c, f, 0, 1, 2, 3, 4, 5, 6, 7);
    // Within each half: a = r0 g0 b0 r1, b = g1 b1 r2 g2, c = b2 r3 g3 b3.
    const F8 rg23 = __builtin_shufflevector(be, cf, 2, 3, 9, 10, 6, 7, 13, 14);  // r2 g2 r3 g3
    const F8 gb01 = __builtin_shufflevector(ad, be, 1, 2, 8, 9, 5, 6, 12, 13);   // g0 b0 g1 b1
    rgb[0] = __builtin_shufflevector(ad, rg23, 0, 3, 8, 10, 4, 7, 12, 14);
    rgb[1] = __builtin_shufflevector(gb01, rg23, 0, 2, 9, 11, 4, 6, 13, 15);
    rgb[2] = __builtin_shufflevector(gb01, cf, 1, 3, 8, 11, 5, 7, 12, 15);
  }

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
  using Bounds = CodeBounds;

  CodeRows(const std::uint8_t* codes, int width, std::array<int, 3> order, LightPolynomial light)
      : codes_(codes), width_(width), light_(light) {
    for (std::size_t c = 0; c < 3; ++c) shifts_[c] = 8 * order[c];
    float scale = 1;
    for (float& factor : light_.factors) factor *= scale /= 255;  // of codes instead of values
  }

  void load(int y, int x, int count, std::array<F8, 3>& channels) const {
    const std::uint8_t* from = at(y, x);
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
    for (std::size_t c = 0; c < 3; ++c) channels[c] = to_float_lanes((texels >> shifts_[c]) & 255);
    light_.apply(channels);
  }

  void load_rgb(int y, int x, std::array<F8, 3>& rgb) const {
    I8 texels;
    std::memcpy(&texels, at(y, x), sizeof texels);
    rgb = {to_float_lanes(texels & 255), to_float_lanes((texels >> 8) & 255),
           to_float_lanes((texels >> 16) & 255)};
    light_.apply(rgb);
  }

  // Which of `rows` rows from y on, eight at most, have eight pixels, from x on, within bounds: a
  // bit each.
  unsigned rows_within(int y, int x, int rows, const CodeBounds& bounds) const {
    const std::uint8_t* from = at(y, x);
    const std::size_t down = 4 * static_cast<std::size_t>(width_);
    unsigned within = 0;
#if defined(__AVX2__)
    const __m256i most = _mm256_set1_epi32(static_cast<int>(bounds.most));
    const __m256i least = _mm256_set1_epi32(static_cast<int>(bounds.least));
    const auto outside = [&](int row) {
      const __m256i texels = _mm256_loadu_si256(
          reinterpret_cast<const __m256i*>(from + static_cast<std::size_t>(row) * down));
      return _mm256_or_si256(_mm256_subs_epu8(texels, most), _mm256_subs_epu8(least, texels));
    };
    if (rows == 8) {
      __m256i any = outside(0);
      for (int row = 1; row < 8; ++row) any = _mm256_or_si256(any, outside(row));
      if (_mm256_testz_si256(any, any) != 0) return 0xFF;
    }
    for (int row = 0; row < rows; ++row) {
      const __m256i off = outside(row);
      within |= static_cast<unsigned>(_mm256_testz_si256(off, off)) << row;
    }
#else
    for (int row = 0; row < rows; ++row, from += down) {
      bool inside = true;
      for (int i = 0; i < 4 * key_lanes; ++i) {
        const int shift = 8 * (i % 4);
        inside &= from[i] <= (bounds.most >> shift & 255);
        inside &= from[i] >= (bounds.least >> shift & 255);
      }
      within |= static_cast<unsigned>(inside) << row;
    }
#endif
    return within;
  }

  unsigned pairs_within(int y, int x, int rows, const CodeBounds& bounds) const {
    const std::uint8_t* from = at(y, x);
    const std::size_t down = 4 * static_cast<std::size_t>(width_);
    unsigned within = 0;
#if defined(__AVX2__)
    const __m256i most = _mm256_set1_epi32(static_cast<int>(bounds.most));
    const __m256i least = _mm256_set1_epi32(static_cast<int>(bounds.least));
    const auto texels = [&](int row) {
      return _mm256_loadu_si256(
          reinterpret_cast<const __m256i*>(from + static_cast<std::size_t>(row) * down));
    };
    const auto outside = [&](int row, int next) {
      const __m256i mean = _mm256_avg_epu8(texels(row), texels(next));
      return _mm256_or_si256(_mm256_subs_epu8(mean, most), _mm256_subs_epu8(least, mean));
    };
    if (rows == 8) {
      const __m256i a = outside(0, 1), b = outside(2, 3), c = outside(4, 5), d = outside(6, 7);
      const __m256i any = _mm256_or_si256(_mm256_or_si256(a, b), _mm256_or_si256(c, d));
      if (_mm256_testz_si256(any, any) != 0) return 0xFF;
      within |= _mm256_testz_si256(a, a) != 0 ? 0x03U : 0;
      within |= _mm256_testz_si256(b, b) != 0 ? 0x0CU : 0;
      within |= _mm256_testz_si256(c, c) != 0 ? 0x30U : 0;
      within |= _mm256_testz_si256(d, d) != 0 ? 0xC0U : 0;
      return within;
    }
    for (int row = 0; row < rows; row += 2) {
      const __m256i off = outside(row, std::min(row + 1, rows - 1));
      if (_mm256_testz_si256(off, off) != 0) within |= 3U << row;
    }
#else
    for (int row = 0; row < rows; row += 2, from += 2 * down) {
      const std::uint8_t* const next = row + 1 < rows ? from + down : from;
      bool inside = true;
      for (int i = 0; i < 4 * key_lanes; ++i) {
        const int shift = 8 * (i % 4);
        const auto mean = static_cast<std::uint32_t>((from[i] + next[i] + 1) / 2);
        inside &= mean <= (bounds.most >> shift & 255);
        inside &= mean >= (bounds.least >> shift & 255);
      }
      if (inside) within |= 3U << row;
    }
#endif
    return within & ((1U << rows) - 1);
  }

  bool lacks_first(int y, int x, int rows, const CodeBounds& bounds) const {
    const auto bound = [&](std::uint32_t of, std::size_t c) {
      return static_cast<int>(of >> shifts_[c] & 255);
    };
    const int excess =
        bound(bounds.least, 0) - (bound(bounds.most, 1) + bound(bounds.most, 2) + 1) / 2;
    const int hardly =
        std::clamp(static_cast<int>(hardly_of_excess * static_cast<float>(excess)), 0, 10);
    const std::uint8_t* from = at(y, x);
    const std::size_t down = 4 * static_cast<std::size_t>(width_);
#if defined(__AVX2__)
    // Of each pixel, its channels in the lowest byte.
    const auto lowest = [&](int shift) {
      const int byte = shift / 8;
      return _mm256_setr_epi8(
          static_cast<char>(byte), -1, -1, -1, static_cast<char>(byte + 4), -1, -1, -1,
          static_cast<char>(byte + 8), -1, -1, -1, static_cast<char>(byte + 12), -1, -1, -1,
          static_cast<char>(byte), -1, -1, -1, static_cast<char>(byte + 4), -1, -1, -1,
          static_cast<char>(byte + 8), -1, -1, -1, static_cast<char>(byte + 12), -1, -1, -1);
    };
    const __m256i first = lowest(shifts_[0]), second = lowest(shifts_[1]);
    const __m256i third = lowest(shifts_[2]), slack = _mm256_set1_epi32(hardly);
    __m256i more = _mm256_setzero_si256();
    for (int row = 0; row < rows; ++row, from += down) {
      const __m256i texels = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
      const __m256i mean =
          _mm256_avg_epu8(_mm256_shuffle_epi8(texels, second), _mm256_shuffle_epi8(texels, third));
      more = _mm256_or_si256(more, _mm256_subs_epu8(_mm256_shuffle_epi8(texels, first),
                                                    _mm256_adds_epu8(mean, slack)));
    }
    return _mm256_testz_si256(more, more) != 0;
#else
    const auto code = [&](const std::uint8_t* texel, std::size_t c) {
      return static_cast<int>(texel[shifts_[c] / 8]);
    };
    for (int row = 0; row < rows; ++row, from += down) {
      for (int i = 0; i < key_lanes; ++i) {
        const std::uint8_t* const texel = from + 4 * i;
        if (code(texel, 0) > (code(texel, 1) + code(texel, 2) + 1) / 2 + hardly) return false;
      }
    }
    return true;
#endif
  }

 private:
  const std::uint8_t* at(int y, int x) const {
    return codes_ + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                         static_cast<std::size_t>(x));
  }

  const std::uint8_t* codes_;
  int width_;
  std::array<int, 3> shifts_{};
  LightPolynomial light_;
};

}  // namespace compositing
