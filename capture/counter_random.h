// Random numbers by counter: the same place always has the same number, in whatever order and from
// whatever thread it is asked for.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace capture {

// 64 well-mixed bits of a key: the finalizer of Steele, Lea and Flood, "Fast Splittable
// Pseudorandom Number Generators", OOPSLA 2014 (SplitMix64).
constexpr std::uint64_t mixed_bits(std::uint64_t key) {
  key += 0x9E3779B97F4A7C15U;
  key = (key ^ (key >> 30)) * 0xBF58476D1CE4E5B9U;
  key = (key ^ (key >> 27)) * 0x94D049BB133111EBU;
  return key ^ (key >> 31);
}
constexpr std::uint64_t mixed_bits(std::uint64_t key, std::uint64_t counter) {
  return mixed_bits(mixed_bits(key) ^ counter);
}

// Uniform over 0..1, both ends excluded, from the upper or lower half of 64 bits.
constexpr double uniform_high(std::uint64_t bits) {
  return (static_cast<double>(bits >> 32) + 0.5) / 4294967296.0;
}
constexpr double uniform_low(std::uint64_t bits) {
  return (static_cast<double>(bits & 0xFFFFFFFFU) + 0.5) / 4294967296.0;
}

// Of mean 0 and variance 1. Box and Muller, "A Note on the Generation of Random Normal Deviates",
// Annals of Mathematical Statistics 1958.
inline double normal_deviate(std::uint64_t bits) {
  return std::sqrt(-2 * std::log(uniform_high(bits))) *
         std::cos(2 * std::numbers::pi * uniform_low(bits));
}

}  // namespace capture
