// Lens calibration to the edge: how honest its error is, and what it says when it cannot know.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrate/angles.h"
#include "calibrate/lens_calibration.h"
#include "calibrate/made_boards.h"
#include "calibrate/rotation_fit.h"

namespace calibrate::lens_stability_test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// True and predicted error over the covered pixels of one calibration.
struct Honesty {
  std::vector<double> ratio;    // predicted over true
  std::size_t covered = 0;      // of them, predicted at least as large as true
  std::size_t called_good = 0;  // known though no corner was seen at such angles
};

Honesty honesty_of(const MadeLens& truth, const LensCalibration& c) {
  double seen_rad = 0;
  for (std::size_t i = 0; i < c.start.corners.size(); ++i) {
    const auto v = truth.unproject(c.start.corners[i].q);
    if (c.solve().used[i] != 0 && v) {
      seen_rad = std::max(seen_rad, std::atan2(hypotenuse(v->x, v->y), v->z));
    }
  }
  Honesty honesty;
  std::vector<Vec2> pixels;
  std::vector<Vec3> expected, found;
  std::vector<double> predicted;
  for (int y = 8; y < truth.lens.height; y += 16) {
    for (int x = 8; x < truth.lens.width; x += 16) {
      const Vec2 q{static_cast<double>(x), static_cast<double>(y)};
      const auto error = c.overlay->at(q);
      if (!error) continue;
      const auto v = truth.unproject(q);
      const auto w = unproject(c.lens, q);
      // Two degrees for the corner's own noise and the pixel grid.
      const bool seen = v && w && std::atan2(hypotenuse(v->x, v->y), v->z) < seen_rad + 2 * degree;
      if (!seen) {
        ++honesty.called_good;
        continue;
      }
      pixels.push_back(q);
      expected.push_back(*v);
      found.push_back(*w);
      predicted.push_back(*error);
    }
  }
  const Mat3 turn = best_rotation(expected, found);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto there = project(c.lens, turn * expected[i]);
    const double error =
        there ? hypotenuse(there->x - pixels[i].x, there->y - pixels[i].y) : HUGE_VAL;
    honesty.ratio.push_back(predicted[i] / std::max(error, 1e-9));
    honesty.covered += error <= predicted[i];
  }
  return honesty;
}

struct Group {
  const char* name;
  void (*change)(MadeBoards&, unsigned);
  bool quick = false;  // always tested; the others only with PLATELIGHT_FULL_TESTS
};
constexpr std::array groups{
    Group{"good", [](MadeBoards&, unsigned) {}},
    Group{"sparse", [](MadeBoards& o, unsigned) { o.views = 8; }, true},
    Group{"narrow", [](MadeBoards& o, unsigned) { o.centre_deg *= 0.3; }},
    Group{"fronto-parallel",
          [](MadeBoards& o, unsigned) {
            o.fronto = true;
            o.centre_deg *= 0.6;
          }},
    Group{"few", [](MadeBoards& o, unsigned i) { o.views = 2 + i % 3; }, true},
};

// 95 of 100 predictions hold. Few runs only tell the gross lie: errors of one calibration stand and
// fall together.
TEST(PredictedOverlayError, CoversTheTrueOneAndIsUnknownWhereNothingWasSeen) {
  constexpr unsigned runs = PLATELIGHT_FULL_TESTS ? 40 : 3;
  constexpr double in_each_group = PLATELIGHT_FULL_TESTS ? 0.90 : 0.5;
  constexpr double overall = PLATELIGHT_FULL_TESTS ? 0.93 : 0.8;
  double all = 0;
  double all_covered = 0;
  std::vector<double> all_ratios;
  for (const Group& group : groups) {
    if (!group.quick && !PLATELIGHT_FULL_TESTS) continue;
    double pixels = 0;
    double covered = 0;
    for (unsigned i = 0; i < runs; ++i) {
      const bool normal = i % 3 == 2;
      const MadeLens truth = normal ? made_normal() : made_fisheye(i % 3 == 1 ? 0.0008 : 0);
      MadeBoards options = normal ? normal_boards() : MadeBoards{};
      options.seed = 7000 + 100 * static_cast<unsigned>(&group - groups.data()) + i;
      group.change(options, i);
      const Honesty honesty = honesty_of(truth, calibrate_lens(make_board_views(truth, options)));
      EXPECT_EQ(honesty.called_good, 0u) << group.name << ", seed " << options.seed;
      pixels += static_cast<double>(honesty.ratio.size());
      covered += static_cast<double>(honesty.covered);
      all_ratios.insert(all_ratios.end(), honesty.ratio.begin(), honesty.ratio.end());
    }
    EXPECT_GE(covered / pixels, in_each_group) << group.name;
    RecordProperty(std::string("covered_") + group.name, std::to_string(covered / pixels));
    all += pixels;
    all_covered += covered;
  }
  EXPECT_GE(all_covered / all, overall);
  std::ranges::sort(all_ratios);
  const double median = all_ratios[all_ratios.size() / 2];
  RecordProperty("covered", std::to_string(all_covered / all));
  RecordProperty("median_predicted_over_true", std::to_string(median));
  // The far end of the ellipse is 2.08 times the median of an error that is alike in all
  // directions, and 3.6 times of one that has one direction only; calibration.md.
  if (PLATELIGHT_FULL_TESTS) {
    EXPECT_GE(median, 1);
    EXPECT_LE(median, 4.5);
  }
}

// Terms that move held-out corners by three standard deviations are found, those that do not are
// not needed.
TEST(SelectLens, TakesTheTrueNumberOfTerms) {
  constexpr unsigned runs = PLATELIGHT_FULL_TESTS ? 25 : 2;
  std::size_t right = 0;
  std::size_t cases = 0;
  for (std::size_t terms = 0; terms <= 3; ++terms) {
    for (unsigned i = 0; i < runs; ++i) {
      std::vector<double> parameters{331, 331, 513.3, 509.1};
      // Each moves the rim by 60, 25 and 12 pixels.
      constexpr std::array sizes{-0.047, 0.0079, -0.0015};
      parameters.insert(parameters.end(), sizes.begin(),
                        sizes.begin() + static_cast<std::ptrdiff_t>(terms));
      const MadeLens truth{{"kannala_brandt", 1024, 1024, parameters}, 0, 90 * degree};
      MadeBoards options;
      options.seed = 300 + 100 * static_cast<unsigned>(terms) + i;
      options.views = 15;
      const LensCalibration c = calibrate_lens(make_board_views(truth, options));
      ++cases;
      right += c.form == LensForm{"kannala_brandt", terms, true};
      const double best = c.selection.candidates[c.selection.best].heldout_rms_px;
      EXPECT_LE(c.heldout_rms_px, 1.05 * best);
    }
  }
  EXPECT_GE(right, cases - (PLATELIGHT_FULL_TESTS ? 5 : 1)) << "of " << cases;
}

LensCalibration calibrated(void (*change)(MadeBoards&), const MadeLens& truth = made_fisheye()) {
  MadeBoards options;
  options.views = 15;
  change(options);
  return calibrate_lens(make_board_views(truth, options));
}

// What half of the known picture is predicted to be off by at most; nothing if nothing is known.
std::optional<double> usual_error_px(const LensCalibration& c) {
  std::vector<double> errors;
  for (int y = 10; y < c.lens.height; y += 20) {
    for (int x = 10; x < c.lens.width; x += 20) {
      const auto error = c.overlay->at({static_cast<double>(x), static_cast<double>(y)});
      if (error) errors.push_back(*error);
    }
  }
  if (errors.empty()) return std::nullopt;
  std::ranges::sort(errors);
  return errors[errors.size() / 2];
}

TEST(CalibrateLensAtItsLimits, SaysThatBoardsFacingTheCameraDoNotTellTheFocalLength) {
  const LensCalibration c = calibrated([](MadeBoards& o) {
    o.fronto = true;
    o.centre_deg = 40;
  });
  EXPECT_THAT(c.warnings, Contains(HasSubstr("face the same way")));
  EXPECT_GT(usual_error_px(c).value(), 3);
}

TEST(CalibrateLensAtItsLimits, KnowsNothingOfTheRimIfBoardsWereOnlyInTheCentre) {
  const LensCalibration c = calibrated([](MadeBoards& o) {
    o.centre_deg = 5;
    o.least_m = 0.8;
    o.most_m = 1.2;
  });
  EXPECT_THAT(c.warnings, Contains(HasSubstr("the rim is a guess")));
  EXPECT_THAT(c.warnings, Contains(HasSubstr("of the picture: the lens is a guess there")));
  EXPECT_FALSE(c.overlay->at({950, 509}));
}

TEST(CalibrateLensAtItsLimits, SaysThatFewPicturesAreFew) {
  for (const std::size_t views : {1U, 2U, 3U}) {
    MadeBoards options;
    options.views = views;
    options.centre_deg = 40;
    const MadeLens truth = made_fisheye();
    try {
      const LensCalibration c = calibrate_lens(make_board_views(truth, options));
      EXPECT_THAT(c.warnings, Contains(HasSubstr("pictures could be used"))) << views;
      const Honesty honesty = honesty_of(truth, c);
      EXPECT_EQ(honesty.called_good, 0u);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("pictures"));
    }
  }
}

TEST(CalibrateLensAtItsLimits, TakesOnePictureShownTenTimesForOne) {
  MadeBoards options;
  options.views = 3;
  LensProblem problem = make_board_views(made_fisheye(), options);
  for (int i = 0; i < 10; ++i) problem.views.push_back(problem.views[0]);
  const LensCalibration c = calibrate_lens(problem);
  EXPECT_THAT(c.warnings, Contains(HasSubstr("only 3 pictures")));
}

TEST(CalibrateLensAtItsLimits, StandsHalfOfItsCornersWrong) {
  const LensCalibration c = calibrated([](MadeBoards& o) {
    o.outliers = 0.5;
    o.views = 30;
  });
  EXPECT_LE(ray_error_mrad(made_fisheye(), c.lens, 89), 2);
  EXPECT_THAT(c.warnings, Contains(HasSubstr("of the corners do not fit")));
}

TEST(CalibrateLensAtItsLimits, SaysThatCornersScatter) {
  const LensCalibration c = calibrated([](MadeBoards& o) { o.noise_px = 2.5; });
  EXPECT_THAT(c.warnings, Contains(HasSubstr("corners scatter by 2.")));
}

// Rows are exposed one after the other while the board moves: each row of corners sees it
// somewhere else.
TEST(CalibrateLensAtItsLimits, NoticesARollingShutter) {
  MadeBoards options;
  options.noise_px = 0.1;
  LensProblem problem = make_board_views(made_fisheye(), options);
  std::mt19937 random(4);
  std::normal_distribution<double> speed(0, 6);  // pixels over a picture's height
  for (BoardView& view : problem.views) {
    const Vec2 moving{speed(random), speed(random)};
    for (auto& q : view.corners) {
      if (!q) continue;
      const double late = (q->y / 1024 - 0.5) * (q->y / 1024 - 0.5) * 4;
      q = Vec2{q->x + moving.x * late, q->y + moving.y * late};
    }
  }
  const LensCalibration c = calibrate_lens(problem);
  EXPECT_THAT(c.warnings, Contains(HasSubstr("rolling shutter")));
}

TEST(CalibrateLensAtItsLimits, LosesAccuracySmoothlyAsCornersGetNoisier) {
  double before = 0;
  for (const double noise_px : {0.1, 0.3, 1.0, 3.0}) {
    MadeBoards options;
    options.noise_px = noise_px;
    options.views = 12;
    const MadeLens truth = made_fisheye();
    double sum = 0;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      options.seed = seed;
      sum += std::pow(
          ray_error_mrad(truth, calibrate_lens(make_board_views(truth, options)).lens, 85), 2);
    }
    const double error = std::sqrt(sum / 3);
    EXPECT_LE(error, 5 * noise_px) << noise_px;
    EXPECT_GE(error, before / 2) << noise_px;
    before = error;
  }
}

}  // namespace
}  // namespace calibrate::lens_stability_test
