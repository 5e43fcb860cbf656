// Gauss-Newton over black level and exposures, robust.
#include "capture/black_level.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Dense>

#include "capture/median.h"

namespace capture {
namespace {

// A block's residuals, in deviations, and their derivatives, once its light is chosen best.
struct BlockResiduals {
  Eigen::VectorXd values;
  Eigen::MatrixXd jacobian;  // (levels of the block, black and exposures)
  double freedom = 0;
};

BlockResiduals residuals_of(const std::vector<BlockMean>& block,
                            const Eigen::VectorXd& p,
                            std::span<const double> claimed_s) {
  const auto count = static_cast<Eigen::Index>(block.size());
  BlockResiduals r{Eigen::VectorXd(count), Eigen::MatrixXd::Zero(count, p.size()), 0};
  Eigen::VectorXd exposure(count);  // in deviations of the mean
  for (Eigen::Index i = 0; i < count; ++i) {
    const BlockMean& mean = block[static_cast<std::size_t>(i)];
    const auto level = static_cast<Eigen::Index>(mean.level);
    exposure[i] = claimed_s[mean.level] > 0 ? std::exp(p[1 + level]) / mean.sigma : 0;
    r.values[i] = (mean.code - p[0]) / mean.sigma;
    r.jacobian(i, 0) = -1 / mean.sigma;
  }
  r.freedom = static_cast<double>(count);
  const double square = exposure.squaredNorm();
  if (!(square > 0)) return r;
  r.freedom -= 1;
  const double light = exposure.dot(r.values) / square;
  r.values -= exposure * light;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto level = static_cast<Eigen::Index>(block[static_cast<std::size_t>(i)].level);
    r.jacobian(i, 1 + level) = -exposure[i] * light;
  }
  // Kaufman's approximation: the derivatives without what another light would undo.
  r.jacobian -= exposure * (exposure.transpose() * r.jacobian) / square;
  return r;
}

// Of chi-square over its degrees of freedom (Wilson and Hilferty, PNAS 17, 1931).
double median_of_chi_squared(double freedom) { return std::pow(1 - 2 / (9 * freedom), 3); }

}  // namespace

BlackFit fit_black_level(const std::vector<std::vector<BlockMean>>& blocks,
                         std::span<const double> claimed_s,
                         double exposure_error) {
  const auto size = static_cast<Eigen::Index>(claimed_s.size()) + 1;
  Eigen::VectorXd claimed = Eigen::VectorXd::Zero(size);
  for (std::size_t i = 0; i < claimed_s.size(); ++i) {
    claimed[static_cast<Eigen::Index>(i) + 1] = claimed_s[i] > 0 ? std::log(claimed_s[i]) : 0;
  }
  Eigen::VectorXd p = claimed;
  p[0] = std::numeric_limits<double>::infinity();
  for (const std::vector<BlockMean>& block : blocks) {
    for (const BlockMean& mean : block) p[0] = std::min(p[0], mean.code);
  }
  if (!std::isfinite(p[0])) return {};
  Eigen::MatrixXd matrix(size, size);
  double spread = 1;
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    matrix.setZero();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    matrix.diagonal().array() += 1 / (exposure_error * exposure_error);
    gradient += (p - claimed) / (exposure_error * exposure_error);
    matrix(0, 0) = 1e-12;  // nothing is known of black before
    gradient[0] = 0;
    std::vector<double> spreads;
    for (const std::vector<BlockMean>& block : blocks) {
      const BlockResiduals r = residuals_of(block, p, claimed_s);
      if (!(r.freedom > 0)) continue;
      const double chi_squared = r.values.squaredNorm() / r.freedom;
      spreads.push_back(chi_squared / median_of_chi_squared(r.freedom));
      constexpr double width_squared = 9;
      const double scaled = chi_squared / (spread * spread);
      const double weight = 1 / (1 + scaled / width_squared) / (spread * spread);
      matrix += weight * r.jacobian.transpose() * r.jacobian;
      gradient += weight * r.jacobian.transpose() * r.values;
    }
    if (spreads.empty()) return {};
    const Eigen::VectorXd step = matrix.ldlt().solve(gradient);
    constexpr double longest_step = 0.5;
    p[0] -= step[0];
    p.tail(size - 1) -= step.tail(size - 1).cwiseMax(-longest_step).cwiseMin(longest_step);
    const double next = std::max(1.0, std::sqrt(median_in_place(spreads)));
    const bool settled = step.cwiseAbs().maxCoeff() < 1e-6 && std::abs(next - spread) < 1e-3;
    spread = next;
    if (settled) break;
  }
  BlackFit fit;
  const Eigen::MatrixXd covariance = matrix.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
  fit.black = {p[0], std::sqrt(std::max(0.0, covariance(0, 0)))};
  for (Eigen::Index i = 1; i < size; ++i) fit.log_exposures.push_back(p[i]);
  return fit;
}

}  // namespace capture
