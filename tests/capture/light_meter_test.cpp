// What a frame's values say of its light.
#include "capture/light_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace capture::light_meter_test {
namespace {

// Values 0.1, but for a darker share of the rows at the top.
Image make_picture(int size, int dark_rows) {
  Image image = make_image(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      for (int c = 0; c < 3; ++c) image.at(y, x, c) = y < dark_rows ? 0.001F : 0.1F;
    }
  }
  return image;
}

TEST(LightMeter, FindsOnePixelThatSaturates) {
  LightMeter meter({});
  for (const int size : {1, 7, 200}) {
    Image image = make_picture(size, 0);
    image.at(size / 2, size / 3, 1) = 0.9F;
    FrameLight light = meter.measure(image);
    EXPECT_EQ(light.saturated, 0);
    EXPECT_FLOAT_EQ(static_cast<float>(light.brightest), 0.9F);
    image.at(size / 2, size / 3, 1) = 0.98F;
    light = meter.measure(image);
    EXPECT_NEAR(light.saturated * 3 * size * size, 1, 1e-6);
    EXPECT_FLOAT_EQ(static_cast<float>(light.brightest), 0.1F);
    image.at(size / 2, size / 3, 1) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NEAR(meter.measure(image).saturated * 3 * size * size, 1, 1e-6);
  }
}

TEST(LightMeter, LeavesOutTheDarkestShare) {
  LightMeter meter(LightMeterSettings{.dark_share = 0.05, .counts = {}});
  EXPECT_FLOAT_EQ(static_cast<float>(meter.measure(make_picture(200, 8)).dark), 0.1F);
  EXPECT_FLOAT_EQ(static_cast<float>(meter.measure(make_picture(200, 12)).dark), 0.001F);
  EXPECT_FLOAT_EQ(static_cast<float>(meter.measure(make_picture(3, 0)).dark), 0.1F);
  Image negative = make_picture(20, 20);
  for (float& value : negative.pixels) value = -0.01F;
  EXPECT_FLOAT_EQ(static_cast<float>(meter.measure(negative).dark), -0.01F);
  EXPECT_EQ(meter.measure(negative).brightest, 0);
}

TEST(LightMeter, LooksAtThePixelsThatCountOnly) {
  std::vector<std::uint8_t> counts(std::size_t{50} * 50, 1);
  for (std::size_t i = 0; i < 50 * 10; ++i) counts[i] = 0;
  LightMeter meter({.width = 50, .height = 50, .counts = counts});
  Image image = make_picture(50, 10);
  image.at(3, 3, 0) = 1;
  const FrameLight light = meter.measure(image);
  EXPECT_EQ(light.saturated, 0);
  EXPECT_FLOAT_EQ(static_cast<float>(light.dark), 0.1F);
  EXPECT_GT(meter.measure(make_picture(60, 60)).saturated, -1) << "another size: all count";
  EXPECT_FLOAT_EQ(static_cast<float>(meter.measure(make_picture(60, 60)).dark), 0.001F);
}

TEST(LightMeter, RefusesWhatMakesNoSense) {
  EXPECT_THROW(LightMeter({.dark_share = -0.1, .counts = {}}), std::invalid_argument);
  EXPECT_THROW(LightMeter({.saturation = 0, .counts = {}}), std::invalid_argument);
  EXPECT_THROW(LightMeter({.width = 2, .height = 2, .counts = {1, 1, 1}}), std::invalid_argument);
  EXPECT_THROW(LightMeter({}).measure({}), std::invalid_argument);
}

}  // namespace
}  // namespace capture::light_meter_test
