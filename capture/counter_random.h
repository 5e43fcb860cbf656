// Random numbers by counter: the same place always has the same number, in whatever order and from
// whatever thread it is asked for.
#pragma once

#include <cmath>
#include <cstdint>

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

// Uniform over 0..1, both ends excluded, from the upper half of 64 bits.
constexpr double uniform_high(std::uint64_t bits) {
  return (static_cast<double>(bits >> 32) + 0.5) / 4294967296.0;
}

// The value below which a normal deviate of mean 0 and variance 1 lies with probability `p`,
// 2^-33 <= p <= 1 - 2^-33, to seven digits.
//
// Wichura, "Algorithm AS 241: The Percentage Points of the Normal Distribution", Applied Statistics
// 1988, PPND7 without its farthest tail.
inline double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * (((5.9109374720e1 * r + 1.5929113202e2) * r + 5.0434271938e1) * r + 3.3871327179) /
           (((6.7187563600e1 * r + 7.8757757664e1) * r + 1.7895169469e1) * r + 1);
  }
  const double r = std::sqrt(-std::log(q < 0 ? p : 1 - p)) - 1.6;
  const double tail =
      (((1.7023821103e-1 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777) /
      ((1.2021132975e-1 * r + 7.3700164250e-1) * r + 1);
  return q < 0 ? -tail : tail;
}

// A normal deviate of mean 0 and variance 1.
inline double normal_deviate(std::uint64_t bits) { return normal_quantile(uniform_high(bits)); }

}  // namespace capture
