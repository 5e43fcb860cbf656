// Shifts of small pictures.
#include "compositing/coarse_shift.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace compositing::coarse_shift_test {
namespace {

constexpr int rows = 34, columns = 60;

// Smooth blots on a bright ground, as bright at a place of it.
float light_at(float x, float y) {
  float light = 0.2F;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-20, 80), size(2, 5);
  for (int i = 0; i < 40; ++i) {
    const float u = x - place(random), v = y - place(random), s = size(random);
    light += std::exp(-(u * u + v * v) / (s * s));
  }
  return light;
}

std::vector<float> picture(float right, float down, float gain = 1) {
  std::vector<float> light;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x)
      light.push_back(gain * light_at(static_cast<float>(x) - right, static_cast<float>(y) - down));
  }
  return light;
}

TEST(CoarseShift, FindsShiftsOfUpToAQuarterUnderOtherLightAndBehindSomebody) {
  CoarseShift shift(rows, columns, picture(0, 0));
  for (const auto& [right, down] :
       {std::pair{0.0F, 0.0F}, {2.4F, -1.3F}, {-9, 5}, {14, 7}, {-14, -7}}) {
    std::vector<float> seen = picture(right, down, 1.6F);
    for (int y = 10; y < rows; ++y) {
      for (int x = 20; x < 34; ++x)
        seen[static_cast<std::size_t>(y * columns + x)] = static_cast<float>((x + y) % 3) + 0.1F;
    }
    std::array<CoarseShift::Shift, 3> found;
    ASSERT_GE(shift.find(seen, found), 1U) << right << ' ' << down;
    EXPECT_NEAR(found[0].right, right, 0.6) << down;
    EXPECT_NEAR(found[0].down, down, 0.6) << right;
  }
}

TEST(CoarseShift, SaysNothingOfWhatIsAnotherPicture) {
  CoarseShift shift(rows, columns, picture(0, 0));
  std::mt19937 random(7);
  std::uniform_real_distribution<float> light(0, 1);
  std::vector<float> noise(rows * columns);
  for (float& value : noise) value = light(random);
  std::array<CoarseShift::Shift, 3> found;
  const auto find = [&](const std::vector<float>& seen) { return shift.find(seen, found); };
  EXPECT_EQ(find(noise), 0U);
  EXPECT_EQ(find(std::vector<float>(rows * columns, 0.5F)), 0U);
  EXPECT_EQ(find(std::vector<float>(rows * columns, std::nanf(""))), 0U);
  EXPECT_EQ(find(picture(200, 0)), 0U);
}

TEST(CoarseShift, RefusesPicturesOfOtherSizes) {
  EXPECT_THROW(CoarseShift(rows, columns, std::vector<float>(7)), std::invalid_argument);
  EXPECT_THROW(CoarseShift(0, 0, {}), std::invalid_argument);
  CoarseShift shift(rows, columns, picture(0, 0));
  EXPECT_THROW(shift.find(std::vector<float>(7), {}), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::coarse_shift_test
