#include "render/lanes.h"

#include <gtest/gtest.h>

namespace render {
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
}

}  // namespace
}  // namespace render
