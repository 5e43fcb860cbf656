// An environment's levels with their borders, beside radiance_at().
#include "render/bordered_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "render/environment.h"

namespace render::bordered_levels_test {
namespace {

using calibrate::Vec3f;

capture::Image noise(int height, unsigned seed, float decades) {
  std::mt19937 random(seed);
  capture::Image level = capture::make_image(height, 2 * height, 3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (float& value : level.pixels) value = std::pow(10.0F, decades * (unit(random) - 0.5F));
  return level;
}

// As the terms of a cell look a place up.
Vec3f looked_up(const BorderedLevels::Level& level, float x, float y) {
  const float column = std::floor(x + 1), line = std::floor(y + 1);
  const float fx = x + 1 - column, fy = y + 1 - line;
  const capture::Half* at =
      level.texels + level.row * static_cast<int>(line) + 4 * static_cast<int>(column);
  const auto texel = [&](const capture::Half* p) {
    return Vec3f{capture::float_from_half(p[0]), capture::float_from_half(p[1]),
                 capture::float_from_half(p[2])};
  };
  const capture::Half* below = at + level.row;
  return ((texel(at) * (1 - fx) + texel(at + 4) * fx) * (1 - fy) +
          (texel(below) * (1 - fx) + texel(below + 4) * fx) * fy) *
         level.scale;
}

void expect_near(Vec3f got, Vec3f expected, float share) {
  EXPECT_NEAR(got.x, expected.x, share * expected.x);
  EXPECT_NEAR(got.y, expected.y, share * expected.y);
  EXPECT_NEAR(got.z, expected.z, share * expected.z);
}

TEST(BorderedLevels, ShowWhatRadianceAtShowsAtPolesAndSeamToo) {
  std::vector<capture::Image> images;
  for (int height : {64, 5, 2, 1}) images.push_back(noise(height, 3, 6));
  std::vector<const capture::Image*> levels;
  for (const capture::Image& image : images) levels.push_back(&image);
  BorderedLevels bordered;
  bordered.begin(levels);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const capture::Image& image = *levels[i];
    for (int k = 0; k < 4000; ++k) {
      const float x = unit(random) * static_cast<float>(image.width) - 0.5F;
      const float y = unit(random) * static_cast<float>(image.height) - 0.5F;
      expect_near(looked_up(bordered.at(i), x, y), radiance_at(image, x, y), 1.0F / 2000);
    }
  }
}

TEST(BorderedLevels, HoldTheBrightestAndTheFaintest) {
  for (const float brightest : {1e9F, 7.0F, 1e-20F}) {
    capture::Image image = noise(8, 5, 0);
    for (float& value : image.pixels) value = brightest * 1e-9F;
    image.at(3, 4, 0) = brightest;
    BorderedLevels bordered;
    const std::vector<const capture::Image*> levels{&image};
    bordered.begin(levels);
    EXPECT_NEAR(looked_up(bordered.at(0), 4, 3).x, brightest, brightest / 2000);
    EXPECT_NEAR(looked_up(bordered.at(0), 8, 6).x, brightest * 1e-9F, brightest * 0x1p-39F);
  }
}

TEST(BorderedLevels, CountNothingThatIsNoNumber) {
  capture::Image image = capture::make_image(4, 8, 3);
  image.pixels.assign(image.pixels.size(), 0.5F);
  image.at(1, 2, 0) = std::numeric_limits<float>::quiet_NaN();
  image.at(1, 2, 1) = -std::numeric_limits<float>::quiet_NaN();
  image.at(1, 2, 2) = -3;
  image.at(2, 5, 1) = std::numeric_limits<float>::infinity();
  BorderedLevels bordered;
  const std::vector<const capture::Image*> levels{&image};
  bordered.begin(levels);
  EXPECT_EQ(looked_up(bordered.at(0), 2, 1), Vec3f{});
  EXPECT_NEAR(looked_up(bordered.at(0), 5, 2).y, brightest_radiance, brightest_radiance / 2000);
  expect_near(looked_up(bordered.at(0), 6, 1), {0.5F, 0.5F, 0.5F}, 0.01F);
}

TEST(BorderedLevels, AreThoseOfTheLastBegin) {
  capture::Image first = noise(8, 1, 1), second = noise(8, 2, 1), third = noise(16, 3, 1);
  BorderedLevels bordered;
  for (const capture::Image* image : {&first, &second, &third, &first}) {
    const std::vector<const capture::Image*> levels{image, &second};
    bordered.begin(levels);
    expect_near(looked_up(bordered.at(0), 3, 4), radiance_at(*image, 3, 4), 1.0F / 2000);
    expect_near(looked_up(bordered.at(1), 3, 4), radiance_at(second, 3, 4), 1.0F / 2000);
  }
}

}  // namespace
}  // namespace render::bordered_levels_test
