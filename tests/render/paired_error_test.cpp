// Errors against noisy truths: as without the noise, and as uncertain as they say.
#include "render/paired_error.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "render/reference.h"

namespace render::paired_error_test {
namespace {

constexpr int side = 32;

capture::Image even_mask() {
  capture::Image mask = capture::make_image(side, side, 1);
  for (int y = 4; y < side; ++y) {
    for (int x = 0; x < side; ++x) mask.at(y, x) = 1;
  }
  return mask;
}

capture::Image random_picture(std::mt19937& random, double mean, double spread) {
  capture::Image image = capture::make_image(side, side);
  std::normal_distribution<double> value(mean, spread);
  for (float& v : image.pixels) v = static_cast<float>(value(random));
  return image;
}

capture::Image with_noise(std::mt19937& random, const capture::Image& image, double sd) {
  capture::Image noisy = image;
  std::normal_distribution<double> noise(0, sd);
  for (float& v : noisy.pixels) v += static_cast<float>(noise(random));
  return noisy;
}

TEST(PairedError, IsThePicturesErrorWhereNothingIsNoisy) {
  std::mt19937 random(1);
  const capture::Image truth = random_picture(random, 0.5, 0.1);
  const capture::Image x = with_noise(random, truth, 0.03);
  const PairedError paired = paired_error({&x, &x}, {&truth, &truth}, even_mask());
  const PictureError plain = picture_error(x, truth, even_mask());
  EXPECT_NEAR(paired.relative_rms, plain.relative_rms, 1e-9);
  EXPECT_EQ(paired.pixels, plain.pixels);
  EXPECT_EQ(paired.standard_error, 0);
}

// Noise three times as large as the error, in truth and picture: the mean over many trials is the
// error without it, and the trials scatter as each of them says.
TEST(PairedError, IsUnbiasedUnderNoiseAndKnowsItsOwnSpread) {
  std::mt19937 random(2);
  const capture::Image truth = random_picture(random, 0.5, 0.1);
  const capture::Image x = with_noise(random, truth, 0.02);
  const double expected = paired_error({&x, &x}, {&truth, &truth}, even_mask()).square;
  for (const double noise_of_x : {0.0, 0.06}) {
    constexpr int trials = 300;
    double sum = 0, squares = 0, claimed = 0;
    for (int i = 0; i < trials; ++i) {
      const capture::Image a = with_noise(random, truth, 0.06);
      const capture::Image b = with_noise(random, truth, 0.06);
      const capture::Image xa = with_noise(random, x, noise_of_x);
      const capture::Image xb = with_noise(random, x, noise_of_x);
      const PairedError error = paired_error({&xa, &xb}, {&a, &b}, even_mask());
      sum += error.square;
      squares += error.square * error.square;
      claimed += error.square_standard_error / trials;
    }
    const double mean = sum / trials;
    const double spread = std::sqrt(squares / trials - mean * mean);
    EXPECT_NEAR(mean, expected, 4 * spread / std::sqrt(trials)) << noise_of_x;
    EXPECT_NEAR(claimed / spread, 1, 0.2) << noise_of_x;
  }
}

TEST(PairedError, OfNothingButNoiseIsZeroWithinItsStandardError) {
  std::mt19937 random(3);
  const capture::Image truth = random_picture(random, 0.5, 0.1);
  int within = 0;
  for (int i = 0; i < 100; ++i) {
    const capture::Image a = with_noise(random, truth, 0.05);
    const capture::Image b = with_noise(random, truth, 0.05);
    const PairedError error = paired_error({&truth, &truth}, {&a, &b}, even_mask());
    within += std::abs(error.square) < 2 * error.square_standard_error;
    EXPECT_GT(error.standard_error, 0);
  }
  EXPECT_GT(within, 88);
}

TEST(PairedError, ClampsBothAndLooksOnlyAtTheMask) {
  capture::Image truth = capture::make_image(side, side);
  for (float& v : truth.pixels) v = 1;
  capture::Image x = truth;
  x.at(0, 0) = 100;  // outside the mask
  truth.at(10, 10) = 50;
  x.at(10, 10) = 70;
  EXPECT_EQ(paired_error({&x, &x}, {&truth, &truth}, even_mask()).square, 0);
  EXPECT_GT(paired_error({&x, &x}, {&truth, &truth}, even_mask(), 60).square, 0);
}

TEST(PairedError, RefusesPicturesOfTwoSizes) {
  const capture::Image small = capture::make_image(side, side - 1);
  const capture::Image good = capture::make_image(side, side);
  EXPECT_THROW(paired_error({&small, &small}, {&good, &good}, even_mask()), std::invalid_argument);
  EXPECT_THROW(paired_error({&good, &good}, {&good, nullptr}, even_mask()), std::invalid_argument);
}

}  // namespace
}  // namespace render::paired_error_test
