// Vignetting: an even polynomial of the angle, which must not come near 0.
#include "calibrate/vignetting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

namespace calibrate::vignetting_test {
namespace {

TEST(Sensitivity, IsOneOnTheAxisAndEverywhereForAnEvenLens) {
  EXPECT_EQ(sensitivity(std::vector<double>{-0.3, 0.1}, 0), 1);
  EXPECT_EQ(sensitivity({}, 1.2), 1);
}

TEST(Sensitivity, AddsEvenPowersOfTheAngle) {
  EXPECT_DOUBLE_EQ(sensitivity(std::vector<double>{-0.3, 0.1}, 0.5), 1 - 0.3 * 0.25 + 0.1 * 0.0625);
}

TEST(AddVignetting, TellsTheSensitivityOfEveryPixel) {
  DirectionTable table = make_direction_table({"pinhole", 9, 5, {4, 4, 4, 2}});
  const std::vector<double> terms{-0.3, 0.1};
  add_vignetting(terms, table);
  EXPECT_EQ(table.sensitivity[table.index(2, 4)], 1);
  const double angle_rad = std::atan(0.5);  // two pixels off the axis
  for (const std::size_t i : {table.index(0, 4), table.index(2, 2), table.index(2, 6)}) {
    EXPECT_FLOAT_EQ(table.sensitivity[i], static_cast<float>(sensitivity(terms, angle_rad)));
  }
  add_vignetting({}, table);
  EXPECT_TRUE(table.sensitivity.empty());
}

TEST(CheckVignetting, RefusesALensThatIsBlindBeforeItsRim) {
  const std::vector<double> falls{-0.5};
  EXPECT_NO_THROW(check_vignetting(falls, 1.3));
  EXPECT_THROW(check_vignetting(falls, 1.5), std::invalid_argument);
}

TEST(CheckVignetting, GoesToTheCornersOfThePictureOrToTheRim) {
  const std::vector<double> falls{-0.5};
  Lens lens{"equisolid", 101, 101, {100, 50, 50}};  // its corners are 0.72 rad off the axis
  EXPECT_NO_THROW(check_vignetting(falls, lens));
  lens.parameters[0] = 40;  // 2.17 rad
  EXPECT_THROW(check_vignetting(falls, lens), std::invalid_argument);
  lens.max_angle_rad = 1.3;
  EXPECT_NO_THROW(check_vignetting(falls, lens));
}

}  // namespace
}  // namespace calibrate::vignetting_test
