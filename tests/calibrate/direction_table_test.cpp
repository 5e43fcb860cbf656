// The table of directions agrees with the lens.
#include <gtest/gtest.h>

#include "calibrate/angles.h"
#include "calibrate/lens.h"

namespace calibrate::direction_table_test {
namespace {

void expect_table_of(const Lens& lens, int step) {
  SCOPED_TRACE(lens.model);
  const DirectionTable table = make_direction_table(lens);
  EXPECT_EQ(table.width, lens.width);
  EXPECT_EQ(table.height, lens.height);
  ASSERT_EQ(table.x.size(), static_cast<std::size_t>((lens.width + 2) * (lens.height + 2)));
  int seen = 0;
  for (int y = -1; y <= lens.height; y += step) {
    for (int x = -1; x <= lens.width; x += step) {
      const std::size_t i = table.index(y, x);
      const Vec3 v{table.x[i], table.y[i], table.z[i]};
      const auto truth =
          unproject(lens, {static_cast<double>(x), static_cast<double>(y)}).value_or(Vec3{});
      ASSERT_LE(length(v - truth), 2e-7) << x << " " << y;
      seen += length(truth) > 0;
    }
  }
  EXPECT_GT(seen, 0);
}

TEST(MakeDirectionTable, HoldsWhatUnprojectGivesForEveryPixelAndTheBorder) {
  expect_table_of({"pinhole", 320, 180, {300, 301, 159.2, 91.1}}, 1);
  expect_table_of({"equisolid", 301, 200, {66.5, 151, 99.5}, 93 * degree}, 1);
  expect_table_of({"equisolid", 300, 300, {70, 149.5, 149.5}}, 1);
  expect_table_of({"kannala_brandt", 256, 256, {83, 82, 128.3, 127.1, -.02, .003}, 1.6}, 1);
  expect_table_of(
      {"decentred_kannala_brandt", 256, 256, {83, 82, 128.3, 127.1, .002, -.001, -.02}, 1.6}, 1);
  expect_table_of({"kannala_brandt", 640, 360, {600, 600, 320, 180, .1, -.05, .01, .002}}, 1);
}

TEST(MakeDirectionTable, HoldsUpWhereALensTurnsBackInsideThePicture) {
  expect_table_of({"kannala_brandt", 200, 200, {100, 100, 99.5, 99.5, -.2}}, 1);
}

TEST(MakeDirectionTable, HoldsMrcalsDirections) {
  expect_table_of({"LENSMODEL_OPENCV4", 96, 72, {148.1, 149.3, 40.5, 35.3, -.15662, .06178, 0, 0}},
                  3);
}

}  // namespace
}  // namespace calibrate::direction_table_test
