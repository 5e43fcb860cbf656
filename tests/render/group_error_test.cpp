// Errors of groups of pixels.
#include "render/group_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace render::group_error_test {
namespace {

capture::Image grey(int height, int width, float value, int channels = 3) {
  capture::Image image = capture::make_image(height, width, channels);
  for (float& pixel : image.pixels) pixel = value;
  return image;
}

TEST(GroupErrors, FindsTheGroupThatErrs) {
  const capture::Image truth = grey(20, 32, 0.5F);
  capture::Image x = truth;
  for (int y = 8; y < 16; ++y) {
    for (int i = 16; i < 24; ++i) {
      for (int c = 0; c < 3; ++c) x.at(y, i, c) = 0.55F;
    }
  }
  const auto groups = group_errors(x, {truth, truth}, grey(20, 32, 1, 1));
  ASSERT_EQ(groups.size(), 12U) << "three rows, the last of half the height";
  for (const GroupError& g : groups) {
    const bool errs = g.x == 16 && g.y == 8;
    EXPECT_NEAR(g.mean, errs ? 0.1 : 0, 1e-6);
    EXPECT_NEAR(g.rms, errs ? 0.1 : 0, 1e-6);
  }
  EXPECT_NEAR(share_within(groups, &GroupError::mean, 0.05), 11.0 / 12, 1e-9);
  EXPECT_EQ(share_within(groups, &GroupError::mean, 0.11), 1);
}

TEST(GroupErrors, TellsNoiseOfPixelsFromAWrongMean) {
  const capture::Image truth = grey(8, 8, 0.5F);
  capture::Image x = truth;
  for (int y = 0; y < 8; ++y) {
    for (int i = 0; i < 8; ++i) {
      for (int c = 0; c < 3; ++c) x.at(y, i, c) += (y + i) % 2 == 0 ? 0.1F : -0.1F;
    }
  }
  const auto groups = group_errors(x, {truth, truth}, grey(8, 8, 1, 1));
  EXPECT_NEAR(groups[0].mean, 0, 1e-6);
  EXPECT_NEAR(groups[0].rms, 0.2, 1e-6);
}

TEST(GroupErrors, TakesNoNoiseOfTheReferencesForAnError) {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 0.1F);
  const capture::Image x = grey(160, 160, 0.5F);
  std::array<capture::Image, 2> references{x, x};
  for (auto& reference : references) {
    for (float& value : reference.pixels) value += noise(random);
  }
  double mean = 0;
  const auto groups = group_errors(x, references, grey(160, 160, 1, 1));
  for (const GroupError& g : groups) mean += g.mean * g.mean / static_cast<double>(groups.size());
  // One reference would give 0.1 / 0.5 / 8 = 0.025 in the root mean square.
  EXPECT_LT(std::sqrt(mean), 0.02);
}

TEST(GroupErrors, LeavesOutWhatIsMaskedAndTakesWhatIsNotFiniteForInfinite) {
  const capture::Image truth = grey(8, 24, 0.5F);
  capture::Image x = truth;
  x.at(2, 2, 0) = std::numeric_limits<float>::quiet_NaN();
  x.at(2, 10, 0) = 3;
  capture::Image mask = grey(8, 24, 1, 1);
  mask.at(2, 10) = 0;
  for (int y = 0; y < 8; ++y) {
    for (int i = 16; i < 24; ++i) mask.at(y, i) = 0;
  }
  const auto groups = group_errors(x, {truth, truth}, mask);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_TRUE(std::isinf(groups[0].mean));
  EXPECT_EQ(groups[1].mean, 0);
}

TEST(GroupErrors, RefusesPicturesOfOtherSizes) {
  const capture::Image truth = grey(8, 8, 1);
  EXPECT_THROW(group_errors(grey(8, 9, 1), {truth, truth}, grey(8, 8, 1, 1)),
               std::invalid_argument);
}

}  // namespace
}  // namespace render::group_error_test
