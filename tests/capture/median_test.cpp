// Medians and quantiles, against sorting.
#include "capture/median.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

namespace capture::median_test {
namespace {

TEST(Median, IsTheMiddleOfTheSortedValues) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  for (std::size_t count = 1; count < 40; ++count) {
    std::vector<double> values(count);
    for (double& value : values) value = any(random);
    const std::vector<double> before = values;
    std::vector<double> sorted = values;
    std::ranges::sort(sorted);
    EXPECT_EQ(median(values), sorted[count / 2]);
    EXPECT_EQ(values, before);
    const std::vector<float> floats(values.begin(), values.end());
    EXPECT_EQ(median(floats), static_cast<float>(sorted[count / 2]));
    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const double place = std::floor(share * static_cast<double>(count - 1));
      EXPECT_EQ(quantile_in_place(values, share), sorted[static_cast<std::size_t>(place)]);
    }
    EXPECT_EQ(median_in_place(values), sorted[count / 2]);
  }
}

TEST(Median, OfAnEvenCountIsTheUpperAndHalfTheQuantileTheLower) {
  std::vector<double> values{4, 1, 3, 2};
  EXPECT_EQ(median_in_place(values), 3);
  EXPECT_EQ(quantile_in_place(values, 0.5), 2);
  EXPECT_EQ(median_in_place(std::span(values).first(1)), values[0]);
}

TEST(Median, TellsTheDeviationOfANormalSpread) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 2);
  std::vector<double> off(20001);
  for (double& value : off) value = std::abs(noise(random));
  EXPECT_NEAR(sigma_by_median * median(off), 2, 0.05);
}

}  // namespace
}  // namespace capture::median_test
