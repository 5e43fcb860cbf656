// Laws of small vectors.
#include "calibrate/vec.h"

#include <gtest/gtest.h>

namespace calibrate::vec_test {
namespace {

TEST(Cross, IsRightHanded) { EXPECT_EQ(cross(Vec3{1, 0, 0}, Vec3{0, 1, 0}), (Vec3{0, 0, 1})); }

}  // namespace
}  // namespace calibrate::vec_test
