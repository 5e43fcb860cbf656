// Half floats (IEEE binary16) as their bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#if defined(__F16C__)
#include <immintrin.h>
#endif

namespace capture {

using Half = std::uint16_t;

// The largest finite half. Brighter radiance is clamped to it on output, and counted.
inline constexpr float half_max = 65504.0F;

namespace software {
// The same conversions by integer arithmetic: slower, bit for bit equal.
Half half_from_float(float value);
float float_from_half(Half bits);
}  // namespace software

#if defined(__F16C__)
// Rounds to nearest, ties to even; values from 65,520 on become infinity, NaN stays NaN.
inline Half half_from_float(float value) {
  return static_cast<Half>(_cvtss_sh(value, _MM_FROUND_TO_NEAREST_INT));
}
inline float float_from_half(Half bits) { return _cvtsh_ss(bits); }
#else
inline Half half_from_float(float value) { return software::half_from_float(value); }
inline float float_from_half(Half bits) { return software::float_from_half(bits); }
#endif

// As many halves as there are floats, each by half_from_float.
inline void halves_from_floats(std::span<const float> floats, Half* halves) {
  std::size_t i = 0;
#if defined(__F16C__)
  for (; i + 8 <= floats.size(); i += 8) {
    const __m128i eight = _mm256_cvtps_ph(_mm256_loadu_ps(&floats[i]), _MM_FROUND_TO_NEAREST_INT);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(halves + i), eight);
  }
#endif
  for (; i < floats.size(); ++i) halves[i] = half_from_float(floats[i]);
}

// As many floats as there are halves, each by float_from_half.
inline void floats_from_halves(std::span<const Half> halves, float* floats) {
  std::size_t i = 0;
#if defined(__F16C__)
  for (; i + 8 <= halves.size(); i += 8) {
    const __m128i eight = _mm_loadu_si128(reinterpret_cast<const __m128i*>(&halves[i]));
    _mm256_storeu_ps(floats + i, _mm256_cvtph_ps(eight));
  }
#endif
  for (; i < halves.size(); ++i) floats[i] = float_from_half(halves[i]);
}

}  // namespace capture
