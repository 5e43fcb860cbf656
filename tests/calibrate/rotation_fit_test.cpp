// Rotations of made directions.
#include "calibrate/rotation_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/calibrate/made_markers.h"

namespace calibrate::rotation_fit_test {
namespace {

using testing::HasSubstr;

constexpr double sigma_rad = 2e-3;

struct Scene {
  Mat3 cam_from_set;
  std::vector<SeenDirection> directions;
};

Scene random_scene(std::size_t count, double noise_rad, made::Random& random) {
  Scene scene{made::random_pose(random).R, {}};
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 v = random.direction();
    const Vec3 noise = noise_rad * Vec3{random.normal(), random.normal(), random.normal()};
    scene.directions.push_back({normalize(scene.cam_from_set * v + noise), v, sigma_rad});
  }
  return scene;
}

double error_of(const RotationFit& fit, const Scene& scene) {
  return made::error_of({fit.cam_from_set, {}}, {scene.cam_from_set, {}}).turn_rad;
}

TEST(FitRotation, FindsItAndKnowsHowWell) {
  constexpr int cases = 200;
  for (const std::size_t count : {3U, 6U, 40U}) {
    made::Random random(1);
    double squares = 0;
    for (int i = 0; i < cases; ++i) {
      const Scene scene = random_scene(count, sigma_rad, random);
      const RotationFit fit = fit_rotation(scene.directions);
      const double share = error_of(fit, scene) / fit.turn_sigma_rad;
      EXPECT_LT(share, 4.5);
      squares += share * share / cases;
    }
    EXPECT_GT(squares, 0.6);  // 1 if nothing raised the uncertainty
    EXPECT_LT(squares, 1.3);
  }
}

TEST(AddLensError, CountsAnErrorThatDiffersFromSightToSightAsNoise) {
  made::Random random(4);
  const Lens lens = made::fish_eye();
  const Pose pose = made::random_pose(random);
  std::vector<Sight> sights;
  while (sights.size() < 12) {
    const Vec2 q{random.uniform(0, lens.width - 1.0), random.uniform(0, lens.height - 1.0)};
    const auto v = unproject(lens, q);
    if (!v) continue;
    if (const auto sight = sight_of(lens, q, inverse(pose) * (3 * *v))) sights.push_back(*sight);
  }
  const Vec3 position = position_of(pose);
  const RotationFit noisy = fit_rotation(directions_from(sights, position, 2));
  RotationFit fit = fit_rotation(directions_from(sights, position, 0.02));
  add_lens_error(fit, sights, position, {});
  EXPECT_LT(fit.turn_sigma_rad, 0.02 * noisy.turn_sigma_rad);  // unknown: nothing is added
  add_lens_error(fit, sights, position, {2, 1e-3, 1e9});
  EXPECT_NEAR(fit.turn_sigma_rad / noisy.turn_sigma_rad, 1, 0.2);
  // Neighbours that err alike tell less together.
  RotationFit smooth = fit_rotation(directions_from(sights, position, 0.02));
  add_lens_error(smooth, sights, position, {2, 0.5, 1e9});
  EXPECT_GT(smooth.turn_sigma_rad, fit.turn_sigma_rad);
  sights.pop_back();
  EXPECT_THROW(add_lens_error(fit, sights, position, {}), std::invalid_argument);
}

TEST(FitRotation, TellsResidualsFarAboveTheErrorsExpected) {
  made::Random random(5);
  Scene scene = random_scene(4, sigma_rad, random);
  EXPECT_LT(fit_rotation(scene.directions).excess, 3);
  Vec3& v = scene.directions[1].v_cam;
  const Vec3 across = normalize(cross(v, std::abs(v.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  v = normalize(v + std::tan(8 * made::degree) * across);
  EXPECT_GT(fit_rotation(scene.directions).excess, 10);
}

TEST(FitRotation, IsExactForTwoDirectionsWithoutNoise) {
  made::Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Scene scene = random_scene(2, 0, random);
    EXPECT_LT(error_of(fit_rotation(scene.directions), scene), 1e-9);
  }
}

TEST(FitRotation, LeavesOutAThirdThatIsWrong) {
  made::Random random(3);
  for (int i = 0; i < 100; ++i) {
    Scene scene = random_scene(9, sigma_rad, random);
    for (std::size_t k = 0; k < 3; ++k) scene.directions[k].v_cam = random.direction();
    const RotationFit fit = fit_rotation(scene.directions);
    EXPECT_LT(error_of(fit, scene), 5 * fit.turn_sigma_rad);
  }
}

TEST(FitRotation, KnowsThatLargerErrorsMakeItLessSure) {
  made::Random random(4);
  const Scene tight = random_scene(8, sigma_rad, random);
  const Scene loose = random_scene(8, 20 * sigma_rad, random);
  EXPECT_GT(fit_rotation(loose.directions).turn_sigma_rad,
            5 * fit_rotation(tight.directions).turn_sigma_rad);
}

TEST(FitRotation, RefusesWhatLeavesItOpen) {
  made::Random random(5);
  const Scene scene = random_scene(6, sigma_rad, random);
  const auto reason = [](std::span<const SeenDirection> directions) -> std::string {
    try {
      fit_rotation(directions);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(reason(std::span(scene.directions).first(1)), HasSubstr("two directions"));
  std::vector<SeenDirection> axis(3, scene.directions[0]);
  axis[1].v_cam = -axis[1].v_cam;
  axis[1].v_set = -axis[1].v_set;
  EXPECT_THAT(reason(axis), HasSubstr("one axis"));
  std::vector<SeenDirection> unrelated = scene.directions;
  for (SeenDirection& d : unrelated) d.v_cam = random.direction();
  EXPECT_THAT(reason(unrelated), HasSubstr("do not agree"));
}

TEST(FitRotation, RefusesNumbersThatAreNone) {
  made::Random random(6);
  const Scene scene = random_scene(4, sigma_rad, random);
  for (const double bad : {std::nan(""), HUGE_VAL, 0.0}) {
    std::vector<SeenDirection> directions = scene.directions;
    directions[1].sigma_rad = bad;
    EXPECT_THROW(fit_rotation(directions), std::invalid_argument);
    directions = scene.directions;
    directions[2].v_set = {bad, 0, 0};
    EXPECT_THROW(fit_rotation(directions), std::invalid_argument);
  }
}

TEST(DirectionsFrom, KeepsThePixelsThatTheLensGives) {
  made::Random random(7);
  const made::MarkerScene scene = made::random_markers(12, 100 * made::degree, 0.3, random);
  const auto directions = directions_from(scene.sights, position_of(scene.cam_from_set), 0.3);
  const RotationFit fit = fit_rotation(directions);
  EXPECT_LT(made::error_of({fit.cam_from_set, {}}, {scene.cam_from_set.R, {}}).turn_rad,
            4 * fit.turn_sigma_rad);
  EXPECT_LT(fit.turn_sigma_rad, 1e-3);
  EXPECT_THROW(directions_from(scene.sights, scene.sights[0].p_set, 0.3), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::rotation_fit_test
