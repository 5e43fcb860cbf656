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
    const std::uint32_t index = reversed(hashed(reversed(sample_), key));
    return {unit(reversed(hashed(index, mixed(key ^ 0x68BC21EBU)))),
            unit(reversed(hashed(second_dimension(index), mixed(key ^ 0x02E5BE93U))))};
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
    x = __builtin_bswap32(x);
    x = (x & 0x0F0F0F0FU) << 4 | (x & 0xF0F0F0F0U) >> 4;
    x = (x & 0x33333333U) << 2 | (x & 0xCCCCCCCCU) >> 2;
    return (x & 0x55555555U) << 1 | (x & 0xAAAAAAAAU) >> 1;
  }
  // Owen's scrambling of a number whose bits are reversed: each flips by a hash of the lower ones.
  static std::uint32_t hashed(std::uint32_t x, std::uint32_t key) {
    x += key;
    x ^= x * 0x6C50B47CU;
    x ^= x * 0xB82F1E52U;
    x ^= x * 0xC7AFE638U;
    return x ^ x * 0x8D22F6E6U;
  }
  // Sobol's second dimension, bits reversed: bit j is the sum of the index's bits k with binomial
  // (k, j) odd, which is where k has all bits of j (Lucas). The first dimension is the index
  // itself.
  static std::uint32_t second_dimension(std::uint32_t index) {
    index ^= index >> 1 & 0x55555555U;
    index ^= index >> 2 & 0x33333333U;
    index ^= index >> 4 & 0x0F0F0F0FU;
    index ^= index >> 8 & 0x00FF00FFU;
    return index ^ (index >> 16 & 0x0000FFFFU);
  }
  static float unit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24F; }

  std::uint32_t seed_;
  std::uint32_t sample_;
  std::uint32_t pair_ = 0;
};

}  // namespace render
