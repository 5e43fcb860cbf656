// Conversions between primaries.
#include "capture/primaries.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace capture::primaries_test {
namespace {

constexpr Primaries rec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}};
constexpr Primaries aces_ap1{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};

TEST(Rec709From, IsTheIdentityForItsOwnPrimaries) {
  const auto m = rec709_from(rec709);
  for (std::size_t i = 0; i < m.size(); ++i) EXPECT_NEAR(m[i], i % 4 == 0 ? 1 : 0, 1e-12);
}

TEST(Rec709From, KeepsGreyGreyUnderAnyWhite) {
  for (const Primaries& primaries : {rec2020, aces_ap1}) {
    const auto m = rec709_from(primaries);
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_NEAR(m[3 * row] + m[3 * row + 1] + m[3 * row + 2], 1, 1e-9);
    }
  }
}

TEST(Rec709From, AgreesWithItuReportBt2407) {  // its matrix from BT.2020 to BT.709
  const auto m = rec709_from(rec2020);
  const std::array<double, 9> published{1.6605,  -0.5876, -0.0728, -0.1246, 1.1329,
                                        -0.0083, -0.0182, -0.1006, 1.1187};
  for (std::size_t i = 0; i < m.size(); ++i) EXPECT_NEAR(m[i], published[i], 1e-4);
}

TEST(Rec709From, AgreesWithIec61966ForXyz) {
  const auto m = rec709_from(xyz);
  const std::array<double, 9> published{3.2406, -1.5372, -0.4986, -0.9689, 1.8758,
                                        0.0415, 0.0557,  -0.2040, 1.0570};
  for (std::size_t i = 0; i < m.size(); ++i) EXPECT_NEAR(m[i], published[i], 1e-3);
}

TEST(Rec709From, RefusesPrimariesThatSpanNothing) {
  EXPECT_THROW(rec709_from({{.1, .1}, {.2, .2}, {.3, .3}, {.33, .33}}), std::invalid_argument);
  EXPECT_THROW(rec709_from({{.64, .33}, {.3, .6}, {.15, .06}, {.3, 0}}), std::invalid_argument);
}

TEST(ConvertToRec709, LeavesAlphaAlone) {
  Image image{1, 1, {0.5F, 0.25F, 0.125F, 0.75F}, 4};
  convert_to_rec709(image, rec2020);
  EXPECT_NE(image.at(0, 0, 0), 0.5F);
  EXPECT_EQ(image.at(0, 0, 3), 0.75F);
}

}  // namespace
}  // namespace capture::primaries_test
