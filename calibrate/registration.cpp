// The pose of a camera from points of the set that it sees, at any angle to its axis.
#include "calibrate/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include <Eigen/Dense>

#include "calibrate/pose_seeds.h"
#include "capture/median.h"

namespace calibrate {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

constexpr std::size_t fewest = 4;
// Poses that differ by less (distance_between) are one.
constexpr double same_pose = 0.01;
// Standard deviations: of residuals, beyond which a sight is wrong; and by how much residuals may
// exceed what is expected before the sights are said not to agree.
constexpr double wrong_beyond = 4;
constexpr double disagree_beyond = 20;
// Poses of triples carry the noise on to other sights, enlarged.
constexpr double seed_loss = 10;
// Difference of squared residuals over their variance, below which a rival is as good.
constexpr double rival_within = 9.2;  // 1 in 100 by chance, of two degrees of freedom
// Extent of points that lie on a line, or in a plane, across it, relative to the largest.
constexpr double thin = 1e-3;
constexpr double flat = 0.05;

bool finite(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// How points lie in space.
struct Spread {
  Vec3 centre;
  Vec3 normal;                   // of the plane next to them
  std::array<double, 3> extent;  // standard deviations, falling
};

Spread spread_of(std::span<const Sight> sights) {
  Spread spread;
  const double share = 1 / static_cast<double>(sights.size());
  for (const Sight& sight : sights) spread.centre += share * sight.p_set;
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const Sight& sight : sights) {
    const Vec3 d = sight.p_set - spread.centre;
    const Eigen::Vector3d e(d.x, d.y, d.z);
    moments += share * e * e.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
  const Eigen::Vector3d n = axes.eigenvectors().col(0);
  spread.normal = {n[0], n[1], n[2]};
  for (Eigen::Index i = 0; i < 3; ++i) {
    spread.extent[static_cast<std::size_t>(i)] =
        std::sqrt(std::max(0.0, axes.eigenvalues()[2 - i]));
  }
  return spread;
}

std::size_t count_different(std::span<const Sight> sights, double tolerance_m) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    bool first = true;
    for (std::size_t j = 0; j < i && first; ++j) {
      first = length(sights[i].p_set - sights[j].p_set) > tolerance_m;
    }
    count += first ? 1 : 0;
    if (count >= fewest) break;
  }
  return count;
}

void check(std::span<const Sight> sights, const RegistrationOptions& options) {
  if (!(options.noise_px > 0) || !std::isfinite(options.noise_px)) {
    throw std::invalid_argument("the noise of sights must be above 0 and finite");
  }
  for (const Sight& sight : sights) {
    if (!finite(sight.p_set) || !finite(sight.right) || !finite(sight.down) ||
        !(std::abs(length(sight.v_cam) - 1) < 1e-6)) {
      throw std::invalid_argument("a sight needs finite numbers and a unit direction");
    }
  }
  if (sights.size() < fewest) {
    throw std::runtime_error(
        "a pose needs four markers or more, not " + std::to_string(sights.size()) +
        (sights.size() == 3 ? ": three are seen alike from up to four places; add a fourth" : ""));
  }
}

void check_spread(std::span<const Sight> sights, const Spread& spread) {
  if (count_different(sights, 1e-6 * spread.extent[0]) < fewest) {
    throw std::runtime_error(
        "a pose needs four markers at different places; several are at one: measure them again, or "
        "add others");
  }
  if (!(spread.extent[1] >= thin * spread.extent[0])) {
    throw std::runtime_error(
        "the markers lie on a line, about which the camera could turn: add one well off it");
  }
}

// A plane seen from afar looks alike with its normal mirrored about the line of sight.
Pose mirrored(const Pose& pose, const Spread& spread) {
  const Vec3 centre = pose * spread.centre;
  const Vec3 sight = normalize(centre);
  Vec3 normal = pose.R * spread.normal;
  if (dot(normal, sight) < 0) normal = -normal;
  const Vec3 axis = cross(normal, sight);
  if (length(axis) < 1e-9) return pose;
  // Twice the angle from the normal to the line of sight, about both's perpendicular.
  const double angle = 2 * std::atan2(length(axis), dot(normal, sight));
  const Vec3 a = normalize(axis);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(angle, Eigen::Vector3d(a.x, a.y, a.z)).toRotationMatrix();
  Mat3 R;
  for (int i = 0; i < 9; ++i) R.m[static_cast<std::size_t>(i)] = turn(i / 3, i % 3);
  Pose turned{R * pose.R, {}};
  turned.t = centre - turned.R * spread.centre;
  return turned;
}

// Local minima, different from each other, the best first.
std::vector<RefinedPose> find_minima(std::span<const Sight> sights,
                                     const Spread& spread,
                                     double noise_px) {
  constexpr int rounds = 25;
  const double loss_px = 2 * noise_px;
  const double wrong_px = disagree_beyond * noise_px;
  std::vector<RefinedPose> minima;
  const auto add = [&](const Pose& seed) {
    RefinedPose refined = refine_pose(sights, seed, loss_px, rounds);
    refined.cost = 0;  // by one loss for all, in which a wrong sight is wrong, however much
    for (const Sight& sight : sights) {
      const double r2 = squared(residual_of(sight, refined.cam_from_set));
      refined.cost += std::log1p(std::min(r2, wrong_px * wrong_px) / (loss_px * loss_px));
    }
    const auto twin = std::ranges::find_if(minima, [&](const RefinedPose& other) {
      return distance_between(other.cam_from_set, refined.cam_from_set, spread.centre) < same_pose;
    });
    if (twin == minima.end()) {
      minima.push_back(refined);
    } else if (refined.cost < twin->cost) {
      *twin = refined;
    }
    std::ranges::sort(minima, {}, &RefinedPose::cost);
  };
  const std::vector<PoseSeed> seeds = find_pose_seeds(sights, spread.centre, seed_loss * noise_px);
  const double hopeless = static_cast<double>(std::min(sights.size(), most_seed_sights));
  for (const PoseSeed& seed : seeds) {
    if (seed.cost < seeds.front().cost + hopeless) add(seed.cam_from_set);
  }
  if (!minima.empty() && spread.extent[2] < flat * spread.extent[0]) {
    add(mirrored(minima.front().cam_from_set, spread));
  }
  return minima;
}

// Standard deviation along one axis, by the median: half of all lengths are below 1.1774 of it.
double robust_sigma(std::span<const Sight> sights, const Pose& pose) {
  std::vector<double> lengths;
  for (const Sight& sight : sights) {
    lengths.push_back(std::sqrt(squared(residual_of(sight, pose))));
  }
  return capture::median_in_place(lengths) / 1.1774;
}

double sum_of_squares(std::span<const Sight> sights, const Pose& pose) {
  double sum = 0;
  for (const Sight& sight : sights) sum += squared(residual_of(sight, pose));
  return sum;
}

// The sights that agree, and least squares over them.
struct Agreement {
  std::vector<bool> agrees;
  std::vector<Sight> sights;
  RefinedPose refined;
};

// Four sights leave two freedoms, which a wrong pose uses up: of six to eight one may be left out.
std::size_t fewest_agreeing(std::size_t sights) {
  if (sights < fewest + 2) return sights;
  return sights - (sights < 9 ? 1 : sights / 3);
}

Agreement fit_those(std::span<const Sight> sights, std::vector<bool> agrees, const Pose& seed) {
  constexpr int rounds = 15;
  Agreement agreement{std::move(agrees), {}, {}};
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (agreement.agrees[i]) agreement.sights.push_back(sights[i]);
  }
  if (agreement.sights.empty()) return agreement;
  agreement.refined =
      refine_pose(agreement.sights, seed, std::numeric_limits<double>::infinity(), rounds);
  return agreement;
}

double variance_of(const Agreement& agreement, double noise_px) {
  const auto n = static_cast<double>(agreement.sights.size());
  return std::max(noise_px * noise_px,
                  sum_of_squares(agreement.sights, agreement.refined.cam_from_set) / (2 * n - 6));
}

// Of many: those within a few standard deviations, which are found anew from the result.
Agreement agree_by_spread(std::span<const Sight> sights, Pose pose, double noise_px) {
  Agreement agreement;
  for (int turn = 0; turn < 3; ++turn) {
    const double limit = wrong_beyond * std::max(noise_px, robust_sigma(sights, pose));
    std::vector<bool> agrees;
    for (const Sight& sight : sights) {
      agrees.push_back(squared(residual_of(sight, pose)) < limit * limit);
    }
    if (agrees == agreement.agrees) break;
    agreement = fit_those(sights, std::move(agrees), pose);
    if (agreement.sights.size() < fewest_agreeing(sights.size())) break;
    pose = agreement.refined.cam_from_set;
  }
  return agreement;
}

// Of few, a spread tells little: leaving out the worst ones always makes the rest look good.
// Without one more, without two more, until a third are left out: whatever explains all at the
// least cost, if what is left out could be anywhere within a radian.
Agreement agree_by_cost(std::span<const Sight> sights, const Pose& pose, double noise_px) {
  const std::size_t n = sights.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {},
                    [&](std::size_t i) { return squared(residual_of(sights[i], pose)); });
  double log_range = 0;
  for (const Sight& sight : sights) {
    log_range += std::log(length(sight.right) * length(sight.down)) / static_cast<double>(n);
  }
  Agreement best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t kept = fewest_agreeing(n); kept <= n; ++kept) {
    std::vector<bool> agrees(n, false);
    for (std::size_t i = 0; i < kept; ++i) agrees[order[i]] = true;
    Agreement agreement = fit_those(sights, std::move(agrees), pose);
    const double variance = variance_of(agreement, noise_px);
    const double squares = sum_of_squares(agreement.sights, agreement.refined.cam_from_set);
    const double cost =
        static_cast<double>(kept) * std::log(2 * std::numbers::pi * variance) +
        squares / (2 * variance) +
        static_cast<double>(n - kept) * (log_range + std::log(static_cast<double>(n)));
    if (cost > least) continue;
    least = cost;
    best = std::move(agreement);
  }
  return best;
}

Agreement find_agreement(std::span<const Sight> sights, const Pose& pose, double noise_px) {
  constexpr std::size_t few = 12;
  Agreement agreement = sights.size() > few ? agree_by_spread(sights, pose, noise_px)
                                            : agree_by_cost(sights, pose, noise_px);
  const double too_far = disagree_beyond * noise_px;
  if (agreement.sights.size() < fewest_agreeing(sights.size()) ||
      variance_of(agreement, noise_px) > too_far * too_far) {
    throw std::runtime_error(
        "the markers do not agree on a pose; check that names, positions and pixels belong "
        "together, and that the lens is this camera's");
  }
  return agreement;
}

void set_covariance(Registration& registration,
                    const PoseMatrix& information,
                    double variance,
                    const PoseMatrix& of_lens) {
  const Matrix6 matrix = Eigen::Map<const Matrix6>(information.data());
  // Radians and metres differ in size: balanced first.
  const Eigen::Matrix<double, 6, 1> scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6 balanced = scale.asDiagonal() * matrix * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> axes(balanced);
  constexpr double open = 1e-12;
  if (!balanced.allFinite() || !(axes.eigenvalues()[0] > open)) {
    throw std::runtime_error(
        "the markers leave the pose open: they are too close together or too far away for the "
        "place of the camera; add some near it or on other sides");
  }
  const Matrix6 inverse = scale.asDiagonal() * balanced.inverse() * scale.asDiagonal();
  const Eigen::Map<const Matrix6> part(of_lens.data());
  const Matrix6 covariance = variance * inverse + inverse * part * inverse;
  if (!covariance.allFinite()) {
    throw std::runtime_error("the pose's uncertainty cannot be told: the numbers are too large");
  }
  Eigen::Map<Matrix6>(registration.covariance.data()) = covariance;
  registration.turn_sigma_rad = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  registration.position_sigma_m = std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
}

void add_warnings(Registration& registration,
                  std::size_t agreeing,
                  double range_m,
                  double noise_px) {
  const std::size_t wrong = registration.agrees.size() - agreeing;
  if (wrong > 0) {
    registration.warnings.push_back(std::to_string(wrong) + " of " +
                                    std::to_string(registration.agrees.size()) +
                                    " markers do not agree and were left out");
  }
  if (registration.ambiguous) {
    registration.warnings.emplace_back(
        "another pose explains the markers nearly as well: add some out of their plane, or come "
        "nearer");
  }
  if (registration.rms_px > 5 * noise_px) {
    registration.warnings.emplace_back(
        "the residuals are far above the noise to be expected: markers are measured badly, or the "
        "lens is off");
  }
  if (registration.position_sigma_m > 0.1 * range_m) {
    registration.warnings.emplace_back(
        "the position is uncertain by over a tenth of the distance to the markers: add some near "
        "the camera or on other sides");
  }
}

}  // namespace

Registration register_camera(std::span<const Sight> sights, const RegistrationOptions& options) {
  check(sights, options);
  const Spread spread = spread_of(sights);
  check_spread(sights, spread);
  const double noise_px = options.noise_px;
  const std::vector<RefinedPose> minima = find_minima(sights, spread, noise_px);
  if (minima.empty()) {
    throw std::runtime_error(
        "no pose explains any three of the markers: check that positions and pixels belong "
        "together");
  }
  Registration registration;
  const Agreement agreement = find_agreement(sights, minima.front().cam_from_set, noise_px);
  const std::vector<Sight>& agreeing = agreement.sights;
  registration.agrees = agreement.agrees;
  const Pose& pose = registration.cam_from_set = agreement.refined.cam_from_set;
  for (const Sight& sight : sights) registration.residuals_px.push_back(residual_of(sight, pose));
  const auto count = static_cast<double>(agreeing.size());
  const double squares = sum_of_squares(agreeing, pose);
  registration.rms_px = std::sqrt(squares / count);
  const double variance = variance_of(agreement, noise_px);
  set_covariance(registration, agreement.refined.information, variance,
                 lens_part(agreeing, pose, options.lens));

  for (std::size_t i = 1; i < minima.size(); ++i) {
    const RefinedPose other =
        refine_pose(agreeing, minima[i].cam_from_set, std::numeric_limits<double>::infinity(), 15);
    if (distance_between(other.cam_from_set, pose, spread.centre) < same_pose) continue;
    const double rival_squares = sum_of_squares(agreeing, other.cam_from_set);
    const double rival_rms_px = std::sqrt(rival_squares / count);
    if (registration.rival && rival_rms_px >= registration.rival_rms_px) continue;
    registration.rival = other.cam_from_set;
    registration.rival_rms_px = rival_rms_px;
    registration.ambiguous = rival_squares - squares < rival_within * variance;
  }
  add_warnings(registration, agreeing.size(), length(pose * spread.centre), noise_px);
  return registration;
}

}  // namespace calibrate
