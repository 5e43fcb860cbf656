// By how much one camera's clock is ahead of another's, from something that both saw change.
#include "calibrate/time_offset.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "calibrate/common_motion.h"
#include "calibrate/golden_section.h"
#include "calibrate/signal_edges.h"
#include "calibrate/signal_likelihood.h"
#include "calibrate/signal_search.h"

namespace calibrate {
namespace {

constexpr std::size_t fewest_frames = 20;
constexpr std::size_t enough_jumps = 10;
constexpr double least_correlation = 0.4;
// Correlation elsewhere, in parts of the best, at which the signals repeat themselves.
constexpr double repeats_itself = 0.9;
// Of motions: what both see in common is the same but for noise.
constexpr double least_common = 0.99;
constexpr double far_worse = 4;  // share that is not in common elsewhere, over that at the best
constexpr double frames_apart = 2;
constexpr double most_sigma_frames = 0.15;
constexpr double longest_s = 3600;

[[noreturn]] void refuse(const std::string& why) { throw std::runtime_error(why); }

bool is_finite(const SignalSample& sample) {
  return std::isfinite(sample.value) && std::isfinite(sample.exposure_s);
}
bool is_finite(const SeenPoint& point) {
  return std::isfinite(point.q.x) && std::isfinite(point.q.y);
}

template <class Sample>
void check(std::span<const Sample> signal, const char* name) {
  for (std::size_t i = 0; i < signal.size(); ++i) {
    if (!std::isfinite(signal[i].time_s) || !is_finite(signal[i])) {
      throw std::invalid_argument("a signal needs finite numbers");
    }
    if (i > 0 && !(signal[i].time_s > signal[i - 1].time_s)) {
      throw std::invalid_argument("the times of a signal must rise");
    }
  }
  if (signal.size() < fewest_frames) {
    refuse("camera " + std::string(name) + " has only " + std::to_string(signal.size()) +
           " frames: take " + std::to_string(fewest_frames) + " or more, best ten seconds");
  }
  // Searched at even steps of all that lies between: a time stamp that is far off is not looked
  // for.
  if (signal.back().time_s - signal.front().time_s > longest_s) {
    refuse("the times of camera " + std::string(name) +
           " span more than an hour: is one of them wrong? Take ten seconds");
  }
}

void check(const TimeOffsetOptions& options) {
  if (!(options.largest_s > 0) || !std::isfinite(options.largest_s)) {
    throw std::invalid_argument("the largest offset must be above 0 and finite");
  }
}

std::string repeated(const std::string& what, double every_s, const std::string& otherwise) {
  return "the " + what + " repeats itself every " +
         std::to_string(std::lround(1000 * std::abs(every_s))) +
         " ms or so, so that the offset could be off by that: " + otherwise +
         " at random, or look for smaller offsets";
}

// Refined, it may have gone beyond what was asked for.
void check_largest(const TimeOffset& found, const TimeOffsetOptions& options) {
  if (std::abs(found.offset_s) <= options.largest_s + found.sigma_s) return;
  refuse("the offset is " + std::to_string(std::lround(1000 * found.offset_s)) +
         " ms or so, which is more than was looked for: look for larger ones");
}

std::string only_to(const std::string& what, double sigma_s) {
  return "the " + what + " that both cameras saw tells the offset to no better than " +
         std::to_string(std::lround(1000 * std::min(sigma_s, 1.0))) + " ms";
}

// With mean 0 and variance 1.
std::vector<SignalSample> normalized(std::span<const SignalSample> signal, const char* name) {
  const auto n = static_cast<double>(signal.size());
  double mean = 0;
  for (const SignalSample& s : signal) mean += s.value / n;
  double variance = 0;
  for (const SignalSample& s : signal) variance += (s.value - mean) * (s.value - mean) / n;
  if (!(variance > 1e-18 * mean * mean)) {
    refuse("nothing changes in what camera " + std::string(name) +
           " saw: switch a lamp on and off before both, at random, or move a board");
  }
  std::vector<SignalSample> result(signal.begin(), signal.end());
  for (SignalSample& s : result) s.value = (s.value - mean) / std::sqrt(variance);
  return result;
}

void check(const std::vector<SignalMatch>& matches) {
  const double best = matches.empty() ? 0 : matches.front().correlation;
  if (best < least_correlation) {
    refuse("the cameras do not show the same change (their signals correlate by " +
           std::to_string(best).substr(0, 4) +
           " at best): let one lamp be the largest change in both, look for larger offsets, or "
           "move a board before both");
  }
  if (matches.size() > 1 && matches[1].correlation > repeats_itself * best) {
    refuse(repeated("change", matches[1].offset_s - matches[0].offset_s, "flash"));
  }
}

// That of the greatest likelihood, by a grid and then one parameter at a time.
Smoothness fit_smoothness(const SignalLikelihood& signals, double offset_s) {
  const std::size_t stride = std::max<std::size_t>(1, signals.stretches() / 3);
  Smoothness best;
  double highest = -std::numeric_limits<double>::infinity();
  const auto attempt = [&](const Smoothness& smoothness) {
    const double value = signals.log_likelihood(smoothness, offset_s, stride);
    if (value <= highest) return;
    highest = value;
    best = smoothness;
  };
  for (int order = 0; order < 3; ++order) {
    for (double scale_s = 0.01; scale_s < 5; scale_s *= 2.5) {
      for (const double noise : {1e-5, 1e-3, 3e-2}) attempt({order, scale_s, noise});
    }
  }
  for (const double factor : {2.0, 1.4, 1.15}) {
    for (int round = 0; round < 2; ++round) {
      for (const double f : {1 / factor, factor}) {
        attempt({best.order, best.scale_s * f, best.noise});
        attempt({best.order, best.scale_s, std::max(1e-7, best.noise * f * f)});
      }
    }
  }
  return best;
}

// The offset of the greatest likelihood near `result`'s, and its standard deviation.
void refine(const SignalLikelihood& signals, double reach_s, TimeOffset& result) {
  const Smoothness smoothness = fit_smoothness(signals, result.offset_s);
  const auto likelihood = [&](double offset_s) {
    return signals.log_likelihood(smoothness, offset_s);
  };
  constexpr int steps = 8;
  const double step_s = reach_s / steps;
  double best_s = result.offset_s;
  double highest = -std::numeric_limits<double>::infinity();
  for (int i = -steps; i <= steps; ++i) {
    const double offset_s = result.offset_s + step_s * i;
    const double value = likelihood(offset_s);
    if (value <= highest) continue;
    highest = value;
    best_s = offset_s;
  }
  result.offset_s = maximize(best_s - step_s, best_s + step_s, 2e-5, likelihood);
  const double peak = likelihood(result.offset_s);
  double width_s = step_s;
  for (int k = 0; k < 4; ++k) {  // from the bend over about one standard deviation
    const double fall =
        peak - (likelihood(result.offset_s - width_s) + likelihood(result.offset_s + width_s)) / 2;
    result.sigma_s = fall > 0 ? width_s / std::sqrt(2 * fall) : 10 * width_s;
    width_s = std::clamp(result.sigma_s, 2e-5, 2 * signals.interval_s());
  }
  // How stretches pull apart tells more than the bend where the process is not Gaussian.
  const std::vector<double> below = signals.of_stretches(smoothness, result.offset_s - width_s);
  const std::vector<double> above = signals.of_stretches(smoothness, result.offset_s + width_s);
  double squares = 0;
  for (std::size_t k = 0; k < std::min(below.size(), above.size()); ++k) {
    const double pull = (above[k] - below[k]) / (2 * width_s);
    squares += pull * pull;
  }
  const double bend_sigma_s = result.sigma_s;
  result.sigma_s = std::max(bend_sigma_s, bend_sigma_s * bend_sigma_s * std::sqrt(squares));
}

bool tells_exposures(std::span<const SignalSample> signal) {
  return std::ranges::any_of(signal, [](const SignalSample& s) { return s.exposure_s > 0; });
}

std::vector<SignalSample> exposed(std::span<const SignalSample> signal, double exposure_s) {
  std::vector<SignalSample> result(signal.begin(), signal.end());
  for (SignalSample& sample : result) {
    if (!(sample.exposure_s > 0)) sample.exposure_s = exposure_s;
  }
  return result;
}

// What exposures that are not told do to the offset: those of half the time between frames, which
// are guessed, may be as short or as long as they can be.
void doubt_guess(std::span<const SignalSample> a,
                 std::span<const SignalSample> b,
                 double gain_b,
                 TimeOffset& result) {
  constexpr double shortest_s = 1e-9;
  const auto cases = [](std::span<const SignalSample> signal) {
    std::vector<double> exposures_s{shortest_s};
    if (!tells_exposures(signal)) exposures_s.push_back(frame_interval_s(signal));
    return exposures_s;
  };
  double farthest_s = 0;
  for (const double exposure_a_s : cases(a)) {
    for (const double exposure_b_s : cases(b)) {
      const SignalLikelihood signals(exposed(a, exposure_a_s), exposed(b, exposure_b_s),
                                     result.offset_s, gain_b);
      TimeOffset other = result;
      refine(signals, signals.interval_s() / 2, other);
      farthest_s = std::max(farthest_s, std::abs(other.offset_s - result.offset_s));
      result.sigma_s = std::max(result.sigma_s, other.sigma_s);
    }
  }
  result.sigma_s = std::hypot(result.sigma_s, farthest_s);
}

// A lamp's switching tells more than its covariance.
void refine_by_edges(std::span<const SignalSample> a,
                     std::span<const SignalSample> b,
                     double interval_s,
                     TimeOffset& result) {
  // Without exposures, frames tell of a jump only which two it lies between; at equal rates their
  // limits then all lie in step, and promise more than they hold.
  if (!tells_exposures(a) || !tells_exposures(b)) return;
  const double reach_s = 0.75 * interval_s;
  const std::vector<SignalEdge> of_a = find_edges(a), of_b = find_edges(b);
  const auto found = offset_of_edges(of_a, of_b, result.offset_s, reach_s);
  // Exposures other than told, or other changes, would show.
  constexpr double enough_agree = 0.85;
  if (!found || found->agreeing < enough_agree || found->pairs < enough_jumps) return;
  result.offset_s = found->offset_s;
  result.sigma_s = found->sigma_s;
  result.edges = found->pairs;
  result.in_step = are_in_step(of_a) || are_in_step(of_b);
}

double overlap_s(const auto& a, const auto& b, double offset_s) {
  return std::min(a.back().time_s, b.back().time_s - offset_s) -
         std::max(a.front().time_s, b.front().time_s - offset_s);
}

// Frames of the camera that has fewer of them while both saw.
std::size_t frames_in_common(const auto& a, const auto& b, double offset_s) {
  const double begin_s = std::max(a.front().time_s, b.front().time_s - offset_s);
  const double end_s = begin_s + overlap_s(a, b, offset_s);
  const auto within = [&](const auto& signal, double later_s) {
    return static_cast<std::size_t>(std::ranges::count_if(signal, [&](const auto& sample) {
      constexpr double slack_s = 1e-9;
      const double time_s = sample.time_s - later_s;
      return time_s > begin_s - slack_s && time_s < end_s + slack_s;
    }));
  };
  return std::min(within(a, 0), within(b, offset_s));
}

void check_frames_in_common(const auto& a, const auto& b, double offset_s) {
  const std::size_t common = frames_in_common(a, b, offset_s);
  if (common >= fewest_frames) return;
  refuse("the cameras have only " + std::to_string(common) + " frames in common: record " +
         std::to_string(fewest_frames) + " or more at one time, best ten seconds");
}

// The likelihood of a few jumps is far too sure of itself: a jump's moment may be anywhere between
// two frames.
void doubt_few_jumps(std::span<const SignalSample> a,
                     std::span<const SignalSample> b,
                     double interval_s,
                     TimeOffset& result) {
  const std::size_t jumps = std::min(find_edges(a).size(), find_edges(b).size());
  if (jumps < 2 || jumps >= enough_jumps) return;
  result.sigma_s = std::max(result.sigma_s, interval_s / std::sqrt(6 * static_cast<double>(jumps)));
}

}  // namespace

TimeOffset find_time_offset(std::span<const SignalSample> a,
                            std::span<const SignalSample> b,
                            const TimeOffsetOptions& options) {
  check(a, "A");
  check(b, "B");
  check(options);
  const std::vector<SignalSample> one = normalized(a, "A");
  const std::vector<SignalSample> other = normalized(b, "B");
  const std::vector<SignalMatch> matches = match_signals(one, other, options.largest_s);
  check(matches);
  const SignalMatch& coarse = matches.front();
  check_frames_in_common(one, other, coarse.offset_s);

  TimeOffset result;
  result.offset_s = coarse.offset_s;
  result.correlation = coarse.correlation;
  result.next_best = matches.size() > 1 ? matches[1].correlation : 0;
  result.overlap_s = overlap_s(a, b, coarse.offset_s);
  const SignalLikelihood signals(one, other, coarse.offset_s, coarse.gain_b);
  if (signals.stretches() == 0) refuse("the cameras saw too little at one time: record longer");
  // Interpolated signals are off by a share of a frame.
  refine(signals, signals.interval_s(), result);
  refine(signals, signals.interval_s() / 4, result);
  refine_by_edges(one, other, signals.interval_s(), result);
  if (!tells_exposures(one) || !tells_exposures(other)) {
    doubt_guess(one, other, coarse.gain_b, result);
  }
  doubt_few_jumps(one, other, signals.interval_s(), result);
  if (!(result.sigma_s < signals.interval_s())) {
    refuse(only_to("change", result.sigma_s) +
           ": switch one lamp before both, often and at random, so that nothing else changes as "
           "much");
  }
  check_largest(result, options);
  return result;
}

TimeOffset find_time_offset(std::span<const SeenPoint> a,
                            std::span<const SeenPoint> b,
                            const TimeOffsetOptions& options) {
  check(a, "A");
  check(b, "B");
  check(options);
  std::vector<MotionOffset> offsets;
  for (const SignalMatch& match : match_places(a, b, options.largest_s)) {
    offsets.push_back(refine_motion_offset(a, b, match.offset_s));
  }
  std::ranges::sort(offsets, std::greater<>(), &MotionOffset::correlation);
  const auto unexplained = [](const MotionOffset& offset) {
    return 1 - offset.correlation * offset.correlation;
  };
  if (offsets.empty() || offsets[0].correlation < least_common) {
    refuse("the cameras do not show the same motion (what they may have in common correlates by " +
           std::to_string(offsets.empty() ? 0 : offsets[0].correlation).substr(0, 5) +
           " at best): move one thing before both for longer, or look for larger offsets");
  }
  check_frames_in_common(a, b, offsets[0].offset_s);
  TimeOffset result;
  result.offset_s = offsets[0].offset_s;
  result.correlation = offsets[0].correlation;
  for (const MotionOffset& other : offsets) {
    // Others may have come to the same.
    if (std::abs(other.offset_s - result.offset_s) < frames_apart * frame_interval_s(a)) continue;
    if (unexplained(other) < far_worse * unexplained(offsets[0])) {
      refuse(repeated("motion", other.offset_s - result.offset_s, "move"));
    }
    result.next_best = std::max(result.next_best, other.correlation);
  }
  result.overlap_s = overlap_s(a, b, result.offset_s);
  result.sigma_s = motion_sigma_s(a, b, result.offset_s);
  // What is alike by chance does not hold for parts of the time.
  if (!(result.sigma_s < most_sigma_frames * frame_interval_s(a))) {
    refuse(only_to("motion", result.sigma_s) +
           ": move it faster, for longer, and so that both see it all the time");
  }
  check_largest(result, options);
  return result;
}

}  // namespace calibrate
