// Where two signals, or the places of one thing in two pictures, go alike: roughly, everywhere.
#include "calibrate/signal_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include <Eigen/Dense>

namespace calibrate {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double step_s = 0.01;
constexpr std::size_t most_matches = 8;
// Part of the shorter course that must be in common.
constexpr double least_overlap = 0.4;
// A stretch in which little happens correlates with anything. In parts of the whole course's.
constexpr double least_variance = 0.1;
// Variance, in parts of all, of which a direction has no less: two directions in which hardly
// anything moves would correlate best.
constexpr double noise_share = 1e-3;

Vector2d value_of(const SignalSample& sample) { return {sample.value, 0}; }
Vector2d value_of(const SeenPoint& point) { return {point.q.x, point.q.y}; }

template <class Sample>
double interval_of(std::span<const Sample> samples) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps_s.push_back(samples[i].time_s - samples[i - 1].time_s);
  }
  const auto low = steps_s.begin() + static_cast<std::ptrdiff_t>(steps_s.size() / 4);
  std::ranges::nth_element(steps_s, low);
  return *low;
}

// Evenly resampled, with mean 0.
struct Course {
  double begin_s = 0;
  std::vector<double> x, y;  // NaN in gaps
  double variance = 0;       // of both
  double seen = 0;           // steps that are not in gaps

  template <class Sample>
  explicit Course(std::span<const Sample> samples) : begin_s(samples.front().time_s) {
    const double gap_s = gap_frames * interval_of(samples);
    const auto steps = static_cast<std::size_t>((samples.back().time_s - begin_s) / step_s) + 1;
    Vector2d sum = Vector2d::Zero();
    double squares = 0;
    for (std::size_t i = 0, k = 0; i < steps; ++i) {
      const double t = begin_s + static_cast<double>(i) * step_s;
      while (k + 2 < samples.size() && samples[k + 1].time_s <= t) ++k;
      const double apart_s = samples[k + 1].time_s - samples[k].time_s;
      const double f = (t - samples[k].time_s) / apart_s;
      // From the first one on, so that squares lose no digits.
      const Vector2d value =
          (1 - f) * value_of(samples[k]) + f * value_of(samples[k + 1]) - value_of(samples.front());
      const bool gap = apart_s > gap_s;
      x.push_back(gap ? std::numeric_limits<double>::quiet_NaN() : value.x());
      y.push_back(gap ? std::numeric_limits<double>::quiet_NaN() : value.y());
      if (gap) continue;
      sum += value;
      squares += value.squaredNorm();
      seen += 1;
    }
    if (seen == 0) return;
    variance = squares / seen - sum.squaredNorm() / (seen * seen);
    for (double& value : x) value -= sum.x() / seen;
    for (double& value : y) value -= sum.y() / seen;
  }
};

// Of what both saw.
struct Covariances {
  Matrix2d aa, bb, ab;
};

// B's first step lying `shift` steps after A's. Nothing if they have too little in common.
std::optional<Covariances> covariances_at(const Course& a, const Course& b, std::ptrdiff_t shift) {
  const auto begin = std::max<std::ptrdiff_t>(0, shift);
  const auto end = std::min(std::ssize(a.x), std::ssize(b.x) + shift);
  double n = 0;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    const auto in_a = static_cast<std::size_t>(i);
    const auto in_b = static_cast<std::size_t>(i - shift);
    if (std::isnan(a.x[in_a]) || std::isnan(b.x[in_b])) continue;
    const Eigen::Vector4d both(a.x[in_a], a.y[in_a], b.x[in_b], b.y[in_b]);
    sum += both;
    products.noalias() += both * both.transpose();
    n += 1;
  }
  if (n < 1 || n < least_overlap * std::min(a.seen, b.seen)) return std::nullopt;
  const Eigen::Matrix4d all = products / n - sum * sum.transpose() / (n * n);
  const Covariances c{all.topLeftCorner<2, 2>(), all.bottomRightCorner<2, 2>(),
                      all.topRightCorner<2, 2>()};
  if (!(c.aa.trace() > least_variance * a.variance) ||
      !(c.bb.trace() > least_variance * b.variance)) {
    return std::nullopt;
  }
  return c;
}

Matrix2d whitening(const Matrix2d& covariance) {
  const Matrix2d noisy = covariance + noise_share * covariance.trace() * Matrix2d::Identity();
  return Eigen::SelfAdjointEigenSolver<Matrix2d>(noisy).operatorInverseSqrt();
}

double canonical_correlation(const Covariances& c) {
  const Matrix2d both = whitening(c.aa) * c.ab * whitening(c.bb);
  return Eigen::JacobiSVD<Matrix2d>(both).singularValues()[0];
}

double plain_correlation(const Covariances& c) {
  return c.ab(0, 0) / std::sqrt(c.aa(0, 0) * c.bb(0, 0));
}

std::vector<SignalMatch> match(const Course& a,
                               const Course& b,
                               double largest_s,
                               double (*correlation)(const Covariances&)) {
  // b's first sample lies begin - offset after a's.
  const double begin_s = b.begin_s - a.begin_s;
  const auto count = static_cast<std::ptrdiff_t>(largest_s / step_s);
  const auto middle = static_cast<std::ptrdiff_t>(std::lround(begin_s / step_s));
  std::vector<double> heights;
  std::vector<double> gains;
  for (std::ptrdiff_t i = -count; i <= count; ++i) {
    const auto c = covariances_at(a, b, middle - i);
    heights.push_back(c ? correlation(*c) : 0);
    gains.push_back(c ? std::sqrt(c->bb.trace() / c->aa.trace()) : 1);
  }
  std::vector<SignalMatch> matches;
  std::vector<bool> taken(heights.size());
  while (matches.size() < most_matches) {
    std::size_t best = heights.size();
    for (std::size_t i = 0; i < heights.size(); ++i) {
      if (!taken[i] && heights[i] > 0 && (best == heights.size() || heights[i] > heights[best])) {
        best = i;
      }
    }
    if (best == heights.size()) break;
    matches.push_back(
        {(static_cast<double>(best) - static_cast<double>(count + middle)) * step_s + begin_s,
         heights[best], gains[best]});
    // Down both flanks: what rises again beyond is another.
    std::size_t left = best;
    std::size_t right = best;
    while (left > 0 && heights[left - 1] <= heights[left]) --left;
    while (right + 1 < heights.size() && heights[right + 1] <= heights[right]) ++right;
    std::fill(taken.begin() + static_cast<std::ptrdiff_t>(left),
              taken.begin() + static_cast<std::ptrdiff_t>(right) + 1, true);
  }
  return matches;
}

}  // namespace

std::vector<SignalMatch> match_signals(std::span<const SignalSample> a,
                                       std::span<const SignalSample> b,
                                       double largest_s) {
  return match(Course(a), Course(b), largest_s, plain_correlation);
}

std::vector<SignalMatch> match_places(std::span<const SeenPoint> a,
                                      std::span<const SeenPoint> b,
                                      double largest_s) {
  return match(Course(a), Course(b), largest_s, canonical_correlation);
}

double frame_interval_s(std::span<const SignalSample> signal) { return interval_of(signal); }
double frame_interval_s(std::span<const SeenPoint> points) { return interval_of(points); }

}  // namespace calibrate
