#include "render/environment_terms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "render/environment.h"

namespace render::environment_terms_test {
namespace {

using calibrate::Vec3f;

capture::Image noise(int height, unsigned seed) {
  std::mt19937 random(seed);
  capture::Image level = capture::make_image(height, 2 * height, 3);
  for (float& value : level.pixels) value = std::uniform_real_distribution<float>(0, 2)(random);
  return level;
}

struct Sky {
  std::vector<capture::Image> images{noise(64, 1), noise(32, 2), noise(1, 3)};
  std::vector<const capture::Image*> levels{&images[0], &images[1], &images[2]};
};

using Slots = std::array<Four, EnvironmentTerms::slots>;

Slots lit(const std::vector<PlaceTerm>& terms, const Sky& sky) {
  EnvironmentTerms packed;
  packed.pack(terms, sky.levels);
  BorderedLevels levels;
  levels.begin(sky.levels);
  Slots added{};
  packed.add_light(levels, added);
  return added;
}

TEST(EnvironmentTerms, LightSlotsAsTermsOneByOneDo) {
  const Sky sky;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<PlaceTerm> terms;
  std::array<Vec3f, EnvironmentTerms::slots> expected{};
  std::array<float, EnvironmentTerms::slots> scale{};
  for (std::uint16_t slot = 0; slot < EnvironmentTerms::slots; slot += 7) {
    for (int i = 0; i < 9; ++i) {
      const auto level = static_cast<std::uint16_t>(random() % 3);
      const capture::Image& image = sky.images[level];
      // Poles and the seam too; weights of both signs over twelve powers of ten.
      const float x = unit(random) * static_cast<float>(image.width) - 0.5F;
      const float y = unit(random) * static_cast<float>(image.height) - 0.5F;
      const float size = std::pow(10.0F, 12 * unit(random) - 6);
      const Vec3f weight = Vec3f{unit(random) - 0.2F, unit(random), unit(random)} * size;
      terms.push_back({weight, x, y, slot, level});
      expected[slot] += weight * radiance_at(image, x, y);
      scale[slot] = std::max(scale[slot], 2 * size);
    }
  }
  const Slots added = lit(terms, sky);
  for (std::size_t slot = 0; slot < added.size(); ++slot) {
    const Vec3f got = three_of(added[slot]);
    EXPECT_NEAR(got.x, expected[slot].x, 1e-2F * scale[slot]);
    EXPECT_NEAR(got.y, expected[slot].y, 1e-2F * scale[slot]);
    EXPECT_NEAR(got.z, expected[slot].z, 1e-2F * scale[slot]);
  }
}

TEST(EnvironmentTerms, KeepWeightsToAFourteenThousandthOfTheGreatest) {
  Sky sky;
  std::ranges::fill(sky.images[1].pixels, 1.0F);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> around(-1, 1);
  for (int i = 0; i < 20000; ++i) {
    // Near the powers of two as well.
    const float size = i % 2 ? 1 - std::exp2(-2 - static_cast<float>(random() % 20)) : 1;
    const Vec3f weight{around(random) > 0 ? size : around(random) * size,
                       around(random) > 0 ? size : around(random) * size, around(random) * size};
    const float x = (around(random) + 1) * 32 - 0.5F, y = (around(random) + 1) * 16 - 0.5F;
    const Vec3f got = three_of(lit({{weight, x, y, 3, 1}}, sky)[3]);
    EXPECT_NEAR(got.x, weight.x, size / 14000);
    EXPECT_NEAR(got.y, weight.y, size / 14000);
    EXPECT_NEAR(got.z, weight.z, size / 14000);
  }
}

TEST(EnvironmentTerms, KeepPlacesToHalfAStepEitherWay) {
  Sky sky;
  capture::Image& ramp = sky.images[0];
  for (int y = 0; y < ramp.height; ++y) {
    for (int x = 0; x < ramp.width; ++x) {
      ramp.at(y, x, 0) = static_cast<float>(x), ramp.at(y, x, 1) = static_cast<float>(y);
    }
  }
  // 128 columns take 256 of 65536 steps each, 64 rows 512.
  constexpr float half_column = 1.0F / 512, half_row = 1.0F / 1024, rounding = 3e-5F;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  double off_x = 0, off_y = 0;
  constexpr int count = 4000;
  for (int i = 0; i < count; ++i) {
    const float x = unit(random) * static_cast<float>(ramp.width - 1);
    const float y = unit(random) * static_cast<float>(ramp.height - 1);
    const Vec3f got = three_of(lit({{{1, 1, 1}, x, y, 2, 0}}, sky)[2]);
    EXPECT_NEAR(got.x, x, half_column + rounding);
    EXPECT_NEAR(got.y, y, half_row + rounding);
    off_x += got.x - x, off_y += got.y - y;
  }
  EXPECT_NEAR(off_x / count, 0, half_column / 20);
  EXPECT_NEAR(off_y / count, 0, half_row / 20);
}

TEST(EnvironmentTerms, KeepGreyGrey) {
  Sky sky;
  std::ranges::fill(sky.images[0].pixels, 0.7F);
  for (float grey = 0.0001F; grey < 100; grey *= 1.01F) {
    const Vec3f got = three_of(lit({{{grey, grey, -grey}, 3, 5, 7, 0}}, sky)[7]);
    EXPECT_EQ(got.x, got.y);
    EXPECT_EQ(got.x, -got.z);
  }
}

TEST(EnvironmentTerms, KeepPowersOfTwoExactly) {
  Sky sky;
  std::ranges::fill(sky.images[0].pixels, 1.0F);
  const Slots added =
      lit({{{1, 0.5F, 0.25F}, 3, 5, 0, 0}, {{0x1p-90F, 0, -0x1p-90F}, 9, 9, 511, 0}}, sky);
  EXPECT_EQ(three_of(added[0]), (Vec3f{1, 0.5F, 0.25F}));
  EXPECT_EQ(three_of(added[511]), (Vec3f{0x1p-90F, 0, -0x1p-90F}));
}

TEST(EnvironmentTerms, LeaveSlotsAloneThatLookNowhere) {
  Sky sky;
  std::ranges::fill(sky.images[0].pixels, std::numeric_limits<float>::quiet_NaN());
  for (int y = 20; y < 30; ++y) {
    for (int x = 20; x < 30; ++x) {
      for (int c = 0; c < 3; ++c) sky.images[0].at(y, x, c) = 1;
    }
  }
  const Slots added = lit({{{1, 1, 1}, 25, 25, 9, 0}}, sky);
  EXPECT_EQ(three_of(added[0]), Vec3f{});
  EXPECT_EQ(three_of(added[9]), (Vec3f{1, 1, 1}));
}

TEST(EnvironmentTerms, CountNothingThatIsNoNumber) {
  const Sky sky;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const Slots added = lit({{{nan, 1, 1}, 3, 3, 1, 0},
                           {{1, inf, 1}, 3, 3, 2, 1},
                           {{0x1p-130F, 0, 0}, 3, 3, 3, 0},
                           {{1, 1, 1}, nan, -inf, 4, 0}},
                          sky);
  for (std::size_t slot : {1, 2, 3}) EXPECT_EQ(three_of(added[slot]), Vec3f{});
  EXPECT_TRUE(std::isfinite(added[4][0]));
}

// Nothing is read that is no texel, wherever a place is.
TEST(EnvironmentTerms, LookNoFartherThanTheBorder) {
  const Sky sky;
  constexpr float inf = std::numeric_limits<float>::infinity();
  for (std::uint16_t level = 0; level < sky.levels.size(); ++level) {
    const auto width = static_cast<float>(sky.images[level].width);
    const auto height = static_cast<float>(sky.images[level].height);
    const Slots beyond =
        lit({{{1, 1, 1}, inf, 1e6F, 0, level}, {{1, 1, 1}, -inf, -9, 1, level}}, sky);
    const Slots at =
        lit({{{1, 1, 1}, width, height, 0, level}, {{1, 1, 1}, -1, -1, 1, level}}, sky);
    for (const std::size_t slot : {0, 1}) EXPECT_EQ(three_of(beyond[slot]), three_of(at[slot]));
  }
}

}  // namespace
}  // namespace render::environment_terms_test
