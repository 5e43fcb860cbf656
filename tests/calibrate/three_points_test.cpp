// Poses of made triples.
#include "calibrate/three_points.h"

#include <gtest/gtest.h>

#include "tests/calibrate/made_markers.h"

namespace calibrate::three_points_test {
namespace {

struct Triple {
  Pose cam_from_set;
  std::array<Vec3, 3> v_cam;
  std::array<Vec3, 3> p_set;
};

Triple random_triple(made::Random& random) {
  Triple triple{made::random_pose(random), {}, {}};
  const Pose set_from_cam = inverse(triple.cam_from_set);
  for (std::size_t i = 0; i < 3; ++i) {
    triple.v_cam[i] = random.direction();
    triple.p_set[i] = set_from_cam * (random.uniform(1, 4) * triple.v_cam[i]);
  }
  return triple;
}

TEST(SolveThreePoints, FindsTheTruePoseAmongItsSolutionsAtAnyAngle) {
  made::Random random(1);
  int found = 0;
  std::size_t most = 0;
  constexpr int triples = 5000;
  for (int i = 0; i < triples; ++i) {
    const Triple triple = random_triple(random);
    const ThreePointPoses poses = solve_three_points(triple.v_cam, triple.p_set);
    most = std::max(most, poses.size());
    found += std::ranges::any_of(poses, [&](const Pose& pose) {
      const made::PoseError error = made::error_of(pose, triple.cam_from_set);
      return error.turn_rad < 1e-5 && error.position_m < 1e-5;
    });
  }
  EXPECT_GE(found, triples - 2);  // where the camera lies on the points' cylinder, digits are lost
  EXPECT_EQ(most, 4U);
}

TEST(SolveThreePoints, GivesOnlyPosesThatSeeEveryPoint) {
  made::Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const Triple triple = random_triple(random);
    for (const Pose& pose : solve_three_points(triple.v_cam, triple.p_set)) {
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_LT(length(normalize(pose * triple.p_set[k]) - triple.v_cam[k]), 1e-5);
      }
      EXPECT_NO_THROW(pose_from_rotation(pose.R, {}));
    }
  }
}

TEST(SolveThreePoints, GivesNothingForPointsOnALine) {
  const std::array<Vec3, 3> v{Vec3{0, 0, 1}, normalize(Vec3{0.1, 0, 1}),
                              normalize(Vec3{0.3, 0, 1})};
  EXPECT_EQ(solve_three_points(v, {Vec3{0, 0, 1}, Vec3{0.1, 0, 1}, Vec3{0.3, 0, 1}}).size(), 0U);
  EXPECT_EQ(solve_three_points(v, {Vec3{}, Vec3{}, Vec3{}}).size(), 0U);
}

}  // namespace
}  // namespace calibrate::three_points_test
