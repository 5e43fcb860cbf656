// The matrix of Y'CbCr in integers.
#include "capture/ycbcr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

namespace capture::ycbcr_test {
namespace {

struct Case {
  double kr;
  double kb;
  bool full;
  int depth;
  int units;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& [kr, kb] :
       {std::pair{0.299, 0.114}, std::pair{0.2126, 0.0722}, std::pair{0.2627, 0.0593}}) {
    for (const bool full : {false, true}) {
      for (const int depth : {8, 10, 12, 16}) {
        for (const int units : {1, 4, 16, 64}) all.push_back({kr, kb, full, depth, units});
      }
    }
  }
  return all;
}

struct Values {
  double rgb[3];
};

Values convert(const YcbcrMatrix& matrix, std::int32_t y, std::int32_t cb, std::int32_t cr) {
  std::int32_t r = 0;
  std::int32_t g = 0;
  std::int32_t b = 0;
  matrix.convert(1, &y, &cb, &cr, &r, &g, &b);
  const ValueGrid& grid = matrix.grid();
  return {{grid.value(r), grid.value(g), grid.value(b)}};
}

TEST(YcbcrMatrix, IsTheRealMatrixWithinAStepOfItsGrid) {
  std::mt19937 random(11);
  for (const Case& c : cases()) {
    const YcbcrMatrix matrix({c.kr, c.kb, c.full, c.depth, c.units});
    const int codes = 1 << c.depth;
    const double scale = codes / 256.0;
    const double luma_span = c.full ? codes - 1 : 219 * scale;
    const double chroma_span = (c.full ? codes - 1 : 224 * scale) * c.units;
    const double step = 1.0 / (matrix.grid().one - matrix.grid().zero);
    for (int i = 0; i < 500; ++i) {
      const int y = static_cast<int>(random()) & (codes - 1);
      const int cb = static_cast<int>(random() % static_cast<unsigned>((codes - 1) * c.units + 1));
      const int cr = static_cast<int>(random() % static_cast<unsigned>((codes - 1) * c.units + 1));
      const double luma = (y - (c.full ? 0 : 16 * scale)) / luma_span;
      const double pb = (cb - codes / 2.0 * c.units) / chroma_span;
      const double pr = (cr - codes / 2.0 * c.units) / chroma_span;
      const double kg = 1 - c.kr - c.kb;
      const double red = luma + 2 * (1 - c.kr) * pr;
      const double blue = luma + 2 * (1 - c.kb) * pb;
      const double truth[3] = {red, (luma - c.kr * red - c.kb * blue) / kg, blue};
      const Values values = convert(matrix, y, cb, cr);
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(values.rgb[channel], std::min(std::max(truth[channel], -0.5), 1.5), step)
            << "depth " << c.depth << ", units " << c.units;
      }
    }
  }
}

TEST(YcbcrMatrix, GivesBlackWhiteAndGreyWithoutAnyTint) {
  for (const Case& c : cases()) {
    const YcbcrMatrix matrix({c.kr, c.kb, c.full, c.depth, c.units});
    const int deeper = 1 << (c.depth - 8);
    const int black = c.full ? 0 : 16 * deeper;
    const int white = c.full ? 256 * deeper - 1 : 235 * deeper;
    const int middle = 128 * deeper * c.units;
    for (int channel = 0; channel < 3; ++channel) {
      EXPECT_EQ(convert(matrix, black, middle, middle).rgb[channel], 0);
      EXPECT_EQ(convert(matrix, white, middle, middle).rgb[channel], 1);
    }
    for (int y = 0; y < 256 * deeper; y += deeper) {
      const Values grey = convert(matrix, y, middle, middle);
      EXPECT_EQ(grey.rgb[0], grey.rgb[1]);
      EXPECT_EQ(grey.rgb[0], grey.rgb[2]);
    }
  }
}

TEST(YcbcrMatrix, RefusesDepthsThatThereAreNot) {
  EXPECT_THROW(YcbcrMatrix({0.299, 0.114, false, 7, 1}), std::invalid_argument);
  EXPECT_THROW(YcbcrMatrix({0.299, 0.114, false, 17, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace capture::ycbcr_test
