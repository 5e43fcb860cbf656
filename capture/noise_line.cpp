// Photon transfer's line: robust groups, weighted least squares.
#include "capture/noise_line.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>

#include <Eigen/Dense>

#include "capture/median.h"
#include "capture/photon_transfer.h"

namespace capture {
namespace {

using std::numbers::pi;

// What rounding makes of the variance of a difference's halves: with D the difference of two
// values in steps and f its fraction, the steps' difference has the mean square D^2 + f (1 - f)
// over all places of the steps; f (1 - f) = 1/6 - sum cos(2 pi k D) / (pi k)^2.
double variance_after_rounding(double variance) {
  double waves = 0;
  for (int k = 1; k <= 50; ++k) {
    const double wave = std::exp(-4 * pi * pi * k * k * variance) / (pi * pi * k * k);
    waves += wave;
    if (wave < 1e-9) break;
  }
  return variance + 1.0 / 12 - waves / 2;
}

struct Group {
  double mean = 0;
  double variance = 0;  // rounding taken off
  double count = 0;     // degrees of freedom behind it
  double growth = 1;    // seen variance by the sensor's: by it rounding's errors are magnified
  double seen = 0;
};

// The mean of those variances that are not outliers: beyond 7 deviations of a normal spread, where
// a chi-square's own tail does not reach.
bool group_of(std::span<const NoisePoint> points, Group& group) {
  constexpr double far = 7;
  std::vector<double> values;
  for (const NoisePoint& point : points) values.push_back(point.variance);
  const double centre = median_in_place(values);
  for (double& value : values) value = std::abs(value - centre);
  constexpr double least_variance = 1.0 / 12;
  const double spread =
      std::max(sigma_by_median * median_in_place(values),
               std::max(centre, least_variance) * std::sqrt(2 / points.front().freedom));
  double weights = 0;
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const NoisePoint& point : points) {
    if (std::abs(point.variance - centre) > far * spread) continue;
    weights += point.freedom;
    group.mean += point.mean * point.freedom;
    group.seen += point.variance * point.freedom;
    lowest = std::min(lowest, point.mean);
    highest = std::max(highest, point.mean);
  }
  if (!(weights > 0)) return false;
  group.mean /= weights;
  group.seen /= weights;
  group.count = weights;
  group.variance = variance_before_rounding(group.seen);
  const double step = 0.01 + 0.05 * group.variance;
  group.growth = step / (variance_after_rounding(group.variance + step) -
                         variance_after_rounding(group.variance));
  // Steps must lie anywhere between the values: noise of half a code, or values a code apart.
  constexpr double blurred = 0.2;
  return group.variance >= blurred || highest - lowest >= 1;
}

std::vector<Group> groups_of(std::vector<NoisePoint>& points) {
  constexpr std::size_t least_points = 10;
  constexpr std::size_t most_groups = 64;
  std::sort(points.begin(), points.end(),
            [](const NoisePoint& a, const NoisePoint& b) { return a.mean < b.mean; });
  const std::size_t count = std::min(most_groups, points.size() / least_points);
  std::vector<Group> groups;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = points.size() * i / count;
    const std::size_t last = points.size() * (i + 1) / count;
    Group group;
    if (group_of(std::span(points).subspan(first, last - first), group)) groups.push_back(group);
  }
  return groups;
}

// Weighted least squares of a polynomial of `terms` terms in mean / scale.
struct Polynomial {
  Eigen::VectorXd terms;
  Eigen::MatrixXd covariance;
};

Polynomial fit_polynomial(std::span<const Group> groups, int terms, double scale) {
  Polynomial fit{Eigen::VectorXd::Zero(terms), {}};
  std::vector<double> expected;
  for (const Group& group : groups) expected.push_back(group.seen);
  constexpr int rounds = 4;  // weights follow from the fitted variances
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(terms, terms);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(terms);
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const Group& group = groups[i];
      const double sigma = expected[i] * std::sqrt(2 / group.count) * group.growth;
      Eigen::VectorXd row(terms);
      for (int t = 0; t < terms; ++t) row[t] = std::pow(group.mean / scale, t) / sigma;
      matrix += row * row.transpose();
      right += row * (group.variance / sigma);
    }
    const auto solver = matrix.ldlt();
    fit.terms = solver.solve(right);
    fit.covariance = solver.solve(Eigen::MatrixXd::Identity(terms, terms));
    double chi_squared = 0;
    for (std::size_t i = 0; i < groups.size(); ++i) {
      double value = 0;
      for (int t = terms - 1; t >= 0; --t) value = value * groups[i].mean / scale + fit.terms[t];
      const double sigma = expected[i] * std::sqrt(2 / groups[i].count) * groups[i].growth;
      chi_squared += std::pow((groups[i].variance - value) / sigma, 2);
      constexpr double least_share = 0.1;
      expected[i] = std::max(variance_after_rounding(std::max(0.0, value)),
                             least_share * groups[i].seen + 1e-4);
    }
    // What the groups spread beyond their chi-square is error as well.
    const double freedom = std::max(1.0, static_cast<double>(groups.size()) - terms);
    fit.covariance *= std::max(1.0, chi_squared / freedom);
  }
  return fit;
}

}  // namespace

double variance_before_rounding(double variance) {
  double low = 0;
  double high = std::max(variance, 0.0);
  constexpr int halvings = 50;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (low + high) / 2;
    (variance_after_rounding(middle) < variance ? low : high) = middle;
  }
  return (low + high) / 2;
}

double NoiseLine::sigma(double mean) const {
  return std::sqrt(
      std::max(0.0, covariance[0] + 2 * mean * covariance[1] + mean * mean * covariance[2]));
}

NoiseLine fit_noise_line(std::vector<NoisePoint> points) {
  NoiseLine line;
  line.covariance[2] = std::numeric_limits<double>::infinity();
  const std::vector<Group> groups = groups_of(points);
  constexpr std::size_t least_groups = 4;
  if (groups.size() < least_groups) return line;
  line.highest_mean = groups.back().mean;
  const double scale = std::max(1.0, line.highest_mean);
  const Polynomial straight = fit_polynomial(groups, 2, scale);
  line.at_zero = straight.terms[0];
  line.slope = straight.terms[1] / scale;
  line.covariance = {straight.covariance(0, 0), straight.covariance(0, 1) / scale,
                     straight.covariance(1, 1) / (scale * scale)};
  const Polynomial bent = fit_polynomial(groups, 3, scale);
  const double at_top = std::max(line.variance(line.highest_mean), 1e-9);
  line.bend = bent.terms[2] / at_top;
  line.bend_sigma = std::sqrt(bent.covariance(2, 2)) / at_top;
  return line;
}

}  // namespace capture
