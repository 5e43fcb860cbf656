// How far two lenses are from each other.
#include "calibrate/lens_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace calibrate::lens_distance_test {
namespace {

const Lens pinhole{"pinhole", 1280, 720, {1000, 1000, 639.5, 359.5}};

std::vector<Vec2> corners_and_middle() {
  return {{0, 0}, {1279, 0}, {0, 719}, {1279, 719}, {639.5, 359.5}};
}

TEST(DistanceBetween, TellsTheGreatestOfThePixels) {
  Lens longer = pinhole;
  longer.parameters[0] = longer.parameters[1] = 1010;
  const auto distance = distance_between(pinhole, longer, corners_and_middle()).value();
  const double corner_px = std::hypot(639.5, 359.5) * (1 - 1000.0 / 1010);
  EXPECT_NEAR(distance.greatest_px, corner_px, 1e-6);
  EXPECT_NEAR(distance.axis_px, corner_px * std::sqrt(0.5 * 4 / 5), 1e-6);
  EXPECT_NEAR(distance_between(pinhole, pinhole, corners_and_middle()).value().greatest_px, 0,
              1e-9);
}

TEST(DistanceBetween, TakesOutTheTurnThatAPoseTakesBack) {
  Lens aside = pinhole;
  aside.parameters[2] += 3;
  const auto distance = distance_between(pinhole, aside, corners_and_middle()).value();
  EXPECT_LT(distance.greatest_px, 1.5);
  EXPECT_GT(distance.greatest_px, 0.1);
}

}  // namespace
}  // namespace calibrate::lens_distance_test
