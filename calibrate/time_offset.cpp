// By how much one camera's clock is ahead of another's, from something that both saw change.
#include "calibrate/time_offset.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "calibrate/signal_edges.h"
#include "calibrate/signal_likelihood.h"

namespace calibrate {
namespace {

constexpr std::size_t fewest_frames = 20;
// Part of the shorter signal that must be in common.
constexpr double least_overlap = 0.4;
constexpr double least_correlation = 0.4;
// Correlation elsewhere, in parts of the best, at which the signals repeat themselves.
constexpr double repeats_itself = 0.9;

[[noreturn]] void refuse(const std::string& why) { throw std::runtime_error(why); }

void check(std::span<const SignalSample> signal, const char* name) {
  for (std::size_t i = 0; i < signal.size(); ++i) {
    if (!std::isfinite(signal[i].time_s) || !std::isfinite(signal[i].value) ||
        !std::isfinite(signal[i].exposure_s)) {
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
           " saw: switch a lamp on and off before both, at random, or move something");
  }
  std::vector<SignalSample> result(signal.begin(), signal.end());
  for (SignalSample& s : result) s.value = (s.value - mean) / std::sqrt(variance);
  return result;
}

// Straight between samples.
double value_at(std::span<const SignalSample> signal, double time_s) {
  const auto after = std::ranges::upper_bound(signal, time_s, {}, &SignalSample::time_s);
  if (after == signal.begin()) return signal.front().value;
  if (after == signal.end()) return signal.back().value;
  const SignalSample& before = *(after - 1);
  const double f = (time_s - before.time_s) / (after->time_s - before.time_s);
  return before.value + f * (after->value - before.value);
}

std::vector<double> resampled(std::span<const SignalSample> signal, double step_s) {
  const double length_s = signal.back().time_s - signal.front().time_s;
  std::vector<double> values(static_cast<std::size_t>(length_s / step_s) + 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = value_at(signal, signal.front().time_s + static_cast<double>(i) * step_s);
  }
  return values;
}

// The correlation of a with b, b's first sample lying `shift` steps after a's.
double correlation_at(std::span<const double> a, std::span<const double> b, std::ptrdiff_t shift) {
  const auto begin = std::max<std::ptrdiff_t>(0, shift);
  const auto end = std::min(std::ssize(a), std::ssize(b) + shift);
  if (end - begin < static_cast<std::ptrdiff_t>(
                        least_overlap * static_cast<double>(std::min(a.size(), b.size())))) {
    return 0;
  }
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    const double x = a[static_cast<std::size_t>(i)];
    const double y = b[static_cast<std::size_t>(i - shift)];
    sa += x;
    sb += y;
    saa += x * x;
    sbb += y * y;
    sab += x * y;
  }
  const auto n = static_cast<double>(end - begin);
  // A stretch in which little happens correlates with anything.
  constexpr double least_variance = 0.1;
  const double va = saa / n - sa * sa / (n * n);
  const double vb = sbb / n - sb * sb / (n * n);
  if (va < least_variance || vb < least_variance) return 0;
  return (sab / n - sa * sb / (n * n)) / std::sqrt(va * vb);
}

struct Coarse {
  double offset_s = 0;
  double correlation = 0;  // signed
  double next_best = 0;
  double next_offset_s = 0;
};

Coarse search_coarsely(std::span<const SignalSample> a,
                       std::span<const SignalSample> b,
                       const TimeOffsetOptions& options) {
  constexpr double step_s = 0.01;
  const std::vector<double> fine_a = resampled(a, step_s);
  const std::vector<double> fine_b = resampled(b, step_s);
  // b's first sample lies begin - offset after a's.
  const double begin_s = b.front().time_s - a.front().time_s;
  const auto count = static_cast<std::ptrdiff_t>(options.largest_s / step_s);
  const auto middle = static_cast<std::ptrdiff_t>(std::lround(begin_s / step_s));
  const double rest_s = begin_s - static_cast<double>(middle) * step_s;
  std::vector<double> correlations;
  for (std::ptrdiff_t i = -count; i <= count; ++i) {
    correlations.push_back(correlation_at(fine_a, fine_b, middle - i));
  }
  const auto height = [&](double c) { return options.any_sign ? std::abs(c) : c; };
  const auto best = std::ranges::max_element(correlations, {}, height);
  const auto offset_of = [&](auto at) {
    return static_cast<double>(at - correlations.begin() - count) * step_s + rest_s;
  };
  Coarse coarse{offset_of(best), *best, 0, 0};
  // Down both flanks of the best: what rises again beyond is another.
  auto left = best;
  auto right = best;
  while (left != correlations.begin() && height(*(left - 1)) <= height(*left)) --left;
  while (right + 1 != correlations.end() && height(*(right + 1)) <= height(*right)) ++right;
  for (auto at = correlations.begin(); at != correlations.end(); ++at) {
    if (at >= left && at <= right) continue;
    if (height(*at) <= coarse.next_best) continue;
    coarse.next_best = height(*at);
    coarse.next_offset_s = offset_of(at);
  }
  return coarse;
}

void check(const Coarse& coarse) {
  const double best = std::abs(coarse.correlation);
  if (best < least_correlation) {
    refuse("the cameras do not show the same change (their signals correlate by " +
           std::to_string(best).substr(0, 4) +
           " at best): let one lamp or one motion be the largest change in both, or look for "
           "larger offsets");
  }
  if (coarse.next_best > repeats_itself * best) {
    const double every_ms = 1000 * std::abs(coarse.next_offset_s - coarse.offset_s);
    refuse("the change repeats itself every " + std::to_string(std::lround(every_ms)) +
           " ms or so, so that the offset could be off by that: flash or move at random, or look "
           "for smaller offsets");
  }
}

// The place of the greatest value between two bounds.
double maximize(double low, double high, double tolerance, const std::function<double(double)>& f) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double x1 = high - golden * (high - low);
  double x2 = low + golden * (high - low);
  double f1 = f(x1);
  double f2 = f(x2);
  while (high - low > tolerance) {
    if (f1 >= f2) {
      high = x2;
      x2 = x1;
      f2 = f1;
      x1 = high - golden * (high - low);
      f1 = f(x1);
    } else {
      low = x1;
      x1 = x2;
      f1 = f2;
      x2 = low + golden * (high - low);
      f2 = f(x2);
    }
  }
  return (low + high) / 2;
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

// A lamp's switching tells more than its covariance.
void refine_by_edges(std::span<const SignalSample> a,
                     std::span<const SignalSample> b,
                     bool mirrored,
                     double interval_s,
                     TimeOffset& result) {
  // Without exposures, frames tell of a jump only which two it lies between; at equal rates their
  // limits then all lie in step, and promise more than they hold.
  const auto tells_exposure = [](const SignalSample& sample) { return sample.exposure_s > 0; };
  if (std::ranges::none_of(a, tells_exposure) || std::ranges::none_of(b, tells_exposure)) return;
  std::vector<SignalEdge> edges_b = find_edges(b);
  for (SignalEdge& edge : edges_b) edge.rising = edge.rising != mirrored;
  const double reach_s = 0.75 * interval_s;
  const auto found = offset_of_edges(find_edges(a), edges_b, result.offset_s, reach_s);
  // Exposures other than told, or other changes, would show.
  constexpr double enough_agree = 0.85;
  constexpr std::size_t enough_pairs = 10;
  if (!found || found->agreeing < enough_agree || found->pairs < enough_pairs) return;
  result.offset_s = found->offset_s;
  result.sigma_s = found->sigma_s;
  result.edges = found->pairs;
}

}  // namespace

std::vector<SignalSample> along_main_axis(std::span<const SeenPoint> points) {
  Vec2 mean;
  const double share = 1 / static_cast<double>(points.size());
  for (const SeenPoint& point : points) {
    mean.x += share * point.q.x;
    mean.y += share * point.q.y;
  }
  double xx = 0, xy = 0, yy = 0;
  for (const SeenPoint& point : points) {
    const double x = point.q.x - mean.x;
    const double y = point.q.y - mean.y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  const double angle = std::atan2(2 * xy, xx - yy) / 2;
  std::vector<SignalSample> signal;
  for (const SeenPoint& point : points) {
    signal.push_back(
        {point.time_s,
         (point.q.x - mean.x) * std::cos(angle) + (point.q.y - mean.y) * std::sin(angle),
         point.exposure_s});
  }
  return signal;
}

TimeOffset find_time_offset(std::span<const SignalSample> a,
                            std::span<const SignalSample> b,
                            const TimeOffsetOptions& options) {
  check(a, "A");
  check(b, "B");
  if (!(options.largest_s > 0) || !std::isfinite(options.largest_s)) {
    throw std::invalid_argument("the largest offset must be above 0 and finite");
  }
  const std::vector<SignalSample> one = normalized(a, "A");
  const std::vector<SignalSample> other = normalized(b, "B");
  const Coarse coarse = search_coarsely(one, other, options);
  check(coarse);

  TimeOffset result;
  result.offset_s = coarse.offset_s;
  result.correlation = std::abs(coarse.correlation);
  result.next_best = coarse.next_best;
  result.overlap_s = std::min(a.back().time_s, b.back().time_s - coarse.offset_s) -
                     std::max(a.front().time_s, b.front().time_s - coarse.offset_s);
  const SignalLikelihood signals(one, other, coarse.offset_s, coarse.correlation > 0 ? 1 : -1);
  if (signals.stretches() == 0) refuse("the cameras saw too little at one time: record longer");
  // Interpolated signals are off by a share of a frame.
  refine(signals, signals.interval_s(), result);
  refine(signals, signals.interval_s() / 4, result);
  refine_by_edges(one, other, coarse.correlation < 0, signals.interval_s(), result);
  return result;
}

}  // namespace calibrate
