// The error of a picture against another.
#include <gtest/gtest.h>

#include <cmath>

#include "render/reference.h"

namespace render {
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

TEST(PictureError, RefusesPicturesOfTwoSizes) {
  EXPECT_THROW(picture_error(grey(1, 9), grey(1), everywhere), std::invalid_argument);
}

}  // namespace
}  // namespace render
