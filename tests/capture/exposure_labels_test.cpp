// Labels of exposures: never a wrong one, whatever the camera does.
#include "capture/exposure_labels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/capture/made_exposure_stream.h"

namespace capture {
namespace {

using made::ExposureStream;
using made::MadeFrame;
using made::StreamFaults;
using made::StreamPlan;

// Random brackets of 2 to 6 exposures, factors of 2 to 8 apart, in three orders.
StreamPlan random_plan(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  StreamPlan plan;
  const auto members = 2 + random() % 5;
  const bool geometric = random() % 2 == 0;
  double factor = std::exp2(uniform(1, 3));
  double exposure_s = 1e-5;
  for (std::size_t i = 0; i < members; ++i) {
    plan.exposures_s.push_back(exposure_s);
    if (!geometric) factor = std::exp2(uniform(1, 3));
    exposure_s *= factor;
  }
  const auto order = random() % 3;
  if (order == 1) std::ranges::reverse(plan.exposures_s);
  if (order == 2) std::ranges::shuffle(plan.exposures_s, random);
  plan.full_well_e = std::exp2(uniform(12, 15));
  plan.read_e = uniform(2, 12);
  plan.bits = random() % 2 == 0 ? 8 : 12;
  plan.stops = uniform(4, 14);
  const double range = std::log2(*std::ranges::max_element(plan.exposures_s) /
                                 *std::ranges::min_element(plan.exposures_s));
  plan.key = uniform(-0.5, 0.5) * range + uniform(-3, 2);
  return plan;
}

struct Counts {
  std::int64_t frames = 0, accepted = 0, rejected = 0, unknown = 0;
  std::int64_t wrong = 0, wrong_in_part = 0, wrong_unseen = 0;
  std::int64_t good = 0, good_rejected = 0, good_unknown = 0, good_unknown_though_told = 0;
  std::int64_t after_connecting = 0;
  std::int64_t connections = 0, till_known = 0, longest_till_known = 0;
  std::map<std::string, int> reasons;
};

// The camera of a stream, a schedule, and the labeller between them.
class Trial {
 public:
  Trial(const StreamPlan& plan, const StreamFaults& faults, std::uint64_t seed)
      : plan_(plan), stream_(plan, faults, seed), labeller_({.noise = stream_.noise()}) {
    labeller_.set_schedule(plan.exposures_s);
  }

  void run(int frames, Counts& counts) {
    for (int i = 0; i < frames; ++i) step(counts);
  }

  ExposureStream& stream() { return stream_; }
  const ExposureLabeller& labeller() const { return labeller_; }
  const ExposureLabel& last() const { return last_; }

  const ExposureLabel& step(Counts& counts) {
    const MadeFrame frame = stream_.next();
    if (frame.since_connected == 0) {
      requests_.clear();
      known_after_ = -1;
    }
    const ExposureLabel label = labeller_.label(frame.number, frame.thumbnail);
    count(frame, label, counts);
    const double exposure_s = plan_.exposures_s[next_++ % plan_.exposures_s.size()];
    labeller_.requested(frame.number, exposure_s);
    requests_.emplace_back(frame.number, exposure_s);
    if (requests_.size() > 64) requests_.erase(requests_.begin(), requests_.begin() + 32);
    stream_.request(exposure_s);
    return last_ = label;
  }

 private:
  double foretold(std::int64_t number) const {
    double exposure_s = 0;
    for (const auto& [after, asked_s] : requests_) {
      if (after <= number - 1 - stream_.lag()) exposure_s = asked_s;
    }
    return exposure_s;
  }

  // Whether exposures would have looked different in the rows first..last - 1, in many values.
  bool differ(double a_s, double b_s, std::size_t first, std::size_t last, int least) const {
    const NoiseModel noise = stream_.noise();
    const std::size_t row = std::size_t{ExposureStream::columns} * ExposureStream::channels;
    int different = 0;
    for (std::size_t i = first * row; i < last * row; ++i) {
      const double a = std::min(stream_.value_of(i, a_s), noise.saturation);
      const double b = std::min(stream_.value_of(i, b_s), noise.saturation);
      different +=
          std::abs(a - b) > 15 * std::sqrt(noise.variance(std::max(a, b))) && std::min(a, b) < 0.3;
    }
    return different >= least;
  }

  // How many values of the rows first..last - 1 differ beyond the noise between two exposures.
  int visible(double a_s, double b_s, std::size_t first, std::size_t last) const {
    const NoiseModel noise = stream_.noise();
    const std::size_t row = std::size_t{ExposureStream::columns} * ExposureStream::channels;
    int different = 0;
    for (std::size_t i = first * row; i < last * row; ++i) {
      const double a = std::min(stream_.value_of(i, a_s), noise.saturation);
      const double b = std::min(stream_.value_of(i, b_s), noise.saturation);
      different += std::abs(a - b) > 10 * std::sqrt(noise.variance(std::max(a, b)));
    }
    return different;
  }

  bool told_apart(double exposure_s) const {
    std::vector<double> sorted = plan_.exposures_s;
    std::ranges::sort(sorted);
    for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
      if ((sorted[i] == exposure_s || sorted[i + 1] == exposure_s) &&
          !differ(sorted[i], sorted[i + 1], 0, ExposureStream::rows, 100)) {
        return false;
      }
    }
    return true;
  }

  void count(const MadeFrame& frame, const ExposureLabel& label, Counts& counts) {
    ++counts.frames;
    const auto& rows = frame.row_exposure_s;
    const bool whole = std::ranges::all_of(rows, [&](double t) { return t == rows[0]; });
    if (label.verdict == LabelVerdict::accepted) {
      ++counts.accepted;
      const auto right = [&](double t) { return std::abs(t / label.exposure_s - 1) < 0.01; };
      if (std::ranges::none_of(rows, right)) ++counts.wrong;
      if (!whole && std::ranges::any_of(rows, right)) {
        const auto other =
            static_cast<std::size_t>(std::ranges::find_if_not(rows, right) - rows.begin());
        const auto part = std::ranges::count(rows, rows[other]);
        const bool seen = visible(rows[other], label.exposure_s, other,
                                  other + static_cast<std::size_t>(part)) >= 8;
        ++(seen ? counts.wrong_in_part : counts.wrong_unseen);
      }
      if (known_after_ < 0) {
        known_after_ = frame.since_connected;
        ++counts.connections;
        counts.till_known += known_after_;
        counts.longest_till_known = std::max(counts.longest_till_known, known_after_);
      }
    }
    counts.rejected += label.verdict == LabelVerdict::rejected;
    counts.unknown += label.verdict == LabelVerdict::unknown;
    const bool good = whole && frame.fresh && rows[0] == foretold(frame.number);
    const auto bracket = static_cast<int>(plan_.exposures_s.size());
    if (frame.since_connected <= bracket + 1 + stream_.lag()) {
      ++counts.after_connecting;
      return;
    }
    if (!good) return;
    ++counts.good;
    if (label.verdict == LabelVerdict::rejected) {
      ++counts.good_rejected;
      ++counts.reasons[words_of(label.reason)];
    }
    if (label.verdict == LabelVerdict::unknown) {
      ++counts.good_unknown;
      counts.good_unknown_though_told += told_apart(rows[0]);
    }
  }

  StreamPlan plan_;
  ExposureStream stream_;
  ExposureLabeller labeller_;
  ExposureLabel last_;
  std::size_t next_ = 0;
  std::vector<std::pair<std::int64_t, double>> requests_;
  std::int64_t known_after_ = -1;
};

std::string words(const Counts& counts) {
  std::ostringstream text;
  text << counts.frames << " frames: " << counts.accepted << " accepted, " << counts.rejected
       << " rejected, " << counts.unknown << " unknown; labels wrong " << counts.wrong
       << ", mixed pictures accepted " << counts.wrong_in_part << " (and " << counts.wrong_unseen
       << " in which hardly a value tells); " << counts.good << " good ones, "
       << counts.good_rejected << " of them rejected, " << counts.good_unknown << " unknown ("
       << counts.good_unknown_though_told << " of these could be told apart); known after "
       << static_cast<double>(counts.till_known) /
              static_cast<double>(std::max<std::int64_t>(counts.connections, 1))
       << " frames in the mean of " << counts.connections << " connections";
  for (const auto& [reason, count] : counts.reasons) text << "; " << count << " " << reason;
  return text.str();
}

TEST(ExposureLabeller, AcceptsNoWrongLabelWhateverTheCameraDoes) {
  constexpr int frames_of_trial = 4000;
  constexpr int trials = PLATELIGHT_FULL_TESTS ? 250 : 5;
  std::mt19937_64 random(7);
  Counts counts;
  for (int trial = 0; trial < trials; ++trial) {
    Trial(random_plan(random), StreamFaults{}, random()).run(frames_of_trial, counts);
  }
  SCOPED_TRACE(words(counts));
  RecordProperty("counts", words(counts));
  EXPECT_GT(counts.accepted, counts.frames / 2);
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_EQ(counts.wrong_in_part, 0);
  EXPECT_LE(static_cast<double>(counts.good_rejected + counts.good_unknown_though_told),
            0.001 * static_cast<double>(counts.good));
}

constexpr StreamFaults no_faults{.dropped = 0,
                                 .dropped_silently = 0,
                                 .replaced = 0,
                                 .inserted = 0,
                                 .mixed = 0,
                                 .ignored = 0,
                                 .burst = 0,
                                 .person = 0,
                                 .lamp = 0,
                                 .main_lamp = 0,
                                 .reconnect = 0};

// A bright enough scene for a bracket of three.
StreamPlan plain_plan() { return {.exposures_s = {1e-3, 4e-3, 16e-3}, .stops = 6, .drift = 0}; }

TEST(ExposureLabeller, KnowsEveryLagWithinABracketAndTheLag) {
  for (int seed = 0; seed < 40; ++seed) {
    const auto random_seed = static_cast<std::uint64_t>(seed);
    Trial trial(plain_plan(), no_faults, random_seed);
    Counts counts;
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
  Counts counts;
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    Trial(plain_plan(), faults, seed).run(1000, counts);
  EXPECT_EQ(counts.wrong, 0) << words(counts);
  // About a bracket each time.
  EXPECT_LE(static_cast<double>(counts.good_rejected),
            0.005 * 6 * static_cast<double>(counts.good));
}

// The picture's verdict after a script has changed something, and how many were accepted wrongly.
TEST(ExposureLabeller, SaysDarkOrSaturatedWhereAllExposuresLookAlike) {
  for (const auto& [light, reason] :
       {std::pair{1e-9, LabelReason::dark}, std::pair{1e9, LabelReason::saturated}}) {
    Trial trial(plain_plan(), no_faults, 3);
    Counts counts;
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
  Trial trial(plain_plan(), no_faults, 3);
  Counts counts;
  trial.run(30, counts);
  trial.stream().set_in_effect(4e-3);
  Counts stuck;
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
  Trial trial(plain_plan(), no_faults, 4);
  Counts counts;
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
}  // namespace capture
