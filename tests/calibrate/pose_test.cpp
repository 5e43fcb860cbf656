// Laws of rigid transforms, and how a camera is placed.
#include "calibrate/pose.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>

#include "calibrate/angles.h"
#include "calibrate/track.h"

namespace calibrate::pose_test {
namespace {

Vec3 random_vector(std::mt19937& random, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  return {normal(random), normal(random), normal(random)};
}

Pose random_pose(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Quaternion q{normal(random), normal(random), normal(random), normal(random)};
  const double l = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {rotation_of({q.w / l, q.x / l, q.y / l, q.z / l}), random_vector(random, 3)};
}

void expect_near(Vec3 a, Vec3 b, double tolerance) { EXPECT_LE(length(a - b), tolerance); }

TEST(Pose, UndoesItself) {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const Pose b_from_a = random_pose(random);
    const Vec3 p_a = random_vector(random, 10);
    expect_near(inverse(b_from_a) * (b_from_a * p_a), p_a, 1e-12);
  }
}

TEST(Pose, ChainsFromRightToLeft) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const Pose c_from_b = random_pose(random);
    const Pose b_from_a = random_pose(random);
    const Vec3 p_a = random_vector(random, 10);
    expect_near((c_from_b * b_from_a) * p_a, c_from_b * (b_from_a * p_a), 1e-12);
  }
}

TEST(PositionOf, IsThePointThatLiesAtTheCamera) {
  std::mt19937 random(3);
  const Pose cam_from_set = random_pose(random);
  expect_near(cam_from_set * position_of(cam_from_set), {}, 1e-12);
}

TEST(LookAt, PutsThePointLookedAtOnTheAxisAndTheCameraWhereItWasSaid) {
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const Vec3 position = random_vector(random, 5);
    const Vec3 target = random_vector(random, 5);
    const Pose cam_from_set = look_at(position, target, i * 0.1);
    expect_near(cam_from_set * target, {0, 0, length(target - position)}, 1e-12);
    expect_near(position_of(cam_from_set), position, 1e-12);
  }
}

TEST(LookAt, KeepsTheSetsVerticalVerticalInThePictureWithoutRoll) {
  const Pose cam_from_set = look_at({1, 2, 3}, {4, -5, 1}, 0);
  const Vec3 up_cam = cam_from_set.R * Vec3{0, 0, 1};
  EXPECT_NEAR(up_cam.x, 0, 1e-12);
  EXPECT_LT(up_cam.y, 0);
}

TEST(LookAt, RollsTheCameraClockwiseSoThatItsRightSideGoesDown) {
  const Vec3 right_set = look_at({}, {0, 1, 0}, 10 * degree).R.transposed() * Vec3{1, 0, 0};
  expect_near(right_set, {std::cos(10 * degree), 0, -std::sin(10 * degree)}, 1e-12);
}

TEST(LookAt, HasTheSetsYAtTheTopWhenItLooksStraightUpOrDown) {
  for (const double z : {1.0, -1.0}) {
    const Pose cam_from_set = look_at({0, 0, 0}, {0, 0, z}, 0);
    expect_near(cam_from_set.R * Vec3{0, 1, 0}, {0, -1, 0}, 1e-12);
    expect_near(cam_from_set.R * Vec3{0, 0, 1}, {0, 0, z}, 1e-12);
  }
}

TEST(LookAt, AgreesWithThePublishedPoseOfTheStreetCamera) {
  const Pose published = pose_from_rotation(
      {{.569579, -.820312, -.051651, -.261608, -.121356, -.957515, .779192, .558892, -.283722}},
      {-28.940, -19.529, 7.066});
  const Pose placed = look_at({-28.940, -19.529, 7.066}, {-9.54, -5.61, 0}, 3.09 * degree);
  for (const Vec3 p_set : {Vec3{-7.51, 3.83, 0}, Vec3{0, 0, 0}, Vec3{-9, -6, 2}}) {
    expect_near(normalize(placed * p_set), normalize(published * p_set), 1e-3);
  }
}

TEST(LookAt, RefusesAPointThatIsTheCamera) {
  EXPECT_THROW(look_at({1, 2, 3}, {1, 2, 3}, 0), std::invalid_argument);
  EXPECT_THROW(look_at({1, 2, std::numeric_limits<double>::quiet_NaN()}, {}, 0),
               std::invalid_argument);
}

TEST(PoseFromRotation, MakesRoundedRotationsExact) {
  const Pose pose = pose_from_rotation(
      {{.5696, -.8203, -.0517, -.2616, -.1214, -.9575, .7792, .5589, -.2837}}, {1, 2, 3});
  const Mat3 gram = pose.R * pose.R.transposed();
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(gram.m[i], i % 4 == 0 ? 1 : 0, 1e-14);
  expect_near(position_of(pose), {1, 2, 3}, 1e-12);
}

TEST(PoseFromRotation, RefusesMirrorsAndSqueezes) {
  EXPECT_THROW(pose_from_rotation({{-1, 0, 0, 0, 1, 0, 0, 0, 1}}, {}), std::invalid_argument);
  EXPECT_THROW(pose_from_rotation({{1.01, 0, 0, 0, 1, 0, 0, 0, 1}}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::pose_test
