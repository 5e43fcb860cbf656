// Samples shared among the pixels of a reference.
#include "render/sample_budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <stdexcept>

namespace render::sample_budget_test {
namespace {

constexpr int width = 40;
constexpr int height = 30;

std::int64_t sum(const std::vector<int>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
}

TEST(ShareSamples, SpendsTheTotalWhateverTheNoise) {
  std::mt19937 random(1);
  std::exponential_distribution<float> noise;
  std::vector<float> variances(width * height);
  for (const std::int64_t each : {8, 100, 3000}) {
    for (float& variance : variances) variance = noise(random);
    const auto counts = share_samples(variances, width, each * width * height, 2, 1 << 20);
    // Half a sample of rounding per pixel at most, and much less in the sum.
    EXPECT_NEAR(static_cast<double>(sum(counts)), static_cast<double>(each * width * height),
                0.1 * width * height);
  }
}

TEST(ShareSamples, KeepsEveryPixelWithinItsBounds) {
  std::vector<float> variances(width * height, 0.0F);
  variances[15 * width + 20] = 1e6F;
  const auto counts = share_samples(variances, width, 64 * width * height, 16, 1000);
  const auto [least, most] = std::ranges::minmax(counts);
  EXPECT_EQ(least, 16);
  EXPECT_EQ(most, 1000);
}

TEST(ShareSamples, GivesPixelsInProportionToTheirDeviation) {
  // Left half four times the deviation of the right one.
  std::vector<float> variances(width * height);
  for (int i = 0; i < width * height; ++i) {
    variances[static_cast<std::size_t>(i)] = i % width < width / 2 ? 16.0F : 1.0F;
  }
  const auto counts = share_samples(variances, width, 1000 * width * height, 1, 1 << 20);
  const double left = counts[15 * width + 5], right = counts[15 * width + 35];
  EXPECT_NEAR(left / right, 4, 0.04);
  EXPECT_NEAR(left + right, 2000, 60) << "the border, smoothed, takes a little";
}

TEST(ShareSamples, GivesThePixelsAroundNoiseMoreToo) {
  std::vector<float> variances(width * height, 0.0F);
  variances[15 * width + 20] = 1;
  const auto counts = share_samples(variances, width, 10 * width * height, 4, 1 << 20);
  EXPECT_GT(counts[17 * width + 22], 100);
  EXPECT_EQ(counts[18 * width + 20], 4) << "three pixels away";
}

TEST(ShareSamples, GivesAStillPictureTheLeast) {
  const std::vector<float> variances(width * height, 0.0F);
  for (const int count : share_samples(variances, width, 100 * width * height, 12, 6400)) {
    EXPECT_EQ(count, 12);
  }
}

TEST(ShareSamples, RefusesBoundsAndWidthsThatDoNotFit) {
  const std::vector<float> variances(12, 1.0F);
  EXPECT_THROW(share_samples(variances, 5, 100, 1, 10), std::invalid_argument);
  EXPECT_THROW(share_samples(variances, 0, 100, 1, 10), std::invalid_argument);
  EXPECT_THROW(share_samples(variances, 4, 100, 0, 10), std::invalid_argument);
  EXPECT_THROW(share_samples(variances, 4, 100, 11, 10), std::invalid_argument);
}

}  // namespace
}  // namespace render::sample_budget_test
