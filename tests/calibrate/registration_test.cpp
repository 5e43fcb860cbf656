// Made markers seen by made fish-eyes: the pose comes back, and knows how well it is known.
#include "calibrate/registration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "tests/calibrate/made_markers.h"

namespace calibrate::registration_test {
namespace {

using made::degree;
using testing::HasSubstr;

constexpr double noise_px = 0.3;
constexpr int cases = 200;

struct Cell {
  int right = 0;           // within what the covariance allows: 1 in 10000 is beyond
  double chi_square = 0;   // mean; 6 if the covariance is honest
  int rival_is_right = 0;  // of the ambiguous ones that are not right
};

Cell register_many(const std::function<made::MarkerScene(made::Random&)>& make) {
  Cell cell;
  made::Random random(5);
  for (int i = 0; i < cases; ++i) {
    const made::MarkerScene scene = make(random);
    const Registration found = register_camera(scene.sights, {noise_px});
    const double chi_square = made::chi_square(found, scene.cam_from_set);
    constexpr double beyond = 27.9;
    cell.right += chi_square < beyond ? 1 : 0;
    cell.chi_square += std::min(chi_square, 10 * beyond) / cases;
    if (chi_square >= beyond && found.ambiguous) {
      cell.rival_is_right +=
          made::error_of(*found.rival, scene.cam_from_set).turn_rad < 0.2 ? 1 : 0;
    }
  }
  return cell;
}

// Residuals above what is expected raise the covariance, smaller ones do not lower it: of few
// markers, the error's chi-square comes out below its six degrees of freedom.
void expect_honest(const Cell& cell) {
  EXPECT_GT(cell.chi_square, 4.5);
  EXPECT_LT(cell.chi_square, 6.8);
}

TEST(RegisterCamera, FindsThePoseFromMarkersOnAllSides) {
  for (const double angle_deg : {50.0, 80.0, 105.0}) {
    for (const std::size_t count : {4U, 5U, 6U, 12U, 40U}) {
      SCOPED_TRACE(testing::Message() << count << " markers over " << angle_deg << " degrees");
      const Cell cell = register_many([&](made::Random& random) {
        return made::random_markers(count, angle_deg * degree, noise_px, random);
      });
      EXPECT_GE(cell.right, cases - 1);
      expect_honest(cell);
    }
  }
}

TEST(RegisterCamera, FindsThePoseFromMarkersInOnePlaneOrNearlySo) {
  for (const double thickness_m : {0.0, 0.002, 0.05}) {
    for (const double angle_deg : {0.0, 60.0, 100.0}) {
      for (const std::size_t count : {6U, 12U, 40U}) {
        SCOPED_TRACE(testing::Message()
                     << count << " markers, " << angle_deg << " degrees, " << thickness_m << " m");
        const Cell cell = register_many([&](made::Random& random) {
          return made::flat_markers(count, angle_deg * degree, thickness_m, noise_px, random);
        });
        EXPECT_GE(cell.right, cases - 1);
        expect_honest(cell);
      }
    }
  }
}

TEST(RegisterCamera, SaysWhenFourMarkersInAPlaneLeaveTwoPoses) {
  const Cell cell = register_many([&](made::Random& random) {
    return made::flat_markers(4, 60 * degree, 0, noise_px, random);
  });
  EXPECT_GE(cell.right + cell.rival_is_right, cases - 1);
  EXPECT_LT(cell.right, cases);  // or this would test nothing
}

TEST(RegisterCamera, LeavesOutMarkersThatWereMistaken) {
  for (const double angle_deg : {50.0, 80.0, 105.0}) {
    for (const auto& [count, wrong] :
         std::vector<std::pair<std::size_t, std::size_t>>{{6, 1}, {12, 3}, {40, 8}}) {
      SCOPED_TRACE(testing::Message() << wrong << " of " << count << ", " << angle_deg);
      made::Random random(9);
      int right = 0;
      for (int i = 0; i < cases; ++i) {
        made::MarkerScene scene = made::random_markers(count, angle_deg * degree, noise_px, random);
        made::mistake_markers(scene.sights, wrong);
        Registration found;
        try {
          found = register_camera(scene.sights, {noise_px});
        } catch (const std::runtime_error&) {
          continue;  // not right either
        }
        bool good = made::chi_square(found, scene.cam_from_set) < 27.9;
        for (std::size_t k = 0; k < wrong; ++k) {  // unless for a neighbour
          const Vec2 off = residual_of(scene.sights[k], scene.cam_from_set);
          good &= !found.agrees[k] || std::hypot(off.x, off.y) < 10;
        }
        right += good ? 1 : 0;
        EXPECT_FALSE(found.warnings.empty());
      }
      EXPECT_GE(right, cases - 1);
    }
  }
}

TEST(RegisterCamera, TakesCoarseMarkersForCoarseAndNotForWrong) {
  made::Random random(10);
  int right = 0;
  for (int i = 0; i < cases; ++i) {
    const made::MarkerScene scene = made::random_markers(12, 80 * degree, 3, random);
    const Registration found = register_camera(scene.sights, {0.5});
    right += made::chi_square(found, scene.cam_from_set) < 40 ? 1 : 0;
  }
  EXPECT_GE(right, cases - 2);
}

TEST(RegisterCamera, RefusesFiveMarkersOfWhichOneIsWrong) {
  made::Random random(11);
  int refused = 0;
  for (int i = 0; i < cases; ++i) {
    made::MarkerScene scene = made::random_markers(5, 80 * degree, noise_px, random);
    made::mistake_markers(scene.sights, 1);
    try {
      register_camera(scene.sights, {noise_px});
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, cases - 2);
}

TEST(RegisterCamera, RefusesEightMarkersOfWhichThreeAreWrong) {
  made::Random random(12);
  int refused = 0;
  for (int i = 0; i < cases; ++i) {
    made::MarkerScene scene = made::random_markers(8, 80 * degree, noise_px, random);
    made::mistake_markers(scene.sights, 3);
    try {
      register_camera(scene.sights, {noise_px});
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, cases - 10);
}

TEST(RegisterCamera, IsExactWithoutNoise) {
  made::Random random(3);
  for (int i = 0; i < cases; ++i) {
    const made::MarkerScene scene = made::random_markers(8, 105 * degree, 0, random);
    const Registration found = register_camera(scene.sights, {noise_px});
    const made::PoseError error = made::error_of(found.cam_from_set, scene.cam_from_set);
    EXPECT_LT(error.turn_rad, 1e-7);
    EXPECT_LT(error.position_m, 1e-7);
    EXPECT_LT(found.rms_px, 1e-5);
    EXPECT_FALSE(found.ambiguous);
  }
}

TEST(RegisterCamera, TurnsAndMovesWithTheSet) {
  made::Random random(4);
  const made::MarkerScene scene = made::random_markers(12, 80 * degree, noise_px, random);
  const Pose other_from_set = made::random_pose(random);
  std::vector<Sight> turned = scene.sights;
  for (Sight& sight : turned) sight.p_set = other_from_set * sight.p_set;
  const Registration one = register_camera(scene.sights, {noise_px});
  const Registration other = register_camera(turned, {noise_px});
  const made::PoseError error =
      made::error_of(other.cam_from_set * other_from_set, one.cam_from_set);
  EXPECT_LT(error.turn_rad, 1e-6);
  EXPECT_LT(error.position_m, 1e-6);
  EXPECT_NEAR(one.position_sigma_m, other.position_sigma_m, 1e-3 * one.position_sigma_m);
}

TEST(RegisterCamera, TakesDirectionsWithoutALens) {
  made::Random random(6);
  made::MarkerScene scene = made::random_markers(12, 105 * degree, 0, random);
  for (Sight& sight : scene.sights) {
    sight = sight_of(sight.v_cam + 1e-4 * random.direction(), sight.p_set);
  }
  const Registration found = register_camera(scene.sights, {1e-4});
  EXPECT_LT(made::error_of(found.cam_from_set, scene.cam_from_set).turn_rad, 1e-3);
  EXPECT_LT(found.rms_px, 3e-4);  // radians
}

TEST(RegisterCamera, KnowsHowFarAwayItIsUnsure) {
  std::vector<Sight> sights;
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{1, 1, 0.3}}) {
    sights.push_back(sight_of(p + Vec3{0, 0, 300}, p));
  }
  const Registration found = register_camera(sights, {1e-3});
  EXPECT_GT(found.position_sigma_m, 10);
  EXPECT_FALSE(found.warnings.empty());
}

std::string refusal(std::span<const Sight> sights, double noise = noise_px) {
  try {
    register_camera(sights, {noise});
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RegisterCamera, RefusesWhatLeavesThePoseOpen) {
  made::Random random(8);
  const std::vector<Sight> good = made::random_markers(8, 80 * degree, noise_px, random).sights;
  EXPECT_THAT(refusal({}), HasSubstr("four markers"));
  EXPECT_THAT(refusal(std::span(good).first(3)), HasSubstr("add a fourth"));

  std::vector<Sight> at_one = good;
  for (std::size_t i = 3; i < at_one.size(); ++i) at_one[i].p_set = at_one[0].p_set;
  EXPECT_THAT(refusal(at_one), HasSubstr("different places"));

  std::vector<Sight> on_a_line;
  for (const double x : {-1.0, -0.4, 0.3, 0.7, 1.2}) {
    on_a_line.push_back(sight_of(Vec3{x, 0.2, 3}, {x, 0, 0}));
  }
  EXPECT_THAT(refusal(on_a_line), HasSubstr("line"));

  std::vector<Sight> unrelated = good;
  for (Sight& sight : unrelated) sight.p_set = 2 * random.direction();
  EXPECT_THAT(refusal(unrelated), HasSubstr("do not agree"));
}

TEST(RegisterCamera, RefusesNumbersThatAreNone) {
  made::Random random(8);
  const std::vector<Sight> good = made::random_markers(6, 80 * degree, noise_px, random).sights;
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    std::vector<Sight> sights = good;
    sights[2].p_set.y = bad;
    EXPECT_THROW(register_camera(sights), std::invalid_argument);
    sights = good;
    sights[2].v_cam.y = bad;
    EXPECT_THROW(register_camera(sights), std::invalid_argument);
    EXPECT_THROW(register_camera(good, {bad}), std::invalid_argument);
    EXPECT_THROW(sight_of(Vec3{0, bad, 1}, {}), std::invalid_argument);
  }
  EXPECT_THROW(register_camera(good, {0}), std::invalid_argument);
  EXPECT_THROW(sight_of(Vec3{}, {}), std::invalid_argument);
}

TEST(SightOf, TellsPixelsToFirstOrder) {
  const Lens lens = made::fish_eye();
  for (const Vec2 q : {Vec2{640, 640}, Vec2{100, 700}, Vec2{1000, 900}}) {
    const auto sight = sight_of(lens, q, {});
    const auto moved = unproject(lens, {q.x + 0.3, q.y - 0.2});
    ASSERT_TRUE(sight && moved);
    const Vec3 d = *moved - sight->v_cam;
    EXPECT_NEAR(dot(sight->right, d), 0.3, 1e-3);
    EXPECT_NEAR(dot(sight->down, d), -0.2, 1e-3);
    EXPECT_NEAR(dot(sight->right, sight->v_cam), 0, 1e-6);
  }
  EXPECT_FALSE(sight_of(lens, {-500, -500}, {}));
}

}  // namespace
}  // namespace calibrate::registration_test
