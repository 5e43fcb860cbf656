// Half floats by integer arithmetic: for machines without F16C, and as its cross-check.
#include "capture/half.h"

#include <bit>
#include <cstdint>

namespace capture::software {
namespace {

constexpr std::uint32_t sign_shift = 16;      // from a float's sign bit to a half's
constexpr std::uint32_t mantissa_shift = 13;  // 23 - 10 bits
constexpr std::uint32_t float_infinity = 0x7F800000U;
constexpr std::uint32_t smallest_normal = 0x38800000U;  // 2^-14
constexpr std::uint32_t first_overflow = 0x477FF000U;   // 65,520: rounds to infinity
constexpr std::uint32_t exponent_rebias = 112U << 23;   // 127 - 15

// value / 2^shift, to nearest, ties to even.
constexpr std::uint32_t rounded_shift(std::uint32_t value, std::uint32_t shift) {
  const std::uint32_t half = (1U << (shift - 1)) - 1 + ((value >> shift) & 1U);
  return (value + half) >> shift;
}

}  // namespace

Half half_from_float(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sign = (bits >> sign_shift) & 0x8000U;
  const std::uint32_t magnitude = bits & 0x7FFFFFFFU;
  std::uint32_t half = 0;
  if (magnitude > float_infinity) {
    half = 0x7E00U | ((magnitude >> mantissa_shift) & 0x3FFU);  // quiet, payload kept
  } else if (magnitude >= first_overflow) {
    half = 0x7C00U;
  } else if (magnitude >= smallest_normal) {
    half = rounded_shift(magnitude - exponent_rebias, mantissa_shift);
  } else if (const std::uint32_t exponent = magnitude >> 23; exponent >= 102) {  // 2^-25 and up
    const std::uint32_t mantissa = (magnitude & 0x7FFFFFU) | 0x800000U;
    half = rounded_shift(mantissa, 126 - exponent);  // subnormal: units of 2^-24
  }
  return static_cast<Half>(sign | half);
}

float float_from_half(Half bits) {
  const std::uint32_t sign = (bits & 0x8000U) << sign_shift;
  const std::uint32_t exponent = (bits >> 10) & 0x1FU;
  const std::uint32_t mantissa = bits & 0x3FFU;
  if (exponent == 0) {
    const float magnitude = static_cast<float>(mantissa) * 0x1p-24F;
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) | sign);
  }
  if (exponent == 31) {
    const std::uint32_t quiet = mantissa != 0 ? 0x400000U : 0;
    return std::bit_cast<float>(sign | float_infinity | quiet | (mantissa << mantissa_shift));
  }
  return std::bit_cast<float>(sign |
                              (((exponent << 10 | mantissa) << mantissa_shift) + exponent_rebias));
}

}  // namespace capture::software
