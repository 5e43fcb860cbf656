// Points of the set as a camera sees them, and the pose that explains them best.
#include "calibrate/sight.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>

#include "capture/median.h"

namespace calibrate {
namespace {

using Information = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Pixels to either side over which the lens's slope is taken.
constexpr double slope_px = 0.1;
// Nearer than this to the lens, a point has no direction.
constexpr double nearest_m = 1e-9;
constexpr double converged = 1e-12;

// How directions change from one pixel to the next.
std::optional<Vec3> slope_of(const Lens& lens, Vec2 q, Vec2 step, Vec3 v) {
  const auto ahead = unproject(lens, {q.x + step.x, q.y + step.y});
  const auto behind = unproject(lens, {q.x - step.x, q.y - step.y});
  if (!ahead && !behind) return std::nullopt;
  const Vec3 slope = (ahead.value_or(v) - behind.value_or(v)) *
                     (1 / (slope_px * ((ahead ? 1.0 : 0.0) + (behind ? 1.0 : 0.0))));
  return slope - v * dot(slope, v);
}

// The angle to u over its sine: turns a tangent into an arc.
double arc_over_sine(double sine, double cosine) {
  return sine < 1e-9 ? 1 : std::atan2(sine, cosine) / sine;
}

Vec2 residual_of_direction(const Sight& sight, Vec3 u) {
  const double cosine = dot(sight.v_cam, u);
  const Vec3 across = u - sight.v_cam * cosine;
  const double sine = length(across);
  if (sine < 1e-9 && cosine < 0) return {std::numbers::pi * length(sight.right), 0};
  const double arc = arc_over_sine(sine, cosine);
  return {arc * dot(sight.right, across), arc * dot(sight.down, across)};
}

double loss(double r2, double s) { return std::isinf(s) ? r2 : s * s * std::log1p(r2 / (s * s)); }

double cost_of(std::span<const Sight> sights, const Pose& pose, double s) {
  double cost = 0;
  for (const Sight& sight : sights) cost += loss(squared(residual_of(sight, pose)), s);
  return cost;
}

double median_residual(std::span<const Sight> sights, const Pose& pose) {
  std::vector<double> squares(sights.size());
  std::ranges::transform(sights, squares.begin(),
                         [&](const Sight& sight) { return squared(residual_of(sight, pose)); });
  return std::sqrt(capture::median_in_place(squares));
}

struct Normal {
  Information matrix = Information::Zero();
  Vector6 gradient = Vector6::Zero();
};

Normal normal_equations(std::span<const Sight> sights, const Pose& pose, double s) {
  Normal normal;
  for (const Sight& sight : sights) {
    const Vec3 p = pose * sight.p_set;
    if (length(p) < nearest_m) continue;
    const Vec2 r = residual_of_direction(sight, normalize(p));
    const double weight = std::isinf(s) ? 1 : 1 / (1 + squared(r) / (s * s));
    const SightSlopes slopes = slopes_of(sight, pose);
    const Eigen::Map<const Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> j(slopes.data());
    normal.matrix.noalias() += weight * j.transpose() * j;
    normal.gradient.noalias() += weight * j.transpose() * Eigen::Vector2d(r.x, r.y);
  }
  return normal;
}

Pose moved(const Pose& pose, const Vector6& step) {
  const Eigen::Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  Mat3 turned = pose.R;
  if (angle > 0) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    Mat3 rotation;
    for (int i = 0; i < 9; ++i) rotation.m[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
    turned = rotation * pose.R;
  }
  const Vec3 position = position_of(pose) + Vec3{step[3], step[4], step[5]};
  return {turned, -(turned * position)};
}

}  // namespace

std::optional<Sight> sight_of(const Lens& lens, Vec2 q, Vec3 p_set) {
  const auto v = unproject(lens, q);
  if (!v) return std::nullopt;
  const auto a = slope_of(lens, q, {slope_px, 0}, *v);
  const auto b = slope_of(lens, q, {0, slope_px}, *v);
  if (!a || !b) return std::nullopt;
  const double aa = dot(*a, *a);
  const double ab = dot(*a, *b);
  const double bb = dot(*b, *b);
  const double determinant = aa * bb - ab * ab;
  if (!(determinant > 0) || !std::isfinite(1 / determinant)) return std::nullopt;
  return Sight{*v, p_set, (bb * *a - ab * *b) / determinant, (aa * *b - ab * *a) / determinant};
}

Sight sight_of(Vec3 v_cam, Vec3 p_set) {
  const Vec3 v = normalize(v_cam);
  if (!(std::abs(length(v) - 1) < 1e-9)) {
    throw std::invalid_argument("a point is seen in a direction that is not zero and finite");
  }
  const Vec3 other = std::abs(v.y) < 0.9 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  const Vec3 right = normalize(cross(other, v));
  return {v, p_set, right, cross(v, right)};
}

Vec2 residual_of(const Sight& sight, const Pose& cam_from_set) {
  return residual_of_direction(sight, normalize(cam_from_set * sight.p_set));
}

SightSlopes slopes_of(const Sight& sight, const Pose& cam_from_set) {
  SightSlopes slopes{};
  const Vec3 p = cam_from_set * sight.p_set;
  const double distance = length(p);
  if (distance < nearest_m) return slopes;
  const Vec3 u = p / distance;
  const double cosine = dot(sight.v_cam, u);
  const double arc = arc_over_sine(length(u - sight.v_cam * cosine), cosine);
  const Mat3 set_from_cam = cam_from_set.R.transposed();
  std::size_t at = 0;
  for (const Vec3 axis : {sight.right, sight.down}) {
    const Vec3 e = (axis - u * dot(axis, u)) * (arc / distance);
    const Vec3 turn = cross(p, e);
    const Vec3 move = -(set_from_cam * e);
    for (const double slope : {turn.x, turn.y, turn.z, move.x, move.y, move.z}) {
      slopes[at++] = slope;
    }
  }
  return slopes;
}

RefinedPose refine_pose(std::span<const Sight> sights,
                        const Pose& seed,
                        double loss_px,
                        int rounds) {
  if (sights.empty()) throw std::invalid_argument("a pose needs sights");
  RefinedPose refined{seed, 0, {}};
  Pose& pose = refined.cam_from_set;
  const auto scale = [&] {
    return std::isinf(loss_px) ? loss_px : std::max(loss_px, 1.5 * median_residual(sights, pose));
  };
  double s = scale();
  double damping = 1e-6;
  Normal normal = normal_equations(sights, pose, s);
  double cost = cost_of(sights, pose, s);
  for (int round = 0; round < rounds; ++round) {
    Information damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    const Vector6 step = -damped.ldlt().solve(normal.gradient);
    if (!step.allFinite()) break;
    const Pose next = moved(pose, step);
    const double next_cost = cost_of(sights, next, s);
    if (!(next_cost <= cost)) {
      damping = std::max(damping * 10, 1e-4);
      if (damping > 1e8) break;
      continue;
    }
    pose = next;
    damping = std::max(damping / 10, 1e-9);
    s = scale();
    cost = cost_of(sights, pose, s);
    normal = normal_equations(sights, pose, s);
    // In the matrix's own measure, so that it holds whatever the set's size.
    if (step.dot(damped * step) < converged * std::max(1.0, cost)) break;
  }
  refined.cost = cost;
  Eigen::Map<Information>(refined.information.data()) = normal.matrix;
  return refined;
}

}  // namespace calibrate
