// Half floats (IEEE binary16) as their bits.
#pragma once

#include <cstdint>

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

}  // namespace capture
