// Vignetting: an even polynomial of the angle, which must not come near 0.
#include "calibrate/vignetting.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace calibrate {
namespace {

TEST(Sensitivity, IsOneOnTheAxisAndEverywhereForAnEvenLens) {
  EXPECT_EQ(sensitivity(std::vector<double>{-0.3, 0.1}, 0), 1);
  EXPECT_EQ(sensitivity({}, 1.2), 1);
}

TEST(Sensitivity, AddsEvenPowersOfTheAngle) {
  EXPECT_DOUBLE_EQ(sensitivity(std::vector<double>{-0.3, 0.1}, 0.5), 1 - 0.3 * 0.25 + 0.1 * 0.0625);
}

TEST(CheckVignetting, RefusesALensThatIsBlindBeforeItsRim) {
  const std::vector<double> falls{-0.5};
  EXPECT_NO_THROW(check_vignetting(falls, 1.3));
  EXPECT_THROW(check_vignetting(falls, 1.5), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate
