// Grey pictures.
#include "calibrate/grey_picture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace calibrate::grey_picture_test {
namespace {

// x + 2 y, which every interpolation must keep.
GreyPicture ramp(int width, int height) {
  GreyPicture picture{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      picture.pixels.push_back(static_cast<std::uint8_t>(x + 2 * y));
    }
  }
  return picture;
}

TEST(ValueAt, KeepsARamp) {
  const GreyPicture picture = ramp(30, 20);
  EXPECT_NEAR(value_at(picture, {10.25, 7.5}), 10.25 + 15, 1e-4);
  EXPECT_EQ(value_at(picture, {29, 19}), 29 + 38);
  EXPECT_EQ(value_at(picture, {-5, 3}), 6);
}

TEST(Resized, MapsEdgesToEdges) {
  const GreyPicture half = resized(ramp(40, 20), 20, 10);
  // Pixel 3 of the half covers 6 and 7.
  EXPECT_NEAR(half.at(4, 3), 6.5 + 2 * 8.5, .51);
  const GreyPicture odd = resized(ramp(40, 20), 30, 15);
  EXPECT_NEAR(odd.at(7, 12), (12.5 * 4 / 3 - .5) + 2 * (7.5 * 4 / 3 - .5), .51);
}

TEST(Stretched, TakesNoNoticeOfALamp) {
  GreyPicture picture = ramp(30, 20);
  picture.at(0, 0) = 255;
  const GreyPicture wide = stretched(picture);
  EXPECT_EQ(wide.at(0, 1), 0);
  EXPECT_EQ(wide.at(19, 29), 255);
  const GreyPicture even{2, 2, {7, 7, 7, 7}};
  EXPECT_EQ(stretched(even).pixels, (std::vector<std::uint8_t>{0, 0, 0, 0}));
}

TEST(GreyPictureOf, IsTheSameForAnyExposure) {
  capture::Image image = capture::make_image(10, 10, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = 0.01F * static_cast<float>(i % 97);
  capture::Image bright = image;
  for (float& value : bright.pixels) value *= 64;
  EXPECT_EQ(grey_picture(image).pixels, grey_picture(bright).pixels);
  image.at(2, 3, 1) = NAN;
  EXPECT_EQ(grey_picture(image).at(2, 3), 0);
  EXPECT_THROW(grey_picture({}), std::invalid_argument);
}

TEST(CheckGreyPicture, RefusesSizesThatDoNotMatch) {
  EXPECT_THROW(check(GreyPicture{2, 2, {1, 2, 3}}), std::invalid_argument);
  EXPECT_THROW(check(GreyPicture{}), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::grey_picture_test
