// Eight floats at a time, or one where there is no AVX2; and four.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "calibrate/vec.h"
#include "capture/half.h"

namespace render {

#if defined(__AVX2__)
using Lanes = __m256;
inline constexpr std::size_t lanes = 8;
inline Lanes load(const float* at) { return _mm256_load_ps(at); }
inline void store(float* at, Lanes v) { _mm256_store_ps(at, v); }
inline Lanes all(float v) { return _mm256_set1_ps(v); }
inline Lanes add(Lanes a, Lanes b) { return _mm256_add_ps(a, b); }
inline Lanes multiply(Lanes a, Lanes b) { return _mm256_mul_ps(a, b); }
inline Lanes positive(Lanes v) { return _mm256_cmp_ps(v, _mm256_setzero_ps(), _CMP_GT_OQ); }
inline Lanes both(Lanes a, Lanes b) { return _mm256_and_ps(a, b); }
inline unsigned bits_of(Lanes mask) { return static_cast<unsigned>(_mm256_movemask_ps(mask)); }
// Lanes whose bit is set, as a mask.
inline Lanes mask_of(unsigned bits) {
  const __m256i which = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i set = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), which);
  return _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, which));
}
#else
struct Lanes {
  float v;
};
inline constexpr std::size_t lanes = 1;
inline Lanes load(const float* at) { return {*at}; }
inline void store(float* at, Lanes v) { *at = v.v; }
inline Lanes all(float v) { return {v}; }
inline Lanes add(Lanes a, Lanes b) { return {a.v + b.v}; }
inline Lanes multiply(Lanes a, Lanes b) { return {a.v * b.v}; }
// Masks are all ones or all zeros; as floats they are only ever combined by both() and bits_of().
inline Lanes positive(Lanes v) { return {std::bit_cast<float>(v.v > 0 ? ~0U : 0U)}; }
inline Lanes both(Lanes a, Lanes b) {
  return {std::bit_cast<float>(std::bit_cast<unsigned>(a.v) & std::bit_cast<unsigned>(b.v))};
}
inline unsigned bits_of(Lanes mask) { return std::bit_cast<unsigned>(mask.v) >> 31; }
inline Lanes mask_of(unsigned bits) { return {std::bit_cast<float>(bits & 1 ? ~0U : 0U)}; }
#endif

// The same as numbers, whatever the machine has.
using Eight = float __attribute__((vector_size(32)));
inline Eight load_eight(const float* at) {
  Eight v;
  std::memcpy(&v, at, sizeof v);
  return v;
}
inline void store_eight(float* at, Eight v) { std::memcpy(at, &v, sizeof v); }
inline Eight eight_of(float v) { return Eight{} + v; }
inline float root(float v) { return std::sqrt(v); }
inline Eight root(Eight v) {
#if defined(__AVX2__)
  return std::bit_cast<Eight>(_mm256_sqrt_ps(std::bit_cast<__m256>(v)));
#else
  for (int i = 0; i < 8; ++i) v[i] = std::sqrt(v[i]);
  return v;
#endif
}
// Of a mask, a bit for each lane, the first the lowest.
template <unsigned count, class Mask>
unsigned bits_one_by_one(const Mask& mask) {
  unsigned bits = 0;
  for (unsigned i = 0; i < count; ++i) bits |= static_cast<unsigned>(mask[i] != 0) << i;
  return bits;
}
inline unsigned bits_of(std::int32_t __attribute__((vector_size(32))) mask) {
#if defined(__AVX2__)
  return bits_of(std::bit_cast<Lanes>(mask));
#else
  return bits_one_by_one<8>(mask);
#endif
}
// And back.
inline std::int32_t __attribute__((vector_size(32))) mask_of_eight(unsigned bits) {
  using Words = std::int32_t __attribute__((vector_size(32)));
  return ((Words{} + static_cast<std::int32_t>(bits)) & Words{1, 2, 4, 8, 16, 32, 64, 128}) != 0;
}
// The places of the bits that are set, in order, before anything.
constexpr std::array<std::array<std::uint8_t, 8>, 256> places_of_bits() {
  std::array<std::array<std::uint8_t, 8>, 256> places{};
  for (std::size_t bits = 0; bits < 256; ++bits) {
    std::size_t n = 0;
    for (std::uint8_t k = 0; k < 8; ++k) {
      if ((bits >> k & 1) != 0) places[bits][n++] = k;
    }
  }
  return places;
}
// Moves the lanes whose bit is set to the front; what comes behind them means nothing.
class ToFront {
 public:
  explicit ToFront(unsigned bits) {
#if defined(__AVX2__)
    std::int64_t eight;
    std::memcpy(&eight, table[bits].data(), sizeof eight);
    places_ = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(eight));
#else
    places_ = table[bits];
#endif
  }
  // From eight numbers or more at `from` to as many at `to`.
  template <class T>
  void move(const T* from, T* to) const {
    static_assert(sizeof(T) == 4);
#if defined(__AVX2__)
    __m256i v;
    std::memcpy(&v, from, sizeof v);
    v = _mm256_permutevar8x32_epi32(v, places_);
    std::memcpy(to, &v, sizeof v);
#else
    for (std::size_t i = 0; i < 8; ++i) to[i] = from[places_[i]];
#endif
  }

 private:
  static constexpr auto table = places_of_bits();
#if defined(__AVX2__)
  __m256i places_;
#else
  std::array<std::uint8_t, 8> places_;
#endif
};

// A colour in four lanes, of which the last is idle.
using Four = float __attribute__((vector_size(16)));
inline Four load_four(const float* at) {
  Four v;
  std::memcpy(&v, at, sizeof v);
  return v;
}
// Those after the first.
inline Four after_first(Four v) {
  using Order = std::int32_t __attribute__((vector_size(16)));
  return __builtin_shuffle(v, Order{1, 2, 3, 3});
}
inline unsigned bits_of(std::int32_t __attribute__((vector_size(16))) mask) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(std::bit_cast<__m128>(mask)));
#else
  return bits_one_by_one<4>(mask);
#endif
}
inline Four four_of(calibrate::Vec3f v) { return Four{v.x, v.y, v.z, 0}; }
inline calibrate::Vec3f three_of(Four v) { return {v[0], v[1], v[2]}; }
inline Four first_four(Eight v) { return __builtin_shufflevector(v, v, 0, 1, 2, 3); }
inline Four last_four(Eight v) { return __builtin_shufflevector(v, v, 4, 5, 6, 7); }
inline Eight eight_of_halves(const capture::Half* at) {
  Eight v;
#if defined(__F16C__) && defined(__AVX2__)
  __m128i halves;
  std::memcpy(&halves, at, sizeof halves);
  v = std::bit_cast<Eight>(_mm256_cvtph_ps(halves));
#else
  for (int i = 0; i < 8; ++i) v[i] = capture::float_from_half(at[i]);
#endif
  return v;
}
inline void store_halves(Four v, capture::Half* to) {
#if defined(__F16C__)
  const __m128i halves = _mm_cvtps_ph(std::bit_cast<__m128>(v), _MM_FROUND_TO_NEAREST_INT);
  std::memcpy(to, &halves, 4 * sizeof *to);
#else
  for (int i = 0; i < 4; ++i) to[i] = capture::half_from_float(v[i]);
#endif
}
// The same past the caches, for pictures that are read when all of them is there: no line is
// fetched to be overwritten. Other threads see it after end_stream().
inline void stream_halves(Four v, capture::Half* to) {
#if defined(__F16C__) && defined(__x86_64__)
  const __m128i halves = _mm_cvtps_ph(std::bit_cast<__m128>(v), _MM_FROUND_TO_NEAREST_INT);
  _mm_stream_si64(reinterpret_cast<long long*>(to), _mm_cvtsi128_si64(halves));
#else
  store_halves(v, to);
#endif
}
inline void end_stream() {
#if defined(__SSE2__)
  _mm_sfence();
#endif
}
// Eight colours, from each of the four values of all.
inline std::array<Four, 8> fours_of(Eight r, Eight g, Eight b, Eight rest) {
  const auto by_two = [](Eight v, Eight w) {
    return std::array{__builtin_shufflevector(v, w, 0, 8, 1, 9, 4, 12, 5, 13),
                      __builtin_shufflevector(v, w, 2, 10, 3, 11, 6, 14, 7, 15)};
  };
  const auto by_four = [](Eight v, Eight w) {
    return std::array{__builtin_shufflevector(v, w, 0, 1, 8, 9, 4, 5, 12, 13),
                      __builtin_shufflevector(v, w, 2, 3, 10, 11, 6, 7, 14, 15)};
  };
  const auto red_green = by_two(r, g), blue_rest = by_two(b, rest);
  const auto low = by_four(red_green[0], blue_rest[0]), high = by_four(red_green[1], blue_rest[1]);
  return {first_four(low[0]), first_four(low[1]), first_four(high[0]), first_four(high[1]),
          last_four(low[0]),  last_four(low[1]),  last_four(high[0]),  last_four(high[1])};
}

inline Lanes dot(Lanes ax, Lanes ay, Lanes az, calibrate::Vec3f b) {
  return add(add(multiply(ax, all(b.x)), multiply(ay, all(b.y))), multiply(az, all(b.z)));
}

}  // namespace render
