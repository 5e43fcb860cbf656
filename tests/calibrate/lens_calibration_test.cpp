// Lenses from made boards, against their truth.
#include "calibrate/lens_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrate/angles.h"
#include "calibrate/lens_distance.h"
#include "calibrate/made_boards.h"

namespace calibrate::lens_calibration_test {
namespace {

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double off_family_rad = 0.0008;

struct Case {
  MadeLens truth;
  MadeBoards options;
  double max_deg;
};

// RMS ray error over seeds, in milliradians; and what the noise of the corners foretells.
struct RayErrors {
  double found_mrad = 0;
  double foretold_mrad = 0;
};

// The noise covariance at the pixels of the ray error, turned from pixels to angles.
double foretold_mrad(const MadeLens& truth, const LensCalibration& c, double max_deg) {
  double sum = 0;
  double count = 0;
  for (const MadeRay& ray : even_rays(truth, max_deg)) {
    const Vec2 q = ray.q;
    const auto noise = c.overlay->noise(q);
    const auto here = unproject(c.lens, q);
    const auto right = unproject(c.lens, {q.x + 0.1, q.y});
    const auto below = unproject(c.lens, {q.x, q.y + 0.1});
    if (!noise || !here || !right || !below) continue;
    const Vec3 by_x = (*right - *here) / 0.1;
    const Vec3 by_y = (*below - *here) / 0.1;
    sum +=
        noise->xx * dot(by_x, by_x) + 2 * noise->xy * dot(by_x, by_y) + noise->yy * dot(by_y, by_y);
    ++count;
  }
  return 1000 * std::sqrt(sum / count);
}

RayErrors ray_errors(const Case& c, unsigned seeds) {
  double found = 0;
  double foretold = 0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    MadeBoards options = c.options;
    options.seed = seed;
    const LensCalibration calibration = calibrate_lens(make_board_views(c.truth, options));
    found += std::pow(ray_error_mrad(c.truth, calibration.lens, c.max_deg), 2) / seeds;
    foretold += std::pow(foretold_mrad(c.truth, calibration, c.max_deg), 2) / seeds;
  }
  return {std::sqrt(found), std::sqrt(foretold)};
}

constexpr unsigned few_seeds = PLATELIGHT_FULL_TESTS ? 40 : 4;

TEST(CalibrateLens, FindsAFisheyeToThePrecisionOfItsCorners) {
  const RayErrors errors = ray_errors({made_fisheye(), {}, 89}, few_seeds);
  EXPECT_LE(errors.found_mrad, 0.6);
  EXPECT_LE(errors.found_mrad, 1.15 * errors.foretold_mrad);
}

TEST(CalibrateLens, FindsAFisheyeThatNoModelDescribesExactly) {
  const RayErrors errors = ray_errors({made_fisheye(off_family_rad), {}, 89}, few_seeds);
  EXPECT_LE(errors.found_mrad, 0.6);
  EXPECT_LE(errors.found_mrad, 1.15 * errors.foretold_mrad);
}

TEST(CalibrateLens, FindsAFisheyeThoughCornersAreWrong) {
  MadeBoards options;
  options.outliers = 0.15;
  EXPECT_LE(ray_errors({made_fisheye(), options, 89}, few_seeds).found_mrad, 1);
  EXPECT_LE(ray_errors({made_fisheye(off_family_rad), options, 89}, 2 * few_seeds).found_mrad, 1);
}

TEST(CalibrateLens, FindsAFisheyeThoughTheBoardIsBent) {
  MadeBoards options;
  options.warp_m = {.002, .001};
  EXPECT_LE(ray_errors({made_fisheye(), options, 89}, few_seeds).found_mrad, 1);
  options.warp_m = {.005, 0};
  const LensCalibration bent = calibrate_lens(make_board_views(made_fisheye(), options));
  EXPECT_NEAR(bent.warp_m.x, .005, 2e-4);
  EXPECT_NEAR(bent.warp_m.y, 0, 2e-4);
  EXPECT_THAT(bent.warnings, Contains(HasSubstr("bent")));
  EXPECT_LE(ray_error_mrad(made_fisheye(), bent.lens, 89), 1);
}

TEST(CalibrateLens, FindsANormalLens) {
  EXPECT_LE(ray_errors({made_normal(), normal_boards(), 28}, few_seeds / 2).found_mrad, 0.25);
  MadeBoards bent = normal_boards();
  bent.warp_m = {.002, 0};
  EXPECT_LE(ray_errors({made_normal(), bent, 28}, few_seeds / 2).found_mrad, 0.35);
}

TEST(CalibrateLens, ChoosesWhatFitsIntoACameraModelIfItIsAskedTo) {
  const LensCalibration c =
      calibrate_lens(make_board_views(made_normal(), normal_boards()),
                     {.models = LensCalibrationOptions::Models::perspective, .form = {}});
  EXPECT_THAT(c.lens.model, HasSubstr("LENSMODEL_OPENCV"));
  EXPECT_LE(ray_error_mrad(made_normal(), c.lens, 28), 0.4);
  EXPECT_THAT(c.warnings, Not(Contains(HasSubstr("blind"))));
}

TEST(CalibrateLens, SaysThatAFishEyeFitsIntoNoCameraModel) {
  MadeBoards boards;
  boards.views = 12;
  const LensCalibration c =
      calibrate_lens(make_board_views(made_fisheye(), boards),
                     {.models = LensCalibrationOptions::Models::perspective, .form = {}});
  EXPECT_THAT(c.warnings, ElementsAre(HasSubstr("a fish-eye's pictures")));
  const LensCalibration normal =
      calibrate_lens(make_board_views(made_normal(), normal_boards()),
                     {.models = LensCalibrationOptions::Models::perspective, .form = {}});
  EXPECT_FALSE(normal.of_fisheye);
}

// Each board stands still for some frames, whose corners are off alike by more than by noise.
TEST(CalibrateLens, TakesABoardHeldStillForOnePlace) {
  MadeBoards boards = normal_boards();
  boards.views = 8;
  boards.noise_px = 0;
  constexpr unsigned frames = 6;
  const LensCalibrationOptions options{.models = LensCalibrationOptions::Models::perspective,
                                       .form = {}};
  std::vector<double> shares;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    boards.seed = seed;
    const LensProblem still = make_board_views(made_normal(), boards);
    LensProblem problem = still;
    problem.views.clear();
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (const BoardView& view : still.views) {
      std::array<double, 6> bend{};
      for (double& b : bend) b = 0.3 * normal(random);
      for (unsigned frame = 0; frame < frames; ++frame) {
        BoardView& shot = problem.views.emplace_back(view);
        shot.name += " " + std::to_string(frame);
        for (std::size_t i = 0; i < shot.corners.size(); ++i) {
          if (!shot.corners[i]) continue;
          const double a = static_cast<double>(i % 10) / 4.5 - 1;
          const double b = static_cast<double>(i / 10) / 4.5 - 1;
          shot.corners[i]->x +=
              0.15 * normal(random) + bend[0] * a * a + bend[1] * a * b + bend[2] * b * b;
          shot.corners[i]->y +=
              0.15 * normal(random) + bend[3] * a * a + bend[4] * a * b + bend[5] * b * b;
        }
      }
    }
    const LensCalibration c = calibrate_lens(problem, options);
    EXPECT_EQ(c.places, still.views.size());
    EXPECT_GT(c.twin_factor, 1.5);
    const std::vector<MadeRay> rays = even_rays(made_normal(), 24);
    std::vector<Vec2> pixels;
    for (const MadeRay& ray : rays) pixels.push_back(ray.q);
    shares.push_back(distance_between(c.lens, made_normal().lens, pixels).value().axis_px /
                     c.lens.error_px);
    // As few views, each once, have no twins.
    LensProblem once = problem;
    once.views.clear();
    for (std::size_t i = 0; i < problem.views.size(); i += frames) {
      once.views.push_back(problem.views[i]);
    }
    EXPECT_EQ(calibrate_lens(once, options).twin_factor, 1);
  }
  std::ranges::sort(shares);
  EXPECT_LT(shares[0], 1.8);
  EXPECT_LT(shares[1], 3);
}

TEST(CalibrateLens, SaysWhereAPolynomialTurnsBackWithinThePicture) {
  // 603 pixels from the middle; the picture's corners are 734 away.
  const MadeLens folded{
      {"LENSMODEL_OPENCV4", 1280, 720, {1108.5, 1108.5, 639.5, 359.5, -.5, 0, 0, 0}},
      0,
      30 * degree};
  MadeBoards boards = normal_boards();
  boards.views = 10;
  boards.sees_deg = 25;
  LensCalibrationOptions options;
  options.form = LensForm{"LENSMODEL_OPENCV4", 0, true};
  const LensCalibration c = calibrate_lens(make_board_views(folded, boards), options);
  ASSERT_FALSE(unproject(c.lens, {20, 20}));
  EXPECT_THAT(c.warnings, Contains(HasSubstr("the lens is blind in ")));
}

TEST(CalibrateLens, TakesASplineIfNothingSmallerFollowsAndThereAreCornersEnough) {
  MadeLens odd = made_fisheye();
  odd.bend_rad = 0.004;
  MadeBoards boards;
  boards.views = 20;
  const LensCalibration few = calibrate_lens(make_board_views(odd, boards));
  EXPECT_THAT(few.lens.model, Not(HasSubstr("SPLINED")));
  boards.views = 60;
  const LensCalibration many = calibrate_lens(make_board_views(odd, boards));
  EXPECT_THAT(many.lens.model, HasSubstr("SPLINED"));
  // The best of the others, of the same corners.
  double others_px = HUGE_VAL;
  double others_mrad = HUGE_VAL;
  for (const LensCandidate& c : many.selection.candidates) {
    if (!c.solve || c.form == many.form || c.heldout_rms_px > others_px) continue;
    others_px = c.heldout_rms_px;
    others_mrad = ray_error_mrad(odd, c.solve->lens, 86);
  }
  EXPECT_LT(many.heldout_rms_px, others_px);
  EXPECT_LT(ray_error_mrad(odd, many.lens, 86), 0.75 * others_mrad);
  RecordProperty("spline_mrad", std::to_string(ray_error_mrad(odd, many.lens, 86)));
  RecordProperty("others_mrad", std::to_string(others_mrad));
}

TEST(CalibrateLens, TellsWhatItSawAndWhatItDidNot) {
  MadeBoards options;
  options.sees_deg = 60;
  options.centre_deg = 45;
  const LensCalibration c = calibrate_lens(make_board_views(made_fisheye(), options));
  EXPECT_NEAR(c.coverage_deg, 60, 2);
  EXPECT_THAT(c.warnings, Contains(HasSubstr("degrees off the axis: the rim is a guess")));
  EXPECT_TRUE(c.overlay->at({513, 509}));
  EXPECT_FALSE(c.overlay->at({513 + 331 * 1.4, 509})) << "80 degrees off the axis";
  EXPECT_FALSE(c.overlay->at({-5, 509}));
  EXPECT_FALSE(c.overlay->at({std::nan(""), 509}));
}

LensProblem good_problem() {
  MadeBoards options;
  options.views = 12;
  return make_board_views(made_fisheye(), options);
}

TEST(CalibrateLens, LeavesOutPicturesThatTellSomethingElse) {
  LensProblem problem = good_problem();
  problem.views[3] = problem.views[2];  // the same picture again
  problem.views[3].name = "again";
  BoardView& mirrored = problem.views[5];  // rows the other way round
  for (std::size_t row = 0; row < 10; ++row) {
    std::reverse(mirrored.corners.begin() + static_cast<std::ptrdiff_t>(10 * row),
                 mirrored.corners.begin() + static_cast<std::ptrdiff_t>(10 * row + 10));
  }
  BoardView& moved = problem.views[7];  // half the board somewhere else
  for (std::size_t i = 0; i < 60; ++i) {
    if (moved.corners[i]) moved.corners[i]->x += 15 + static_cast<double>(i * i % 17);
  }
  problem.views[9].corners.assign(100, std::nullopt);
  const LensCalibration c = calibrate_lens(problem);
  EXPECT_THAT(c.views[3].rejected, HasSubstr("where view2 does"));
  EXPECT_THAT(c.views[5].rejected, HasSubstr("mirrored"));
  EXPECT_THAT(c.views[7].rejected, HasSubstr("do not fit"));
  EXPECT_THAT(c.views[9].rejected, HasSubstr("no corner"));
  EXPECT_LE(ray_error_mrad(made_fisheye(), c.lens, 89), 1.5);
  std::size_t used = 0;
  for (const ViewReport& view : c.views) used += view.rejected.empty();
  EXPECT_EQ(used, 8u);
}

TEST(CalibrateLens, LeavesOutCornersThatAreNoNumbers) {
  LensProblem problem = good_problem();
  problem.views[0].corners[4] = Vec2{std::nan(""), 3};
  problem.views[1].corners[7] = Vec2{std::numeric_limits<double>::infinity(), 3};
  problem.views[2].corners[9] = Vec2{1e300, -1e300};
  const LensCalibration c = calibrate_lens(problem);
  EXPECT_THAT(c.warnings, Contains(HasSubstr("3 corners are no numbers")));
  EXPECT_LE(ray_error_mrad(made_fisheye(), c.lens, 89), 1.5);
}

TEST(CalibrateLens, RefusesWhatIsNoPictureOfTheBoard) {
  LensProblem problem = good_problem();
  problem.views[0].corners.pop_back();
  EXPECT_THROW(calibrate_lens(problem), std::invalid_argument);
  problem = good_problem();
  problem.views.clear();
  EXPECT_THROW(calibrate_lens(problem), std::runtime_error);
  problem = good_problem();
  problem.width = 0;
  EXPECT_THROW(calibrate_lens(problem), std::invalid_argument);
  problem = good_problem();
  for (BoardView& view : problem.views) view.corners.assign(100, Vec2{200, 300});
  EXPECT_THROW(calibrate_lens(problem), std::runtime_error);
}

TEST(CalibrateLens, RefusesCornersCountedOnAnotherBoard) {
  // 10 x 10 corners read as rows of 20.
  LensProblem problem = good_problem();
  problem.board.columns = 20;
  problem.board.rows = 5;
  try {
    const LensCalibration c = calibrate_lens(problem);
    EXPECT_THAT(c.warnings, Contains(AnyOf(HasSubstr("do not fit"), HasSubstr("scatter"))));
    ADD_FAILURE() << "found " << name_of(c.form) << " with noise of " << c.sigma_px << " px";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AnyOf(HasSubstr("not corners of this board"),
                                    HasSubstr("no lens model can be fitted")));
  }
}

TEST(CalibrateLens, GivesTheSameLensEveryTime) {
  const LensCalibration a = calibrate_lens(good_problem());
  const LensCalibration b = calibrate_lens(good_problem());
  EXPECT_EQ(a.lens, b.lens);
}

}  // namespace
}  // namespace calibrate::lens_calibration_test
