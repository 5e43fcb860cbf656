// Half floats: the software conversions against the definition and the machine's.
#include "capture/half.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace capture::half_test {
namespace {

TEST(FloatFromHalf, IsTheSameInSoftwareForEveryBitPattern) {
  for (std::uint32_t bits = 0; bits <= 0xFFFF; ++bits) {
    const auto half = static_cast<Half>(bits);
    ASSERT_EQ(std::bit_cast<std::uint32_t>(software::float_from_half(half)),
              std::bit_cast<std::uint32_t>(float_from_half(half)))
        << bits;
  }
}

TEST(FloatFromHalf, ComesBackFromEveryFiniteHalf) {
  for (std::uint32_t bits = 0; bits <= 0xFFFF; ++bits) {
    const auto half = static_cast<Half>(bits);
    if (!std::isfinite(float_from_half(half))) continue;
    ASSERT_EQ(software::half_from_float(software::float_from_half(half)), half);
  }
}

TEST(FloatsFromHalves, AreEachTheSame) {
  std::vector<Half> halves(31);
  for (std::size_t i = 0; i < halves.size(); ++i) halves[i] = static_cast<Half>(2111 * i);
  for (std::size_t count = 0; count <= halves.size(); ++count) {
    std::vector<float> floats(halves.size() + 1, -7);
    floats_from_halves(std::span(halves).first(count), floats.data());
    for (std::size_t i = 0; i < count; ++i) {
      const float one = float_from_half(halves[i]);
      EXPECT_EQ(std::bit_cast<std::uint32_t>(floats[i]), std::bit_cast<std::uint32_t>(one)) << i;
    }
    EXPECT_EQ(floats[count], -7) << "written beyond the last of " << count;
  }
}

TEST(HalfFromFloat, IsTheSameInSoftwareForAnyFloat) {
  std::mt19937 random(20);
  for (int i = 0; i < 2'000'000; ++i) {
    const float value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    ASSERT_EQ(software::half_from_float(value), half_from_float(value)) << value;
  }
}

TEST(HalfFromFloat, RoundsTiesToEvenBetweenAnyTwoNeighbours) {
  for (std::uint32_t bits = 0; bits < 0x7BFF; ++bits) {
    const float lower = float_from_half(static_cast<Half>(bits));
    const float upper = float_from_half(static_cast<Half>(bits + 1));
    const float middle = lower + (upper - lower) / 2;
    const std::uint32_t even = bits % 2 == 0 ? bits : bits + 1;
    ASSERT_EQ(software::half_from_float(middle), even);
    ASSERT_EQ(half_from_float(middle), even);
    ASSERT_EQ(software::half_from_float(std::nextafter(middle, 0.0F)), bits);
    ASSERT_EQ(software::half_from_float(std::nextafter(middle, half_max)), bits + 1);
  }
}

TEST(HalfFromFloat, OverflowsToInfinityAndKeepsNan) {
  EXPECT_EQ(software::half_from_float(65519.996F), half_from_float(half_max));
  EXPECT_TRUE(std::isinf(float_from_half(software::half_from_float(65520.0F))));
  EXPECT_TRUE(std::isnan(
      float_from_half(software::half_from_float(std::numeric_limits<float>::quiet_NaN()))));
}

}  // namespace
}  // namespace capture::half_test
