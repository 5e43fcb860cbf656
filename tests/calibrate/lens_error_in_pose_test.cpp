// A pose through a calibrated lens knows what the lens is off by.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "calibrate/lens_calibration.h"
#include "calibrate/made_boards.h"
#include "calibrate/registration.h"
#include "calibrate/rotation_fit.h"
#include "tests/calibrate/made_markers.h"

namespace calibrate::lens_error_in_pose_test {
namespace {

constexpr double noise_px = 0.05;  // so small that the lens's error is most of the pose's

struct Trial {
  const char* name;
  MadeLens truth;
  MadeBoards boards;
  std::size_t views;
  std::size_t markers;
  double field_deg;  // off the axis, of the markers
};

// Markers as the true lens shows them, and as the solved one understands them.
std::vector<Sight> misread_markers(const Trial& trial,
                                   const Lens& solved,
                                   const Pose& cam_from_set,
                                   made::Random& random) {
  const Pose set_from_cam = inverse(cam_from_set);
  std::vector<Sight> sights;
  while (sights.size() < trial.markers) {
    const double cosine = random.uniform(std::cos(trial.field_deg * made::degree), 1);
    const double sine = std::sqrt(1 - cosine * cosine);
    const double turn = random.uniform(0, 2 * std::numbers::pi);
    const Vec3 p_cam =
        random.uniform(1, 4) * Vec3{sine * std::cos(turn), sine * std::sin(turn), cosine};
    const Vec2 q = trial.truth.project(p_cam);
    if (q.x < 0 || q.y < 0 || q.x > solved.width - 1 || q.y > solved.height - 1) continue;
    const Vec2 seen{q.x + noise_px * random.normal(), q.y + noise_px * random.normal()};
    if (const auto sight = sight_of(solved, seen, set_from_cam * p_cam)) sights.push_back(*sight);
  }
  return sights;
}

// The truth as the solved lens's axes have it: boards cannot tell a turn of the camera from one of
// all the lens's directions, and neither does the overlay.
Mat3 turn_of(const MadeLens& truth, const Lens& solved, double field_deg) {
  std::vector<Vec3> seen, true_ones;
  for (const MadeRay& ray : even_rays(truth, field_deg)) {
    if (const auto v = unproject(solved, ray.q)) {
      seen.push_back(*v);
      true_ones.push_back(ray.v);
    }
  }
  return best_rotation(true_ones, seen);
}

// Of many poses through many lenses.
struct Outcome {
  std::vector<double> position, turn;  // errors over what was told
  std::vector<double> without;         // position's, had nothing been told of the lens
};

Outcome register_through_lenses(const Trial& trial, unsigned lenses) {
  Outcome outcome;
  for (unsigned seed = 1; seed <= lenses; ++seed) {
    MadeBoards boards = trial.boards;
    boards.views = trial.views;
    boards.seed = seed;
    const Lens solved = calibrate_lens(make_board_views(trial.truth, boards)).lens;
    const Pose turned{turn_of(trial.truth, solved, trial.field_deg), {}};
    made::Random random(seed + 100);
    for (int i = 0; i < 5; ++i) {
      const Pose truth = made::random_pose(random);
      const auto sights = misread_markers(trial, solved, truth, random);
      const Registration found = register_camera(sights, {noise_px, error_of(solved)});
      const Registration unaware = register_camera(sights, {noise_px});
      const made::PoseError error = made::error_of(found.cam_from_set, turned * truth);
      outcome.position.push_back(error.position_m / found.position_sigma_m);
      outcome.turn.push_back(error.turn_rad / found.turn_sigma_rad);
      outcome.without.push_back(error.position_m / unaware.position_sigma_m);
    }
  }
  for (auto* ratios : {&outcome.position, &outcome.turn, &outcome.without}) {
    std::ranges::sort(*ratios);
  }
  return outcome;
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

TEST(RegisterCamera, TellsWhatTheLensIsOffBy) {
  constexpr unsigned lenses = PLATELIGHT_FULL_TESTS ? 20 : 2;
  const std::vector<Trial> trials{
      {"fish-eye", made_fisheye(), {}, 30, 12, 80},
      {"fish-eye of few views", made_fisheye(), {}, 8, 40, 75},
      {"fish-eye outside of the family", made_fisheye(0.001), {}, 8, 40, 75},
      {"normal lens", made_normal(), normal_boards(), 30, 60, 28},
      {"normal lens of few views", made_normal(), normal_boards(), 6, 12, 28},
      {"its middle", made_normal(), normal_boards(), 6, 60, 12},
  };
  for (const Trial& trial : trials) {
    SCOPED_TRACE(trial.name);
    const Outcome outcome = register_through_lenses(trial, lenses);
    EXPECT_LT(quantile(outcome.position, 0.9), 2.5);
    EXPECT_LT(quantile(outcome.turn, 0.9), 2.5);
    // Not by telling just anything.
    EXPECT_GT(quantile(outcome.position, 0.5), 0.2);
    EXPECT_GT(quantile(outcome.without, 0.5), 1.5 * quantile(outcome.position, 0.5));
  }
}

}  // namespace
}  // namespace calibrate::lens_error_in_pose_test
