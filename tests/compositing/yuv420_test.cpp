// RGB to Y'CbCr 4:2:0 against the definition in double.
#include "compositing/yuv420.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace compositing::yuv420_test {
namespace {

struct Planes {
  std::vector<std::uint8_t> y;
  std::vector<std::uint8_t> cb;
  std::vector<std::uint8_t> cr;
};

Planes convert(int width, int height, const std::vector<std::uint8_t>& rgb) {
  const auto pixels = static_cast<std::size_t>(width * height);
  Planes planes{std::vector<std::uint8_t>(pixels), std::vector<std::uint8_t>(pixels / 4),
                std::vector<std::uint8_t>(pixels / 4)};
  Yuv420Converter(width, height)
      .convert(rgb,
               {planes.y.data(), planes.cb.data(), planes.cr.data(), width, width / 2, width / 2});
  return planes;
}

TEST(Yuv420Converter, StaysWithinRoundingOfTheDefinition) {
  constexpr int width = 70;
  constexpr int height = 34;
  std::mt19937 random(3);
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(width * height * 3));
  for (std::uint8_t& value : rgb) value = static_cast<std::uint8_t>(random());
  const Planes planes = convert(width, height, rgb);
  const auto value = [&](int y, int x, int c) -> double {
    return rgb[static_cast<std::size_t>((y * width + std::max(x, 0)) * 3 + c)];
  };
  const auto luma = [](double r, double g, double b) { return .2126 * r + .7152 * g + .0722 * b; };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double exact = 16 + luma(value(y, x, 0), value(y, x, 1), value(y, x, 2)) * 219 / 255;
      ASSERT_NEAR(planes.y[static_cast<std::size_t>(y * width + x)], exact, 0.51);
    }
  }
  for (int y = 0; y < height; y += 2) {
    for (int x = 0; x < width; x += 2) {
      double mean[3] = {};
      for (int c = 0; c < 3; ++c) {
        for (int row = y; row < y + 2; ++row) {
          mean[c] += (value(row, x - 1, c) + 2 * value(row, x, c) + value(row, x + 1, c)) / 8;
        }
      }
      const double grey = luma(mean[0], mean[1], mean[2]);
      const auto at = static_cast<std::size_t>(y / 2 * (width / 2) + x / 2);
      ASSERT_NEAR(planes.cb[at], 128 + (mean[2] - grey) / 1.8556 * 224 / 255, 0.51);
      ASSERT_NEAR(planes.cr[at], 128 + (mean[0] - grey) / 1.5748 * 224 / 255, 0.51);
    }
  }
}

TEST(Yuv420Converter, KeepsGreysFreeOfColour) {
  for (int grey = 0; grey < 256; ++grey) {
    const Planes planes =
        convert(2, 2, std::vector<std::uint8_t>(12, static_cast<std::uint8_t>(grey)));
    EXPECT_EQ(planes.cb[0], 128) << grey;
    EXPECT_EQ(planes.cr[0], 128) << grey;
    EXPECT_NEAR(planes.y[0], 16 + grey * 219.0 / 255, 0.51);
  }
}

TEST(Yuv420Converter, RefusesOddSizesAndWrongLengths) {
  EXPECT_THROW(Yuv420Converter(3, 2), std::invalid_argument);
  EXPECT_THROW(Yuv420Converter(2, 3), std::invalid_argument);
  EXPECT_THROW(Yuv420Converter(0, 0), std::invalid_argument);
  EXPECT_THROW(Yuv420Converter(-2, 2), std::invalid_argument);
  EXPECT_THROW(convert(2, 2, std::vector<std::uint8_t>(11)), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::yuv420_test
