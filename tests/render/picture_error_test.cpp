// The error of a picture against another.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "render/reference.h"

namespace render::picture_error_test {
namespace {

capture::Image grey(float value, int width = 10, int height = 10) {
  capture::Image image = capture::make_image(height, width);
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

const capture::Image everywhere = [] {
  capture::Image mask = capture::make_image(10, 10, 1);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 1.0F);
  return mask;
}();

TEST(PictureError, IsNoneBetweenEqualPictures) {
  const PictureError error = picture_error(grey(0.3F), grey(0.3F), everywhere);
  EXPECT_EQ(error.relative_rms, 0);
  EXPECT_EQ(error.p99, 0);
  EXPECT_EQ(error.delta_e_p99, 0);
  EXPECT_EQ(error.pixels, 100U);
}

TEST(PictureError, IsTheRelativeDifferenceOfEvenPictures) {
  const PictureError error = picture_error(grey(0.42F), grey(0.4F), everywhere);
  EXPECT_NEAR(error.relative_rms, 0.05, 1e-6);
  EXPECT_NEAR(error.p99, 0.05, 1e-6);
  // Greys differ in OK Lab by their cube roots.
  EXPECT_NEAR(error.delta_e_mean, 100 * (std::cbrt(0.42) - std::cbrt(0.4)), 1e-2);
}

TEST(PictureError, CountsOnlyMaskedPixelsAndClampsBothPictures) {
  capture::Image x = grey(1), r = grey(1), mask = capture::make_image(10, 10, 1);
  x.at(0, 0, 0) = 1000;
  r.at(0, 0, 0) = 400;
  EXPECT_EQ(picture_error(x, r, mask).pixels, 0U);
  mask.at(0, 0) = 1;
  mask.at(5, 5) = 0.5F;
  const PictureError error = picture_error(x, r, mask);
  EXPECT_EQ(error.pixels, 2U);
  EXPECT_EQ(error.relative_rms, 0) << "both are beyond the clamp";
  x.at(5, 5, 1) = 1.5F;
  EXPECT_NEAR(picture_error(x, r, mask).relative_rms, 0.5 / std::sqrt(16.0 + 5), 1e-6);
}

TEST(PictureError, SeesPureColoursAsOkLabDoes) {
  capture::Image red = grey(0), green = grey(0);
  for (std::size_t i = 0; i < red.pixels.size(); i += 3) red.pixels[i] = green.pixels[i + 1] = 1;
  // OK Lab of sRGB red (.628, .225, .126) and green (.866, -.234, .179).
  const double expected = 100 * std::hypot(0.62796 - 0.86644, 0.22486 + 0.23389, 0.12585 - 0.17950);
  EXPECT_NEAR(picture_error(red, green, everywhere).delta_e_mean, expected, 0.02);
}

TEST(PictureError, IsNeverSmallForNotANumber) {
  capture::Image x = grey(1);
  x.at(3, 3, 0) = NAN;
  EXPECT_FALSE(picture_error(x, grey(1), everywhere).relative_rms < 1);
}

capture::Image with_deviations(float value, float deviation, unsigned seed) {
  capture::Image image = grey(value, 60, 60);
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, deviation);
  for (float& v : image.pixels) v += noise(random);
  return image;
}

TEST(PictureError, LeavesTheNoiseOfTwoReferencesOut) {
  const std::array<capture::Image, 2> references{with_deviations(1, 0.1F, 1),
                                                 with_deviations(1, 0.1F, 2)};
  capture::Image mask = capture::make_image(60, 60, 1);
  std::ranges::fill(mask.pixels, 1.0F);
  // Their mean has .1 / sqrt(2) of noise, which would hide an error of 5 %.
  const PictureError error = picture_error(grey(1.05F, 60, 60), references, mask);
  EXPECT_NEAR(error.relative_rms, 0.05, 0.005);
  EXPECT_NEAR(error.reference_noise, 0.1 / std::sqrt(2), 0.004);
  EXPECT_GT(picture_error(grey(1.05F, 60, 60), references[0], mask).relative_rms, 0.1);
  EXPECT_LT(picture_error(grey(1, 60, 60), references, mask).relative_rms, 0.03);
}

TEST(PictureError, AgainstTheSameReferenceTwiceIsThatAgainstOne) {
  const capture::Image x = with_deviations(1, 0.2F, 3), r = with_deviations(0.9F, 0.1F, 4);
  capture::Image mask = capture::make_image(60, 60, 1);
  std::ranges::fill(mask.pixels, 1.0F);
  const PictureError one = picture_error(x, r, mask);
  const PictureError two = picture_error(x, std::array{r, r}, mask);
  EXPECT_EQ(one.relative_rms, two.relative_rms);
  EXPECT_EQ(one.p99, two.p99);
  EXPECT_EQ(one.delta_e_p95, two.delta_e_p95);
  EXPECT_EQ(two.reference_noise, 0);
}

TEST(AffectedMask, IsWhereTheReferenceIsCoveredOrDiffersByMoreThanAThousandth) {
  const capture::Image plate = grey(0.5F, 4, 1);
  capture::Image reference = capture::make_image(1, 4, 4);
  for (int x = 0; x < 4; ++x) {
    for (int c = 0; c < 3; ++c) reference.at(0, x, c) = 0.5F;
  }
  reference.at(0, 1, 3) = 0.01F;
  reference.at(0, 2, 1) = 0.5F * 0.998F;
  reference.at(0, 3, 1) = 0.5F * 0.9995F;
  const capture::Image mask = affected_mask(reference, plate);
  EXPECT_EQ(mask.pixels, (std::vector<float>{0, 1, 1, 0}));
}

TEST(AffectedMask, RefusesAPlateOfAnotherSize) {
  EXPECT_THROW(affected_mask(capture::make_image(4, 4, 4), grey(1, 5, 4)), std::invalid_argument);
}

TEST(PictureError, RefusesPicturesOfTwoSizes) {
  EXPECT_THROW(picture_error(grey(1, 9), grey(1), everywhere), std::invalid_argument);
}

}  // namespace
}  // namespace render::picture_error_test
