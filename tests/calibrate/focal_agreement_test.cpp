// Pictures of one lens agree on its focal length, those of two do not, and few cannot tell.
#include "calibrate/focal_agreement.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrate/lens_calibration.h"
#include "calibrate/made_boards.h"

namespace calibrate::focal_agreement_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* disagreement = "do not agree on one focal length";

MadeLens zoomed(double factor) {
  MadeLens lens = made_normal();
  lens.lens.parameters[0] *= factor;
  lens.lens.parameters[1] *= factor;
  return lens;
}

MadeBoards boards_of(std::size_t views, double noise_px, unsigned seed) {
  MadeBoards boards = normal_boards();
  boards.views = views;
  boards.noise_px = noise_px;
  boards.seed = seed;
  return boards;
}

// Every `period`th picture is taken through a lens of another focal length.
LensProblem mixed(double factor, std::size_t period, const MadeBoards& boards) {
  LensProblem problem = make_board_views(made_normal(), boards);
  const LensProblem other = make_board_views(zoomed(factor), boards);
  for (std::size_t i = 0; i < std::min(problem.views.size(), other.views.size()); i += period) {
    problem.views[i] = other.views[i];
  }
  return problem;
}

// Each square is longer along the rows by this factor than the board is said to be.
LensProblem stretched(double factor, const MadeBoards& boards) {
  LensProblem problem = make_board_views(made_normal(), boards);
  const MadeLens lens = made_normal();
  const LensCalibration truth = calibrate_lens(problem);
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    const auto& pose = truth.views[view].cam_from_board;
    if (!pose) continue;
    for (std::size_t i = 0; i < problem.views[view].corners.size(); ++i) {
      auto& corner = problem.views[view].corners[i];
      if (!corner) continue;
      Vec3 p = corner_of(problem.board, i);
      const Vec2 before = lens.project(*pose * p);
      p.x *= factor;
      const Vec2 after = lens.project(*pose * p);
      corner = Vec2{corner->x + after.x - before.x, corner->y + after.y - before.y};
    }
  }
  return problem;
}

// What the lens's error would be without a word of the pictures' agreement.
double told_by_noise(const LensProblem& problem, const LensCalibration& c) {
  const BelievedSolve chosen{&c.solve(), 1};
  return OverlayError(problem, c.start, {&chosen, 1}, c.sigma_px).rms_px();
}

TEST(FocalAgreement, DoesNotDoubtPicturesOfOneLens) {
  const std::vector<double> noises =
      PLATELIGHT_FULL_TESTS ? std::vector<double>{.05, .1, .3, .5} : std::vector<double>{.05, .4};
  const std::vector<std::size_t> counts = PLATELIGHT_FULL_TESTS
                                              ? std::vector<std::size_t>{3, 4, 6, 10, 20, 50}
                                              : std::vector<std::size_t>{3, 4, 12};
  constexpr unsigned seeds = PLATELIGHT_FULL_TESTS ? 5 : 1;
  for (const std::size_t views : counts) {
    for (const double noise_px : noises) {
      for (unsigned seed = 1; seed <= seeds; ++seed) {
        SCOPED_TRACE(std::to_string(views) + " pictures, " + std::to_string(noise_px) + " px, " +
                     std::to_string(seed));
        MadeBoards boards = boards_of(views, noise_px, seed);
        const LensCalibration normal = calibrate_lens(make_board_views(made_normal(), boards));
        EXPECT_FALSE(normal.focal.disagree()) << normal.focal.chi_squared.value_or(0);
        EXPECT_EQ(normal.focal.error_factor(), 1);
        EXPECT_THAT(normal.warnings, Not(Contains(HasSubstr(disagreement))));
        boards = {};
        boards.views = views;
        boards.noise_px = noise_px;
        boards.seed = seed;
        // No form describes it.
        const LensCalibration fisheye =
            calibrate_lens(make_board_views(made_fisheye(0.0008), boards));
        EXPECT_FALSE(fisheye.focal.disagree()) << fisheye.focal.chi_squared.value_or(0);
      }
    }
  }
}

TEST(FocalAgreement, IsOneWhereNoiseAloneSpreadsTheFactors) {
  double sum = 0;
  constexpr unsigned seeds = PLATELIGHT_FULL_TESTS ? 20 : 2;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const auto problem = make_board_views(made_normal(), boards_of(30, 0.3, seed));
    sum += calibrate_lens(problem).focal.chi_squared.value() / seeds;
  }
  EXPECT_GT(sum, 0.6);
  EXPECT_LT(sum, 1.3);
}

TEST(CalibrateLens, ToldPicturesOfTwoFocalLengthsSaysSoNamesThemAndTellsALargerError) {
  for (const double factor : {1.05, 1.2}) {
    SCOPED_TRACE(factor);
    const LensProblem problem = mixed(factor, 2, boards_of(10, 0.1, 1));
    const LensCalibration c = calibrate_lens(problem);
    EXPECT_TRUE(c.focal.disagree());
    EXPECT_THAT(c.warnings, Contains(AllOf(HasSubstr(disagreement), HasSubstr("view"),
                                           HasSubstr("take them anew with one zoom and focus"))));
    EXPECT_GT(c.focal.error_factor(), 2);
    EXPECT_GT(c.lens.error_px, 2 * told_by_noise(problem, c));
    EXPECT_NEAR(c.lens.error_px, c.overlay->rms_px(), 1e-12);
  }
}

TEST(CalibrateLens, NamesTheOnePictureOfAnotherFocalLength) {
  LensProblem problem = make_board_views(made_normal(), boards_of(12, 0.1, 2));
  problem.views[4] = make_board_views(zoomed(1.015), boards_of(12, 0.1, 2)).views[4];
  const LensCalibration c = calibrate_lens(problem);
  EXPECT_THAT(c.warnings, Contains(AllOf(HasSubstr(disagreement), HasSubstr("view4 (+"))));
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    if (view == 4) continue;
    EXPECT_LT(c.focal.deviation(view), c.focal.deviation(4)) << view;
  }
}

TEST(CalibrateLens, DoubtsABoardThatIsLongerOneWay) {
  const LensCalibration c = calibrate_lens(stretched(1.01, boards_of(12, 0.1, 3)));
  EXPECT_THAT(c.warnings, Contains(HasSubstr(disagreement)));
}

TEST(FocalAgreement, SaysNothingOfTwoPictures) {
  const LensCalibration c = calibrate_lens(mixed(1.2, 2, boards_of(2, 0.1, 1)));
  EXPECT_FALSE(c.focal.chi_squared);
  EXPECT_FALSE(c.focal.disagree());
  EXPECT_EQ(c.focal.error_factor(), 1);
  EXPECT_THAT(c.warnings, Not(Contains(HasSubstr(disagreement))));
}

TEST(FocalAgreement, LeavesOutPicturesThatAreNotInUse) {
  LensProblem problem = make_board_views(made_normal(), boards_of(8, 0.1, 1));
  problem.views[2].corners.assign(problem.board.corner_count(), std::nullopt);
  problem.views[5] = problem.views[4];
  const LensCalibration c = calibrate_lens(problem);
  EXPECT_FALSE(c.focal.views[2]);
  EXPECT_FALSE(c.focal.views[5]);
  EXPECT_EQ(c.focal.deviation(2), 0);
  EXPECT_EQ(c.focal.told, 6u);
}

TEST(FocalAgreement, IsNotFooledByBoardsThatFaceTheCamera) {
  MadeBoards boards = boards_of(15, 0.1, 1);
  boards.fronto = true;
  const LensCalibration c = calibrate_lens(make_board_views(made_normal(), boards));
  EXPECT_FALSE(c.focal.disagree()) << c.focal.chi_squared.value_or(0);
}

}  // namespace
}  // namespace calibrate::focal_agreement_test
