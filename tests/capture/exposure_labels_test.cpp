// Labels of exposures: never a wrong one, whatever the camera does.
#include "capture/exposure_labels.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include "tests/capture/label_trial.h"

namespace capture::exposure_labels_test {
namespace {

using made::ExposureStream;
using made::LabelCounts;
using made::LabelTrial;
using made::MadeFrame;
using made::no_faults;
using made::run_trials;
using made::StreamFaults;
using made::StreamPlan;

// Pictures whose rows are mixed count as right where no value differs beyond the noise between the
// two exposures: whatever a merge makes of such rows is right with either label.
void expect_right(const LabelCounts& counts) {
  SCOPED_TRACE(words(counts));
  testing::Test::RecordProperty("counts", words(counts));
  EXPECT_GT(counts.accepted, counts.frames / 2);
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_EQ(counts.wrong_in_part, 0);
  EXPECT_LE(static_cast<double>(counts.good_rejected + counts.good_unknown_though_told),
            0.001 * static_cast<double>(counts.good));
}

TEST(ExposureLabeller, AcceptsNoWrongLabelWhateverTheCameraDoes) {
  expect_right(run_trials({.trials = PLATELIGHT_FULL_TESTS ? 250 : 5}));
}

TEST(ExposureLabeller, AcceptsNoWrongLabelOfPictures) {
  expect_right(run_trials({.trials = PLATELIGHT_FULL_TESTS ? 100 : 10,
                           .frames = PLATELIGHT_FULL_TESTS ? 4000 : 2000,
                           .seed = 11,
                           .pixels = 8}));
}

// While the lag is looked for, a write that is ignored or a frame lost uncounted may hide where a
// wrong lag fails.
TEST(ExposureLabeller, BelievesNoWrongLagWhereTheFirstFramesGoWrong) {
  StreamFaults faults = no_faults;
  faults.ignored = 0.03;
  faults.dropped_silently = 0.01;
  std::mt19937_64 random(5);
  LabelCounts counts;
  for (int connection = 0; connection < 600; ++connection) {
    const StreamPlan plan = made::random_plan(random);
    LabelTrial(plan, faults, random()).run(40, counts);
  }
  EXPECT_EQ(counts.wrong, 0) << words(counts);
  EXPECT_GT(counts.accepted, counts.frames / 2);
}

// A bright enough scene for a bracket of three.
StreamPlan plain_plan() { return {.exposures_s = {1e-3, 4e-3, 16e-3}, .stops = 6, .drift = 0}; }

TEST(ExposureLabeller, KnowsEveryLagWithinABracketAndTheLag) {
  for (int seed = 0; seed < 40; ++seed) {
    const auto random_seed = static_cast<std::uint64_t>(seed);
    LabelTrial trial(plain_plan(), no_faults, random_seed);
    LabelCounts counts;
    trial.run(60, counts);
    EXPECT_EQ(counts.wrong, 0);
    EXPECT_LE(counts.longest_till_known, 3 + 1 + trial.stream().lag());
    EXPECT_EQ(counts.good_rejected, 0);
    ASSERT_TRUE(trial.labeller().lag());
    EXPECT_EQ((*trial.labeller().lag() - trial.stream().lag()) % 3, 0);
  }
}

TEST(ExposureLabeller, TakesAnotherLightForNoOtherExposure) {
  StreamFaults faults = no_faults;
  faults.main_lamp = 0.005;
  LabelCounts counts;
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    LabelTrial(plain_plan(), faults, seed).run(1000, counts);
  EXPECT_EQ(counts.wrong, 0) << words(counts);
  // About a bracket each time.
  EXPECT_LE(static_cast<double>(counts.good_rejected),
            0.005 * 4 * static_cast<double>(counts.good));
}

TEST(ExposureLabeller, SaysDarkOrSaturatedWhereAllExposuresLookAlike) {
  for (const auto& [light, reason] :
       {std::pair{1e-9, LabelReason::dark}, std::pair{1e9, LabelReason::saturated}}) {
    LabelTrial trial(plain_plan(), no_faults, 3);
    LabelCounts counts;
    trial.run(30, counts);
    trial.stream().set_light(light);
    trial.run(5, counts);
    for (int i = 0; i < 50; ++i) {
      EXPECT_EQ(trial.step(counts).verdict, LabelVerdict::unknown);
      EXPECT_EQ(trial.last().reason, reason);
    }
    trial.stream().set_light(1);
    trial.run(15, counts);
    EXPECT_EQ(trial.step(counts).verdict, LabelVerdict::accepted);
    EXPECT_EQ(counts.wrong, 0);
  }
}

TEST(ExposureLabeller, RejectsWhatACameraThatNoLongerListensShows) {
  LabelTrial trial(plain_plan(), no_faults, 3);
  LabelCounts counts;
  trial.run(30, counts);
  trial.stream().set_in_effect(4e-3);
  LabelCounts stuck;
  trial.run(300, stuck);
  EXPECT_EQ(stuck.wrong, 0);
  EXPECT_GE(stuck.rejected, 190);  // a third of the labels happens to be true
  trial.stream().set_in_effect(std::nullopt);
  trial.run(10, stuck);
  EXPECT_EQ(trial.step(stuck).verdict, LabelVerdict::accepted);
  EXPECT_EQ(stuck.wrong, 0);
}

TEST(ExposureLabeller, AcceptsNoWrongLabelInLightThatChangesFasterThanTheBracket) {
  std::mt19937 random(5);
  LabelTrial trial(plain_plan(), no_faults, 4);
  LabelCounts counts;
  for (int i = 0; i < 2000; ++i) {
    trial.stream().set_light(std::exp2(static_cast<double>(random() % 5) - 2));
    trial.step(counts);
  }
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GT(counts.rejected, 1000);
}

TEST(ExposureLabeller, ChecksWhatTheCameraTells) {
  const StreamPlan plan = plain_plan();
  ExposureStream stream(plan, no_faults, 2);
  ExposureLabeller labeller({.noise = stream.noise()});
  labeller.set_schedule(plan.exposures_s);
  int accepted = 0;
  for (int i = 0; i < 60; ++i) {
    const MadeFrame frame = stream.next();
    const double made_s = frame.row_exposure_s[0];
    const bool lie = i == 40;
    const ExposureLabel label = labeller.label(frame.number, frame.thumbnail,
                                               lie ? plan.exposures_s[made_s < 2e-3] : made_s);
    if (lie) {
      EXPECT_EQ(label.verdict, LabelVerdict::rejected);
    } else if (label.verdict == LabelVerdict::accepted) {
      ++accepted;
      EXPECT_EQ(label.exposure_s, made_s);
    }
    const double asked_s = plan.exposures_s[static_cast<std::size_t>(i) % 3];
    labeller.requested(frame.number, asked_s);
    stream.request(asked_s);
  }
  EXPECT_GE(accepted, 40);
}

// As cells were added one pixel after the other.
TEST(ThumbnailOf, HasTheMeansOfCells) {
  std::mt19937 random(3);
  Image image = make_image(37, 50);
  for (float& value : image.pixels) value = static_cast<float>(random() % 1000) / 900;
  const Thumbnail thumbnail = thumbnail_of(image, 5, 4, 1.2);
  ASSERT_EQ(thumbnail.values.size(), 5U * 4 * 3);
  constexpr std::array rows{0, 1, 12, 24, 36, 37};
  constexpr std::array columns{0, 12, 25, 37, 50};
  std::size_t i = 0;
  for (std::size_t row = 0; row < 5; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      for (int c = 0; c < 3; ++c, ++i) {
        double sum = 0;
        for (int y = rows[row]; y < rows[row + 1]; ++y) {
          for (int x = columns[column]; x < columns[column + 1]; ++x) sum += image.at(y, x, c);
        }
        const int pixels = (rows[row + 1] - rows[row]) * (columns[column + 1] - columns[column]);
        EXPECT_NEAR(thumbnail.values[i], sum / pixels, 1e-5);
      }
    }
  }
  image.at(20, 30, 1) = 2;
  const Thumbnail saturated = thumbnail_of(image, 5, 4, 1.2);
  for (i = 0; i < saturated.values.size(); ++i) {
    EXPECT_EQ(std::isnan(saturated.values[i]), i == (2 * 4 + 2) * 3 + 1);
  }
}

TEST(ExposureLabeller, RefusesWhatMakesNoSense) {
  EXPECT_THROW(ExposureLabeller({.noise = {.read = 0}}), std::invalid_argument);
  EXPECT_THROW(ExposureLabeller({.noise = {}, .most_lag = -1}), std::invalid_argument);
  ExposureLabeller labeller({});
  EXPECT_THROW(labeller.set_schedule({}), std::invalid_argument);
  EXPECT_THROW(labeller.requested(0, 0), std::invalid_argument);
  EXPECT_THROW(thumbnail_of(Image{}), std::invalid_argument);
  const Thumbnail large = thumbnail_of(make_image(20, 20));
  const Thumbnail small = thumbnail_of(make_image(3, 4));
  EXPECT_EQ(small.rows, 3);
  EXPECT_EQ(small.columns, 4);
  labeller.set_schedule(std::array{0.01});
  labeller.requested(-1, 0.01);
  for (int n = 8; n < 12; ++n) labeller.label(n, large);
  EXPECT_THROW(labeller.label(12, small), std::invalid_argument);
}

}  // namespace
}  // namespace capture::exposure_labels_test
