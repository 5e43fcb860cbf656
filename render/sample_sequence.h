// Random numbers of paths: well spread over the samples of a pixel, unlike between pixels.
#pragma once

#include <array>
#include <cstdint>

namespace render {

// Pairs of numbers in 0..1 for one path. The k-th pairs of all paths of a pixel form an
// Owen-scrambled Sobol set of two dimensions, so that the picture converges faster than with plain
// random numbers; pairs of different k, pixels and seeds are independent.
//
// Burley, "Practical Hash-based Owen Scrambling", JCGT 2020.
class SampleSequence {
 public:
  SampleSequence(std::uint32_t seed, std::uint32_t pixel, std::uint32_t sample)
      : seed_(mixed(mixed(seed) ^ pixel)), sample_(sample) {}

  std::array<float, 2> next_pair() {
    const std::uint32_t key = mixed(seed_ + 0x9E3779B9U * ++pair_);
    const std::uint32_t index = scrambled(sample_, key);
    return {unit(scrambled(reversed(index), mixed(key ^ 0x68BC21EBU))),
            unit(scrambled(second_dimension(index), mixed(key ^ 0x02E5BE93U)))};
  }
  float next() { return next_pair()[0]; }

 private:
  static std::uint32_t mixed(std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x7FEB352DU;
    x ^= x >> 15;
    x *= 0x846CA68BU;
    return x ^ x >> 16;
  }
  static std::uint32_t reversed(std::uint32_t x) {
    x = x << 16 | x >> 16;
    x = (x & 0x00FF00FFU) << 8 | (x & 0xFF00FF00U) >> 8;
    x = (x & 0x0F0F0F0FU) << 4 | (x & 0xF0F0F0F0U) >> 4;
    x = (x & 0x33333333U) << 2 | (x & 0xCCCCCCCCU) >> 2;
    return (x & 0x55555555U) << 1 | (x & 0xAAAAAAAAU) >> 1;
  }
  // Owen's scrambling: every bit flips by a hash of the bits above it.
  static std::uint32_t scrambled(std::uint32_t x, std::uint32_t key) {
    x = reversed(x);
    x += key;
    x ^= x * 0x6C50B47CU;
    x ^= x * 0xB82F1E52U;
    x ^= x * 0xC7AFE638U;
    x ^= x * 0x8D22F6E6U;
    return reversed(x);
  }
  // Sobol's second dimension: direction numbers are the rows of Pascal's triangle modulo 2.
  static std::uint32_t second_dimension(std::uint32_t index) {
    std::uint32_t result = 0;
    for (std::uint32_t direction = 1U << 31; index != 0; index >>= 1) {
      if ((index & 1U) != 0) result ^= direction;
      direction ^= direction >> 1;
    }
    return result;
  }
  static float unit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24F; }

  std::uint32_t seed_;
  std::uint32_t sample_;
  std::uint32_t pair_ = 0;
};

}  // namespace render
