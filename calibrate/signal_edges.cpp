// Jumps of a signal, as of a lamp that is switched, and the time offset that they tell.
#include "calibrate/signal_edges.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/median.h"

namespace calibrate {
namespace {

constexpr double least_jump = 8;   // in standard deviations of the noise
constexpr double most_unrest = 4;  // between frames of one level
constexpr double least_sigma_s = 1e-5;
constexpr std::size_t fewest_pairs = 4;
// Where so little of an exposure's ends is hidden by noise, shares tell whether they are alike.
constexpr double tells_share = 0.1;
// Share of edges that are something else.
constexpr double wrong_share = 0.02;

// Of one frame, by the median of what changes from frame to frame, but at least 1e-4 of the range.
double noise_of(std::span<const SignalSample> signal) {
  std::vector<double> steps;
  double low = signal.front().value;
  double high = low;
  for (std::size_t i = 1; i < signal.size(); ++i) {
    steps.push_back(std::abs(signal[i].value - signal[i - 1].value));
    low = std::min(low, signal[i].value);
    high = std::max(high, signal[i].value);
  }
  return std::max(capture::median_in_place(steps) / (0.6745 * std::numbers::sqrt2),
                  1e-4 * (high - low));
}

// The integral of the normal distribution's integral: where two limits meet, smoothed.
double ramp(double x, double sigma) {
  const double z = x / sigma;
  if (z > 8) return x;
  if (z < -8) return 0;
  return x * 0.5 * std::erfc(-z / std::numbers::sqrt2) +
         sigma * std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
}

struct EdgePair {
  SignalEdge a;
  SignalEdge b;

  // Of the offset being this, per second.
  double density(double offset_s) const {
    const double sigma = std::hypot(a.sigma_s, b.sigma_s);
    // Moments without a gap between their limits still have some length.
    const double width_a = std::max(a.high_s - a.low_s, 0.1 * sigma);
    const double width_b = std::max(b.high_s - b.low_s, 0.1 * sigma);
    const double middle = (b.low_s + b.high_s - a.low_s - a.high_s) / 2;
    const double outer = (width_a + width_b) / 2;
    const double inner = std::abs(width_a - width_b) / 2;
    const double x = offset_s - middle;
    return (ramp(x + outer, sigma) - ramp(x + inner, sigma) - ramp(x - inner, sigma) +
            ramp(x - outer, sigma)) /
           (width_a * width_b);
  }
};

double middle_of(const SignalEdge& edge) { return (edge.low_s + edge.high_s) / 2; }

std::vector<EdgePair> pairs_of(std::span<const SignalEdge> a,
                               std::span<const SignalEdge> b,
                               double about_s,
                               double reach_s) {
  std::vector<EdgePair> pairs;
  for (const SignalEdge& edge : a) {
    const SignalEdge* nearest = nullptr;
    double least = reach_s;
    for (const SignalEdge& other : b) {
      const double apart = std::abs(middle_of(other) - middle_of(edge) - about_s) -
                           (edge.high_s - edge.low_s + other.high_s - other.low_s) / 2;
      if (other.rising != edge.rising || apart > least) continue;
      least = apart;
      nearest = &other;
    }
    if (nearest != nullptr) pairs.push_back({edge, *nearest});
  }
  return pairs;
}

}  // namespace

std::vector<SignalEdge> find_edges(std::span<const SignalSample> signal) {
  std::vector<SignalEdge> edges;
  if (signal.size() < 4) return edges;
  const double noise = noise_of(signal);
  const auto level = [&](std::size_t i) { return (signal[i].value + signal[i + 1].value) / 2; };
  const auto calm = [&](std::size_t i) {
    return std::abs(signal[i + 1].value - signal[i].value) < most_unrest * noise;
  };
  for (std::size_t i = 0; i + 3 < signal.size(); ++i) {
    if (!calm(i)) continue;
    const double before = level(i);
    const SignalSample& last = signal[i + 1];
    // The new level begins with the next frame, or with the one after, which is then neither.
    const bool straight = calm(i + 2);
    const std::size_t next = straight ? i + 2 : i + 3;
    if (next + 1 >= signal.size() || !calm(next)) continue;
    const double jump = level(next) - before;
    if (std::abs(jump) < least_jump * noise) continue;
    const SignalSample& first = signal[next];
    const double noise_share = noise / std::abs(jump);
    // What a calm frame may hide of the other level.
    const double hidden = most_unrest * noise_share;
    SignalEdge edge{last.time_s + (0.5 - hidden) * last.exposure_s,
                    first.time_s - (0.5 - hidden) * first.exposure_s,
                    std::max(least_sigma_s, noise_share * last.exposure_s),
                    jump > 0,
                    {}};
    if (!straight) {
      const SignalSample& between = signal[i + 2];
      const double share = (between.value - before) / jump;
      // Neither the old level, with the jump still to come, nor off the way to the new one.
      if (std::abs(between.value - before) < most_unrest * noise || share < 0 || share > 1)
        continue;
      if (between.exposure_s > 0) {
        if (hidden < tells_share) edge.share = share;
        edge.low_s = edge.high_s = between.time_s + (0.5 - share) * between.exposure_s;
        edge.sigma_s = std::max(least_sigma_s, 1.3 * noise_share * between.exposure_s);
      }
    }
    if (edge.high_s >= edge.low_s) edges.push_back(edge);
  }
  return edges;
}

bool are_in_step(std::span<const SignalEdge> edges) {
  constexpr double fewest = 6;
  constexpr double most_apart = 0.1;  // standard deviation; at random it is .29
  double count = 0, sum = 0, squares = 0;
  for (const SignalEdge& edge : edges) {
    if (!edge.share) continue;
    count += 1, sum += *edge.share, squares += *edge.share * *edge.share;
  }
  if (count < fewest) return false;
  const double mean = sum / count;
  return squares / count - mean * mean < most_apart * most_apart;
}

std::optional<EdgeOffset> offset_of_edges(std::span<const SignalEdge> a,
                                          std::span<const SignalEdge> b,
                                          double about_s,
                                          double reach_s) {
  const std::vector<EdgePair> pairs = pairs_of(a, b, about_s, reach_s);
  if (pairs.size() < fewest_pairs) return std::nullopt;
  constexpr std::size_t steps = 2001;
  const double wrong = wrong_share / (2 * reach_s);
  const auto offset_at = [&](std::size_t i) {
    return about_s + reach_s * (2 * static_cast<double>(i) / (steps - 1) - 1);
  };
  std::vector<double> logs(steps, 0.0);
  for (std::size_t i = 0; i < steps; ++i) {
    for (const EdgePair& pair : pairs) logs[i] += std::log(wrong + pair.density(offset_at(i)));
  }
  const double highest = *std::ranges::max_element(logs);
  double sum = 0, first = 0, second = 0;
  for (std::size_t i = 0; i < steps; ++i) {
    const double p = std::exp(logs[i] - highest);
    const double x = offset_at(i) - about_s;
    sum += p;
    first += p * x;
    second += p * x * x;
  }
  EdgeOffset result;
  result.pairs = pairs.size();
  const double mean = first / sum;
  result.offset_s = about_s + mean;
  const double grid_s = 2 * reach_s / (steps - 1);
  result.sigma_s = std::sqrt(std::max(second / sum - mean * mean, 0.0) + grid_s * grid_s / 12);
  for (const EdgePair& pair : pairs) {
    const double middle = middle_of(pair.b) - middle_of(pair.a);
    const double reach = (pair.a.high_s - pair.a.low_s + pair.b.high_s - pair.b.low_s) / 2 +
                         4 * std::hypot(pair.a.sigma_s, pair.b.sigma_s, result.sigma_s);
    if (std::abs(result.offset_s - middle) < reach) {
      result.agreeing += 1 / static_cast<double>(pairs.size());
    }
  }
  return result;
}

}  // namespace calibrate
