// How likely two sampled signals are averages of one random process, at a time offset.
#include "calibrate/signal_likelihood.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "calibrate/signal_search.h"

namespace calibrate {
namespace {

constexpr double samples_of_stretch = 50;
constexpr double shortest_exposure_s = 1e-4;
// Variance of each stretch's level, in parts of the process's.
constexpr double level_variance = 10;

// Matern's covariance, averaged over two exposures: differences of its second integral
// scale^2 (slope * s + (p + q s + r s^2) exp(-s)), s = |t| / scale.
class AveragedCovariance {
 public:
  explicit AveragedCovariance(const Smoothness& smoothness) {
    static constexpr std::array<std::array<double, 4>, 3> terms{
        {{1, 1, 0, 0}, {2, 3, 1, 0}, {8.0 / 3, 5, 7.0 / 3, 1.0 / 3}}};
    const auto order = static_cast<std::size_t>(smoothness.order);
    terms_ = terms[order];
    scale_ = smoothness.scale_s / std::sqrt(static_cast<double>(2 * smoothness.order + 1));
  }

  double operator()(double apart_s, double exposure_s, double other_s) {
    const double t = std::abs(apart_s);
    if (exposure_s != exposure_s_ || other_s != other_s_) set_exposures(exposure_s, other_s);
    double sum = 0;
    if (t >= outer_) {  // most pairs: the straight parts cancel, and one exponential does
      const double near = std::exp((outer_ - t) / scale_);
      sum = near * (falls_[2] * factor(t + outer_) - falls_[1] * factor(t + inner_) -
                    falls_[0] * factor(t - inner_) + factor(t - outer_));
    } else {
      sum = bent(t + outer_) - bent(t + inner_) - bent(t - inner_) + bent(t - outer_) +
            terms_[0] / scale_ *
                (outer_ + t - (inner_ + t) - std::abs(t - inner_) + std::abs(t - outer_));
    }
    return sum * scale_ * scale_ / (exposure_s * other_s);
  }

 private:
  void set_exposures(double exposure_s, double other_s) {
    exposure_s_ = exposure_s;
    other_s_ = other_s;
    outer_ = (exposure_s + other_s) / 2;
    inner_ = std::abs(exposure_s - other_s) / 2;
    falls_ = {std::exp((inner_ - outer_) / scale_), std::exp(-(inner_ + outer_) / scale_),
              std::exp(-2 * outer_ / scale_)};
  }
  double factor(double t) const {
    const double s = t / scale_;
    return terms_[1] + s * (terms_[2] + s * terms_[3]);
  }
  double bent(double t) const { return factor(std::abs(t)) * std::exp(-std::abs(t) / scale_); }

  std::array<double, 4> terms_{};
  double scale_ = 1;
  // Of the exposures of the last pair: half their sum and difference, and by how much the process
  // falls from outer_ before a time to inner_ before and after it, and to outer_ after it.
  double exposure_s_ = 0, other_s_ = 0, outer_ = 0, inner_ = 0;
  std::array<double, 3> falls_{};
};

}  // namespace

SignalLikelihood::SignalLikelihood(std::span<const SignalSample> a,
                                   std::span<const SignalSample> b,
                                   double about_offset_s,
                                   double gain_b) {
  const double interval_a = frame_interval_s(a);
  const double interval_b = frame_interval_s(b);
  interval_s_ = std::max(interval_a, interval_b);
  const double length_s = samples_of_stretch / (1 / interval_a + 1 / interval_b);
  const double begin = std::max(a.front().time_s, b.front().time_s - about_offset_s);
  const double end = std::min(a.back().time_s, b.back().time_s - about_offset_s);
  const double count = std::max(1.0, std::round((end - begin) / length_s));
  const double step = (end - begin) / count;
  const auto part = [](std::span<const SignalSample> signal, double from, double to) {
    const auto first = std::ranges::lower_bound(signal, from, {}, &SignalSample::time_s);
    const auto last = std::ranges::lower_bound(signal, to, {}, &SignalSample::time_s);
    return std::vector<SignalSample>(first, std::max(first, last));
  };
  const auto exposed = [](std::vector<SignalSample>& samples, double interval, double gain) {
    for (SignalSample& sample : samples) {
      if (!(sample.exposure_s > 0)) sample.exposure_s = interval / 2;
      sample.exposure_s = std::max(sample.exposure_s, shortest_exposure_s);
      sample.value /= gain;
    }
  };
  for (double i = 0; i < count; ++i) {
    const double from = begin + i * step;
    Stretch stretch;
    stretch.samples = part(a, from, from + step);
    exposed(stretch.samples, interval_a, 1);
    stretch.of_a = stretch.samples.size();
    auto others = part(b, from + about_offset_s, from + step + about_offset_s);
    exposed(others, interval_b, gain_b);
    stretch.samples.insert(stretch.samples.end(), others.begin(), others.end());
    if (stretch.of_a > 2 && others.size() > 2) stretches_.push_back(std::move(stretch));
  }
}

std::vector<SignalLikelihood::Terms> SignalLikelihood::terms(const Smoothness& smoothness,
                                                             double offset_s,
                                                             std::size_t stride) const {
  AveragedCovariance covariance(smoothness);
  std::vector<Terms> all;
  for (std::size_t k = 0; k < stretches_.size(); k += stride) {
    const Stretch& stretch = stretches_[k];
    const auto n = static_cast<Eigen::Index>(stretch.samples.size());
    const auto of_a = static_cast<Eigen::Index>(stretch.of_a);
    Eigen::MatrixXd matrix(n, n);
    Eigen::VectorXd values(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const SignalSample& one = stretch.samples[static_cast<std::size_t>(i)];
      values[i] = one.value;
      const double time_s = one.time_s - (i >= of_a ? offset_s : 0);
      for (Eigen::Index j = 0; j <= i; ++j) {
        const SignalSample& other = stretch.samples[static_cast<std::size_t>(j)];
        const double other_s = other.time_s - (j >= of_a ? offset_s : 0);
        matrix(i, j) = covariance(time_s - other_s, one.exposure_s, other.exposure_s) +
                       ((i >= of_a) == (j >= of_a) ? level_variance : 0);
      }
      matrix(i, i) += smoothness.noise;
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix.selfadjointView<Eigen::Lower>());
    if (factor.info() != Eigen::Success) return {};
    all.push_back({factor.matrixL().solve(values).squaredNorm(),
                   2 * factor.matrixLLT().diagonal().array().log().sum(), static_cast<double>(n)});
  }
  return all;
}

double SignalLikelihood::log_likelihood(const Smoothness& smoothness,
                                        double offset_s,
                                        std::size_t stride) const {
  Terms sum;
  for (const Terms& of : terms(smoothness, offset_s, stride)) {
    sum.squares += of.squares;
    sum.log_determinant += of.log_determinant;
    sum.count += of.count;
  }
  if (sum.count == 0) return -std::numeric_limits<double>::infinity();
  return -0.5 * (sum.count * std::log(sum.squares / sum.count) + sum.log_determinant);
}

std::vector<double> SignalLikelihood::of_stretches(const Smoothness& smoothness,
                                                   double offset_s) const {
  const std::vector<Terms> all = terms(smoothness, offset_s, 1);
  double squares = 0;
  double count = 0;
  for (const Terms& of : all) {
    squares += of.squares;
    count += of.count;
  }
  const double variance = squares / count;
  std::vector<double> logs;
  for (const Terms& of : all) {
    logs.push_back(
        -0.5 * (of.count * (std::log(variance) - 1) + of.squares / variance + of.log_determinant));
  }
  return logs;
}

}  // namespace calibrate
