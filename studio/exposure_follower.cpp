// The plate's exposure over the calibrated one.
#include "studio/exposure_follower.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "capture/median.h"
#include "render/match.h"

namespace studio {
namespace {

// Averaged over about this many frames; the farther a frame is off the average, the more of it is
// taken, and all from a change on that is no noise: this many standard deviations of the mean of
// all directions, which is not known better than `least_change`. So an exposure that creeps neither
// runs ahead of its average nor is caught up with in steps.
constexpr double average_frames = 12;
constexpr double deviations = 4;
constexpr double least_change = 0.01;

// By how much the pairs differ from what is common to them, relative and robust.
double spread_of(std::span<const calibrate::LightPair> pairs, double common) {
  std::vector<double> off;
  for (const calibrate::LightPair& pair : pairs) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::log(pair.plate[c] / (common * pair.probe[c]));
    off.push_back(std::abs(sum / 3));
  }
  return capture::sigma_by_median * capture::median_in_place(off);
}

}  // namespace

void ExposureFollower::follow(double exposure_s,
                              double level_of_pairs,
                              std::span<const calibrate::LightPair> pairs) {
  const bool told = exposure_s > 0;
  if (told && calibrated_s_) {
    level_ = exposure_s / *calibrated_s_;
    doubtful_ = false;
    // Where a frame then tells none, it goes on from here.
    timed_ = true;
    per_second_ = level_ / exposure_s;
    note_ = fmt::format("the plate's {:.4g} s are {:.3f} of the calibrated exposure", exposure_s,
                        level_);
    return;
  }
  const double unit = told ? exposure_s : 1;
  if (told != timed_) {
    per_second_ = level_ / unit;
    timed_ = told;
  }
  const bool found = pairs.size() >= fewest_pairs;
  if (found) {
    const double over = calibrate::follow_exposure(calibrate::LightGain{}, pairs);
    const double now = level_of_pairs * over / (told_by_pairs_ * unit);
    spread_ = spread_of(pairs, over);
    const double sudden =
        std::max(least_change, deviations * spread_ / std::sqrt(static_cast<double>(pairs.size())));
    const double off = (now / per_second_ - 1) / sudden;
    const double share = measured_ ? std::clamp(std::pow(off, 4), 1 / average_frames, 1.0) : 1;
    per_second_ += share * (now - per_second_);
    measured_ = true;
  }
  level_ = per_second_ * unit;
  doubtful_ = found && spread_ > render::doubtful_spread;
  note_ = found ? fmt::format(
                      "the plate's exposure is {:.3f} of the calibrated one, by {} "
                      "directions that both cameras see{}",
                      level_, pairs.size(),
                      doubtful_ ? "; doubtful: they disagree, so things may be near, or poses wrong"
                                : "")
                : fmt::format(
                      "too little is seen by both cameras, unclipped and not dark, to "
                      "follow the plate's exposure: {} at {:.3f} of the calibrated one",
                      told ? "by its time alone" : "held", level_);
}

}  // namespace studio
