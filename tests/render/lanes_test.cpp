#include "render/lanes.h"

#include <gtest/gtest.h>

namespace render::lanes_test {
namespace {

TEST(FoursOf, TakesEachColourFromItsPlaces) {
  Eight r, g, b, rest;
  for (int i = 0; i < 8; ++i) {
    const auto v = static_cast<float>(i);
    r[i] = v, g[i] = 10 + v, b[i] = 20 + v, rest[i] = 30 + v;
  }
  const auto fours = fours_of(r, g, b, rest);
  for (std::size_t i = 0; i < 8; ++i) {
    for (int c = 0; c < 4; ++c)
      EXPECT_EQ(fours[i][c], static_cast<float>(10 * c) + static_cast<float>(i));
  }
}

TEST(BitsOf, HasABitForEachLane) {
  for (unsigned bits = 0; bits < 16; ++bits) {
    Four v{};
    for (unsigned i = 0; i < 4; ++i) v[i] = bits >> i & 1 ? 2.0F : 0.0F;
    EXPECT_EQ(bits_of(v > 1), bits);
  }
  for (unsigned bits = 0; bits < 256; ++bits) {
    Eight v{};
    for (unsigned i = 0; i < 8; ++i) v[i] = bits >> i & 1 ? 2.0F : 0.0F;
    EXPECT_EQ(bits_of(v > eight_of(1)), bits);
  }
}

TEST(ToFront, KeepsTheOrderOfThoseThatAreAskedFor) {
  constexpr std::array<std::uint32_t, 8> from{10, 11, 12, 13, 14, 15, 16, 17};
  for (unsigned bits = 0; bits < 256; ++bits) {
    std::array<std::uint32_t, 8> to{};
    ToFront(bits).move(from.data(), to.data());
    std::size_t n = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if ((bits >> i & 1) == 0) continue;
      EXPECT_EQ(to[n++], from[i]);
    }
  }
}

TEST(Root, IsThatOfEveryLane) {
  const Eight v{0, 1, 2, 3, 1e-30F, 1e30F, 0.1F, 7};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(root(v)[i], root(v[i]));
}

}  // namespace
}  // namespace render::lanes_test
