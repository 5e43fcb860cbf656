// A labeller between a made camera and a schedule, and what its labels are worth.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/exposure_labels.h"
#include "tests/capture/made_exposure_stream.h"

namespace made {

using capture::ExposureLabel;
using capture::ExposureLabeller;
using capture::LabelVerdict;
using capture::NoiseModel;

// Random brackets of 2 to 6 exposures, factors of 2 to 8 apart, in three orders.
inline StreamPlan random_plan(std::mt19937_64& random) {
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

struct LabelCounts {
  std::int64_t frames = 0, accepted = 0, rejected = 0, unknown = 0;
  std::int64_t wrong = 0, wrong_in_part = 0, wrong_unseen = 0;
  std::int64_t good = 0, good_rejected = 0, good_unknown = 0, good_unknown_though_told = 0;
  std::int64_t after_connecting = 0;
  std::int64_t connections = 0, till_known = 0, longest_till_known = 0;
  std::map<std::string, int> reasons;
  std::vector<std::string> odd;  // frames accepted wrongly, in words
};

// The camera of a stream, a schedule, and the labeller between them.
class LabelTrial {
 public:
  LabelTrial(const StreamPlan& plan, const StreamFaults& faults, std::uint64_t seed, int trial = 0)
      : trial_(trial),
        plan_(plan),
        stream_(plan, faults, seed),
        labeller_({.noise = stream_.noise()}) {
    labeller_.set_schedule(plan.exposures_s);
  }

  void run(int frames, LabelCounts& counts) {
    for (int i = 0; i < frames; ++i) step(counts);
  }

  ExposureStream& stream() { return stream_; }
  const ExposureLabeller& labeller() const { return labeller_; }
  const ExposureLabel& last() const { return last_; }

  const ExposureLabel& step(LabelCounts& counts) {
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

  static double unsaturated(float value, const NoiseModel& noise) {
    return std::min(static_cast<double>(value), noise.saturation);
  }

  // Whether exposures would have looked different, in many values.
  bool differ(double a_s, double b_s) const {
    const NoiseModel noise = stream_.noise();
    const std::vector<float> a_values = stream_.values_of(a_s);
    const std::vector<float> b_values = stream_.values_of(b_s);
    int different = 0;
    for (std::size_t i = 0; i < a_values.size(); ++i) {
      const double a = unsaturated(a_values[i], noise);
      const double b = unsaturated(b_values[i], noise);
      different +=
          std::abs(a - b) > 15 * std::sqrt(noise.variance(std::max(a, b))) && std::min(a, b) < 0.3;
    }
    return different >= 100;
  }

  // How many values of the rows that another exposure made differ beyond the noise.
  int visible(const MadeFrame& frame, double label_s) const {
    const NoiseModel noise = stream_.noise();
    const auto other = std::ranges::find_if_not(
        frame.row_exposure_s, [&](double t) { return std::abs(t / label_s - 1) < 0.01; });
    const std::vector<float> a_values = stream_.values_of(*other);
    const std::vector<float> b_values = stream_.values_of(label_s);
    const std::size_t row = std::size_t{ExposureStream::columns} * ExposureStream::channels;
    int different = 0;
    for (std::size_t i = 0; i < a_values.size(); ++i) {
      const bool edge = i < row || i >= a_values.size() - row;
      if (stream_.made_by(frame, i / row) != *other) continue;
      const double a = unsaturated(a_values[i], noise);
      const double b = unsaturated(b_values[i], noise);
      const double variance =
          (edge ? frame.thumbnail.edge_variance : 1) * noise.variance(std::max(a, b));
      different += std::abs(a - b) > 10 * std::sqrt(variance);
    }
    return different;
  }

  bool told_apart(double exposure_s) const {
    std::vector<double> sorted = plan_.exposures_s;
    std::ranges::sort(sorted);
    for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
      if ((sorted[i] == exposure_s || sorted[i + 1] == exposure_s) &&
          !differ(sorted[i], sorted[i + 1])) {
        return false;
      }
    }
    return true;
  }

  void count(const MadeFrame& frame, const ExposureLabel& label, LabelCounts& counts) {
    ++counts.frames;
    ++frames_;
    const auto& rows = frame.row_exposure_s;
    const bool whole = std::ranges::all_of(rows, [&](double t) { return t == rows[0]; });
    if (label.verdict == LabelVerdict::accepted) {
      ++counts.accepted;
      const auto right = [&](double t) { return std::abs(t / label.exposure_s - 1) < 0.01; };
      if (std::ranges::none_of(rows, right)) {
        ++counts.wrong;
        note("wrong", frame, label, counts);
      }
      if (!whole && std::ranges::any_of(rows, right)) {
        const int seen = visible(frame, label.exposure_s);
        ++(seen > 0 ? counts.wrong_in_part : counts.wrong_unseen);
        if (seen > 0) note("mixed", frame, label, counts);
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

  void note(const char* what,
            const MadeFrame& frame,
            const ExposureLabel& label,
            LabelCounts& counts) {
    std::ostringstream text;
    text << "trial " << trial_ << " frame " << frames_ << " (" << frame.since_connected
         << " since connected, lag " << stream_.lag() << " of " << labeller_.lag().value_or(-1)
         << "): " << what << ", labelled " << label.exposure_s << ", made by";
    const auto& rows = frame.row_exposure_s;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (i == 0 || rows[i] != rows[i - 1]) text << " " << rows[i] << " from row " << i;
    }
    text << (frame.fresh ? "" : " (repeated)") << "; " << label.evidence.agreeing << " of "
         << label.evidence.telling_least << " values agree; exposures";
    for (const double t : plan_.exposures_s) text << " " << t;
    counts.odd.push_back(text.str());
  }

  int trial_ = 0;
  std::int64_t frames_ = 0;
  StreamPlan plan_;
  ExposureStream stream_;
  ExposureLabeller labeller_;
  ExposureLabel last_;
  std::size_t next_ = 0;
  std::vector<std::pair<std::int64_t, double>> requests_;
  std::int64_t known_after_ = -1;
};

inline std::string words(const LabelCounts& counts) {
  std::ostringstream text;
  text << counts.frames << " frames: " << counts.accepted << " accepted, " << counts.rejected
       << " rejected, " << counts.unknown << " unknown; labels wrong " << counts.wrong
       << ", mixed pictures accepted " << counts.wrong_in_part << " (and " << counts.wrong_unseen
       << " in which no value tells); " << counts.good << " good ones, " << counts.good_rejected
       << " of them rejected, " << counts.good_unknown << " unknown ("
       << counts.good_unknown_though_told << " of these could be told apart); known after "
       << static_cast<double>(counts.till_known) /
              static_cast<double>(std::max<std::int64_t>(counts.connections, 1))
       << " frames in the mean of " << counts.connections << " connections";
  for (const auto& [reason, count] : counts.reasons) text << "; " << count << " " << reason;
  for (const std::string& odd : counts.odd) text << "\n" << odd;
  return text.str();
}

inline LabelCounts sum_of(const std::vector<LabelCounts>& parts) {
  LabelCounts all;
  for (const LabelCounts& part : parts) {
    for (const auto count :
         {&LabelCounts::frames, &LabelCounts::accepted, &LabelCounts::rejected,
          &LabelCounts::unknown, &LabelCounts::wrong, &LabelCounts::wrong_in_part,
          &LabelCounts::wrong_unseen, &LabelCounts::good, &LabelCounts::good_rejected,
          &LabelCounts::good_unknown, &LabelCounts::good_unknown_though_told,
          &LabelCounts::after_connecting, &LabelCounts::connections, &LabelCounts::till_known}) {
      all.*count += part.*count;
    }
    all.longest_till_known = std::max(all.longest_till_known, part.longest_till_known);
    for (const auto& [reason, count] : part.reasons) all.reasons[reason] += count;
    all.odd.insert(all.odd.end(), part.odd.begin(), part.odd.end());
  }
  return all;
}

struct TrialPlan {
  int trials = 5;
  int frames = 4000;  // of each
  std::uint64_t seed = 7;
  StreamFaults faults{};
  int pixels = 1;  // see StreamPlan
};

// Trials of random cameras and scenes, in two threads; they do not depend on which.
inline LabelCounts run_trials(const TrialPlan& plan) {
  std::mt19937_64 random(plan.seed);
  std::vector<std::pair<std::uint64_t, StreamPlan>> streams;
  for (int trial = 0; trial < plan.trials; ++trial) {
    const std::uint64_t seed = random();
    streams.emplace_back(seed, random_plan(random));
    streams.back().second.pixels = plan.pixels;
  }
  std::vector<LabelCounts> counts(streams.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < streams.size(); i = next++) {
      LabelTrial(streams[i].second, plan.faults, streams[i].first, static_cast<int>(i))
          .run(plan.frames, counts[i]);
    }
  };
  {
    const std::jthread other(work);
    work();
  }
  return sum_of(counts);
}

}  // namespace made
