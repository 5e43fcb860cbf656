// The chart of lens calibration: what it must show whatever the machine.
#include "studio/charts/lens.h"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrate/lens_calibration.h"
#include "calibrate/made_boards.h"
#include "studio/charts/lens_peers.h"
#include "tests/studio/quick_chart.h"

namespace studio::lens_chart_test {
namespace {

using calibrate::calibrate_lens;
using calibrate::LensProblem;
using calibrate::made_fisheye;
using calibrate::made_normal;
using calibrate::MadeBoards;
using calibrate::ray_error_mrad;

// Of a peer's lens; infinite if it has none.
double error_of(LensPeer peer,
                const calibrate::MadeLens& truth,
                const LensProblem& problem,
                double max_deg) {
  const LensPeerResult result = calibrate_with(peer, problem);
  return result.status == "ok" ? ray_error_mrad(truth, result.unproject, max_deg) : HUGE_VAL;
}

TEST(LensPeers, AreNoMoreAccurateThanOursOnAFisheye) {
  const auto truth = made_fisheye(0.0008);
  for (const unsigned seed : {1U, 2U}) {
    MadeBoards boards;
    boards.seed = seed;
    boards.views = 20;
    const LensProblem problem = make_board_views(truth, boards);
    const double ours = ray_error_mrad(truth, calibrate_lens(problem).lens, 89);
    EXPECT_LT(ours, error_of(LensPeer::opencv_fisheye, truth, problem, 89)) << seed;
    EXPECT_LT(ours, error_of(LensPeer::mrcal_splined, truth, problem, 89)) << seed;
  }
}

// cv::fisheye starts each board from a plane that its corners at 90 degrees do not meet.
TEST(LensPeers, ThrowWhereOursAnswers) {
  const auto truth = made_fisheye(0.0008);
  bool thrown = false;
  for (unsigned seed = 1; !thrown && seed <= 6; ++seed) {
    MadeBoards boards;
    boards.seed = seed;
    const LensProblem problem = make_board_views(truth, boards);
    if (calibrate_with(LensPeer::opencv_fisheye, problem).status == "ok") continue;
    thrown = true;
    EXPECT_LE(ray_error_mrad(truth, calibrate_lens(problem).lens, 89), 1) << seed;
  }
  EXPECT_TRUE(thrown);
}

TEST(LensPeers, AreNotBetterOnANormalLensAndTenTimesWorseIfTheBoardIsBent) {
  const auto truth = made_normal();
  double ours = 0;
  double theirs = 0;
  double ours_bent = 0;
  double theirs_bent = 0;
  for (const unsigned seed : {1U, 2U, 3U}) {
    MadeBoards boards = calibrate::normal_boards();
    boards.seed = seed;
    const auto add = [&](double& our_sum, double& their_sum) {
      const LensProblem problem = make_board_views(truth, boards);
      const auto c = calibrate_lens(
          problem, {.models = calibrate::LensCalibrationOptions::Models::perspective, .form = {}});
      our_sum += std::pow(ray_error_mrad(truth, c.lens, 28), 2);
      their_sum += std::pow(error_of(LensPeer::opencv_camera5, truth, problem, 28), 2);
    };
    add(ours, theirs);
    boards.warp_m = {.002, 0};
    add(ours_bent, theirs_bent);
  }
  // Of the same corners, both are as good as their noise lets them; ours has fewer parameters.
  EXPECT_LE(std::sqrt(ours), 1.05 * std::sqrt(theirs));
  EXPECT_LE(std::sqrt(ours_bent), 0.1 * std::sqrt(theirs_bent));
}

TEST(LensPeers, SayWhatIsWrongInsteadOfEndingTheProgram) {
  LensProblem problem = make_board_views(made_normal(), calibrate::normal_boards());
  for (auto& view : problem.views) view.corners.assign(100, std::nullopt);
  for (const LensPeer peer : {LensPeer::opencv_camera5, LensPeer::opencv_fisheye,
                              LensPeer::opencv_omnidir, LensPeer::mrcal_opencv5}) {
    const LensPeerResult result = calibrate_with(peer, problem);
    EXPECT_NE(result.status, "ok") << name_of(peer);
    if (peer != LensPeer::mrcal_opencv5) {
      EXPECT_THAT(result.status, testing::HasSubstr("(-2")) << "in OpenCV's own words";
    }
    EXPECT_FALSE(result.unproject) << name_of(peer);
  }
}

TEST(LensChart, ShowsWhatIsAskedOfIt) {
  const Chart chart = measure_quickly(lens_chart());
  std::size_t peers = 0;
  for (const ChartPoint& p : chart.points) {
    EXPECT_GT(p.time_ms, 0);
    EXPECT_GT(p.error, 0);
    EXPECT_FALSE(p.error_p99);
    EXPECT_EQ(std::ranges::count(p.figures, "largest_error", [](const auto& f) { return f.first; }),
              1);
    peers += p.peer;
  }
  EXPECT_GE(peers, 1u);
  EXPECT_EQ(std::ranges::count(chart.points, true, &ChartPoint::by_default), 2);
  EXPECT_EQ(chart.stressors.size(), 7u);
  int past_the_edge = 0;
  for (const Stressor& stressor : chart.stressors) {
    // Where the error is several pixels, it was foretold, or the status says that something is
    // wrong.
    for (const StressorSample& s : stressor.samples) {
      const bool told = s.status != "ok" || s.reported_error.value_or(0) > s.error / 2;
      EXPECT_TRUE(s.error < 2 || told) << stressor.stressor << " " << s.value;
    }
    // A chart that is never confident is none.
    const auto is_good = [](const StressorSample& s) {
      return s.status == "ok" && s.error < 2 && s.reported_error.value_or(HUGE_VAL) < 5;
    };
    const auto good = std::ranges::count_if(stressor.samples, is_good);
    EXPECT_GE(good, 1) << stressor.stressor;
    past_the_edge += good < std::ssize(stressor.samples);
  }
  EXPECT_GE(past_the_edge, 6) << "boards need no tilt where they are off the axis";
}

}  // namespace
}  // namespace studio::lens_chart_test
