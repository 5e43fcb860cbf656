// The rotation of a camera whose position is known, or whose sights are far away.
#include "calibrate/rotation_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>

#include <Eigen/Dense>

#include "calibrate/track.h"
#include "capture/median.h"

namespace calibrate {
namespace {

// Sine of the angle between two directions that tell a rotation.
constexpr double least_sine = 0.02;
constexpr std::size_t most_pairs = 1000;
// Standard deviations beyond which a direction is wrong.
constexpr double wrong_beyond_spread = 4;
// Seeds carry two directions' errors on to all others, enlarged.
constexpr double seed_loss_rad = 5;
// Median of a two-dimensional error's length in standard deviations along one axis.
constexpr double median_length = 1.1774;

double angle_between(Vec3 a, Vec3 b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

// In expected errors.
double residual(const SeenDirection& d, const Mat3& R) {
  return angle_between(d.v_cam, R * d.v_set) / d.sigma_rad;
}

// The rotation that brings the directions together best; nothing if they leave it open.
std::optional<Mat3> solve_wahba(std::span<const SeenDirection> directions,
                                std::span<const double> weights) {
  Eigen::Matrix3d b = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const SeenDirection& d = directions[i];
    b += weights[i] / (d.sigma_rad * d.sigma_rad) *
         Eigen::Vector3d(d.v_cam.x, d.v_cam.y, d.v_cam.z) *
         Eigen::RowVector3d(d.v_set.x, d.v_set.y, d.v_set.z);
  }
  Eigen::Matrix4d k;  // x, y, z, w
  k.topLeftCorner<3, 3>() = b + b.transpose() - b.trace() * Eigen::Matrix3d::Identity();
  k.topRightCorner<3, 1>() << b(2, 1) - b(1, 2), b(0, 2) - b(2, 0), b(1, 0) - b(0, 1);
  k.bottomLeftCorner<1, 3>() = k.topRightCorner<3, 1>().transpose();
  k(3, 3) = b.trace();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> axes(k);
  const Eigen::Vector4d values = axes.eigenvalues();
  if (!(values[3] - values[2] > 1e-9 * values[3])) return std::nullopt;
  const Eigen::Vector4d q = axes.eigenvectors().col(3);
  return rotation_of({q[3], q[0], q[1], q[2]});
}

// The sum of Cauchy's losses.
double cost_of(std::span<const SeenDirection> directions, const Mat3& R) {
  double cost = 0;
  for (const SeenDirection& d : directions) {
    const double r = residual(d, R) / seed_loss_rad;
    cost += std::log1p(r * r);
  }
  return cost;
}

std::optional<Mat3> best_of_pairs(std::span<const SeenDirection> directions) {
  std::optional<Mat3> best;
  double least = std::numeric_limits<double>::infinity();
  const auto attempt = [&](const SeenDirection& a, const SeenDirection& b) {
    if (length(cross(a.v_set, b.v_set)) < least_sine) return;
    const std::array pair{a, b};
    const auto R = solve_wahba(pair, std::array{1.0, 1.0});
    if (!R) return;
    const double cost = cost_of(directions, *R);
    if (cost < least) {
      least = cost;
      best = R;
    }
  };
  const std::size_t n = directions.size();
  if (n * (n - 1) / 2 <= most_pairs) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) attempt(directions[i], directions[j]);
    }
    return best;
  }
  std::mt19937 random(1);
  for (std::size_t drawn = 0; drawn < most_pairs; ++drawn) {
    const std::size_t i = random() % n;
    attempt(directions[i], directions[(i + 1 + random() % (n - 1)) % n]);
  }
  return best;
}

// Median residual, in expected errors, but at least 1.
double spread_of(std::span<const SeenDirection> directions, const Mat3& R) {
  std::vector<double> residuals;
  for (const SeenDirection& d : directions) residuals.push_back(residual(d, R));
  return std::max(1.0, capture::median_in_place(residuals) / median_length);
}

void check(std::span<const SeenDirection> directions) {
  for (const SeenDirection& d : directions) {
    if (!(std::abs(length(d.v_cam) - 1) < 1e-6) || !(std::abs(length(d.v_set) - 1) < 1e-6) ||
        !(d.sigma_rad > 0) || !std::isfinite(d.sigma_rad)) {
      throw std::invalid_argument("directions are unit vectors with an error above 0");
    }
  }
  if (directions.size() < 2) {
    throw std::runtime_error("a rotation needs two directions or more, not " +
                             std::to_string(directions.size()) +
                             ": about a single one the camera could turn");
  }
}

}  // namespace

RotationFit fit_rotation(std::span<const SeenDirection> directions) {
  check(directions);
  std::optional<Mat3> R = best_of_pairs(directions);
  if (!R) {
    throw std::runtime_error(
        "the directions lie on one axis, about which the camera could turn: add one well off it");
  }
  std::vector<double> weights(directions.size());
  for (int round = 0; round < 10; ++round) {
    const double s = 2 * spread_of(directions, *R);
    std::ranges::transform(directions, weights.begin(), [&](const SeenDirection& d) {
      const double r = residual(d, *R) / s;
      return 1 / (1 + r * r);
    });
    const auto next = solve_wahba(directions, weights);
    if (!next) break;
    R = next;
  }
  RotationFit fit;
  constexpr std::size_t enough_to_doubt = 5;
  const double limit = wrong_beyond_spread * spread_of(directions, *R);
  std::size_t count = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    fit.agrees.push_back(directions.size() < enough_to_doubt ||
                         residual(directions[i], *R) < limit);
    weights[i] = fit.agrees.back() ? 1 : 0;
    count += fit.agrees.back() ? 1 : 0;
  }
  fit.cam_from_set = solve_wahba(directions, weights).value_or(*R);

  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double squares = 0;
  double squared_angles = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const SeenDirection& d = directions[i];
    const double r = residual(d, fit.cam_from_set);
    fit.residuals_rad.push_back(r * d.sigma_rad);
    if (!fit.agrees[i]) continue;
    const Eigen::Vector3d u(d.v_cam.x, d.v_cam.y, d.v_cam.z);
    information += (Eigen::Matrix3d::Identity() - u * u.transpose()) / (d.sigma_rad * d.sigma_rad);
    squares += r * r;
    squared_angles += fit.residuals_rad[i] * fit.residuals_rad[i];
  }
  const auto n = static_cast<double>(count);
  fit.excess = std::sqrt(squares / (2 * n - 3));
  const Eigen::Matrix3d covariance = std::max(1.0, squares / (2 * n - 3)) * information.inverse();
  if (!covariance.allFinite() || count < 2) {
    throw std::runtime_error("the directions do not agree on a rotation");
  }
  Eigen::Map<Eigen::Matrix3d>(fit.covariance.data()) = covariance;
  fit.turn_sigma_rad = std::sqrt(covariance.trace());
  fit.rms_rad = std::sqrt(squared_angles / n);
  constexpr double turned_away = 0.2;
  if (fit.rms_rad > turned_away || 2 * count < directions.size()) {
    throw std::runtime_error(
        "the directions do not agree on a rotation: check names, positions and pixels, and that "
        "the lens is this camera's");
  }
  return fit;
}

void add_lens_error(RotationFit& fit,
                    std::span<const Sight> sights,
                    Vec3 position,
                    const LensError& error) {
  if (sights.size() != fit.agrees.size()) {
    throw std::invalid_argument("a lens's error needs the sights that the rotation is from");
  }
  const Pose cam_from_set{fit.cam_from_set, -(fit.cam_from_set * position)};
  std::vector<Sight> agreeing;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (!fit.agrees[i]) continue;
    agreeing.push_back(sights[i]);
    const SightSlopes told = slopes_of(sights[i], cam_from_set);
    const Eigen::Map<const Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> slopes(told.data());
    information += slopes.leftCols<3>().transpose() * slopes.leftCols<3>();
  }
  const PoseMatrix told = lens_part(agreeing, cam_from_set, error);
  const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> part(told.data());
  const Eigen::Matrix3d inverse = information.inverse();
  Eigen::Map<Eigen::Matrix3d> covariance(fit.covariance.data());
  covariance += inverse * part.topLeftCorner<3, 3>() * inverse;
  fit.turn_sigma_rad = std::sqrt(covariance.trace());
}

Mat3 best_rotation(std::span<const Vec3> from, std::span<const Vec3> to) {
  if (from.size() != to.size()) {
    throw std::invalid_argument("a rotation needs as many directions on both sides");
  }
  std::vector<SeenDirection> pairs;
  for (std::size_t i = 0; i < from.size(); ++i) pairs.push_back({to[i], from[i], 1});
  const std::vector<double> weights(pairs.size(), 1.0);
  return solve_wahba(pairs, weights).value_or(Mat3{});
}

std::vector<SeenDirection> directions_from(std::span<const Sight> sights,
                                           Vec3 position,
                                           double noise_px) {
  std::vector<SeenDirection> directions;
  for (const Sight& sight : sights) {
    const Vec3 d = sight.p_set - position;
    if (!(length(d) > 0)) {
      throw std::invalid_argument("a marker at the camera's own position has no direction");
    }
    const double px_per_rad = std::sqrt(length(sight.right) * length(sight.down));
    directions.push_back({sight.v_cam, normalize(d), noise_px / px_per_rad});
  }
  return directions;
}

}  // namespace calibrate
