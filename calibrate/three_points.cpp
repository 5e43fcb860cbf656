// The poses from which three points are seen in three directions.
#include "calibrate/three_points.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace calibrate {
namespace {

// Sine of the angle between two sides, below which three points count as on a line.
constexpr double least_sine = 1e-6;
// Relative error of a squared side that a solution may leave.
constexpr double side_tolerance = 1e-6;

Eigen::Vector3d eigen(Vec3 v) { return {v.x, v.y, v.z}; }

// A real root of x^3 + b x^2 + c x + d, the one furthest from where the cubic turns.
double cubic_root(double b, double c, double d) {
  const double p = c - b * b / 3;
  const double q = b * (2 * b * b / 27 - c / 3) + d;
  double t = 0;
  if (q * q / 4 + p * p * p / 27 > 0) {
    const double s = std::sqrt(q * q / 4 + p * p * p / 27);
    const double u = std::cbrt(q > 0 ? -q / 2 - s : -q / 2 + s);
    t = u == 0 ? 0 : u - p / (3 * u);
  } else if (p < 0) {
    const double r = std::sqrt(-p / 3);
    t = 2 * r * std::cos(std::acos(std::clamp(-q / (2 * r * r * r), -1.0, 1.0)) / 3);
    if (q > 0) t = -2 * r * std::cos(std::acos(std::clamp(q / (2 * r * r * r), -1.0, 1.0)) / 3);
  }
  double x = t - b / 3;
  for (int round = 0; round < 3; ++round) {
    const double slope = (3 * x + 2 * b) * x + c;
    if (slope == 0) break;
    x -= (((x + b) * x + c) * x + d) / slope;
  }
  return x;
}

// A degenerate conic a + x b.
Eigen::Matrix3d degenerate_conic(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const auto mixed = [](const Eigen::Matrix3d& m, const Eigen::Matrix3d& n) {
    return n.col(0).dot(m.col(1).cross(m.col(2))) + m.col(0).dot(n.col(1).cross(m.col(2))) +
           m.col(0).dot(m.col(1).cross(n.col(2)));
  };
  const double constant = a.determinant();
  const double cube = b.determinant();
  if (std::abs(cube) < std::abs(constant)) return degenerate_conic(b, a);
  if (cube == 0) return a;
  return a + cubic_root(mixed(b, a) / cube, mixed(a, b) / cube, constant / cube) * b;
}

// What the three points demand of the distances to them: with p_i = distance_i * v_i, sides as in
// the set.
struct Sides {
  double c01, c02, c12;  // cosines between the directions
  double a01, a02, a12;  // squared sides

  Eigen::Vector3d error(const Eigen::Vector3d& d) const {
    return {d[0] * d[0] + d[1] * d[1] - 2 * c01 * d[0] * d[1] - a01,
            d[0] * d[0] + d[2] * d[2] - 2 * c02 * d[0] * d[2] - a02,
            d[1] * d[1] + d[2] * d[2] - 2 * c12 * d[1] * d[2] - a12};
  }
  Eigen::Matrix3d slope(const Eigen::Vector3d& d) const {
    Eigen::Matrix3d j;
    j << d[0] - c01 * d[1], d[1] - c01 * d[0], 0, d[0] - c02 * d[2], 0, d[2] - c02 * d[0], 0,
        d[1] - c12 * d[2], d[2] - c12 * d[1];
    return 2 * j;
  }
};

// Newton's steps; false if the sides do not come out.
bool polish(const Sides& sides, Eigen::Vector3d& distances) {
  for (int round = 0; round < 3; ++round) {
    const Eigen::Vector3d step = sides.slope(distances).inverse() * sides.error(distances);
    if (!step.allFinite() || step.norm() > 0.1 * distances.norm()) break;
    distances -= step;
  }
  return distances.minCoeff() > 0 &&
         sides.error(distances).norm() <
             side_tolerance * std::max({sides.a01, sides.a02, sides.a12});
}

// Axes along the first side, in the plane and across it.
Eigen::Matrix3d axes_of(const Eigen::Vector3d& p0,
                        const Eigen::Vector3d& p1,
                        const Eigen::Vector3d& p2) {
  Eigen::Matrix3d axes;
  axes.col(0) = (p1 - p0).normalized();
  axes.col(2) = (p1 - p0).cross(p2 - p0).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

}  // namespace

ThreePointPoses solve_three_points(const std::array<Vec3, 3>& v_cam,
                                   const std::array<Vec3, 3>& p_set) {
  ThreePointPoses poses;
  const std::array v{eigen(v_cam[0]), eigen(v_cam[1]), eigen(v_cam[2])};
  const std::array p{eigen(p_set[0]), eigen(p_set[1]), eigen(p_set[2])};
  const Sides sides{v[0].dot(v[1]),
                    v[0].dot(v[2]),
                    v[1].dot(v[2]),
                    (p[0] - p[1]).squaredNorm(),
                    (p[0] - p[2]).squaredNorm(),
                    (p[1] - p[2]).squaredNorm()};
  const double twice_area = (p[1] - p[0]).cross(p[2] - p[0]).norm();
  if (!(twice_area > least_sine * std::max({sides.a01, sides.a02, sides.a12}))) return poses;

  Eigen::Matrix3d m01, m02, m12;
  m01 << 1, -sides.c01, 0, -sides.c01, 1, 0, 0, 0, 0;
  m02 << 1, 0, -sides.c02, 0, 0, 0, -sides.c02, 0, 1;
  m12 << 0, 0, 0, 0, 1, -sides.c12, 0, -sides.c12, 1;
  const Eigen::Matrix3d first = (m01 * sides.a12 - m12 * sides.a01) / (sides.a01 + sides.a12);
  const Eigen::Matrix3d second = (m02 * sides.a12 - m12 * sides.a02) / (sides.a02 + sides.a12);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> factors(degenerate_conic(first, second));
  if (factors.info() != Eigen::Success) return poses;
  // The middle eigenvalue is the vanishing one of a pair of lines.
  const double low = std::sqrt(std::max(0.0, -factors.eigenvalues()[0]));
  const double high = std::sqrt(std::max(0.0, factors.eigenvalues()[2]));
  const Eigen::Vector3d along = factors.eigenvectors().col(1);
  const Eigen::Vector3d low_axis = factors.eigenvectors().col(0);
  const Eigen::Vector3d high_axis = factors.eigenvectors().col(2);
  const Eigen::Matrix3d set_axes = axes_of(p[0], p[1], p[2]);
  for (const double sign : {1.0, -1.0}) {
    // Distances on the line: s * along + t * across.
    const Eigen::Vector3d across = (high * low_axis + sign * low * high_axis).normalized();
    if (!across.allFinite()) continue;
    const double a = along.dot(first * along);
    const double b = along.dot(first * across);
    const double c = across.dot(first * across);
    const double root = std::sqrt(std::max(0.0, b * b - a * c));
    // Both solutions of a s^2 + 2 b s t + c t^2 = 0, without cancellation.
    const double sum = b >= 0 ? -b - root : -b + root;
    for (const Eigen::Vector3d& ray :
         {Eigen::Vector3d(sum * along + a * across), Eigen::Vector3d(c * along + sum * across)}) {
      const double size = ray.dot((m01 + m02 + m12) * ray);
      if (!(size > 0) || poses.full()) continue;
      const double scale = std::sqrt((sides.a01 + sides.a02 + sides.a12) / size);
      Eigen::Vector3d distances = ray * (ray.sum() > 0 ? scale : -scale);
      if (!polish(sides, distances)) continue;
      const Eigen::Vector3d q0 = distances[0] * v[0];
      const Eigen::Matrix3d R =
          axes_of(q0, distances[1] * v[1], distances[2] * v[2]) * set_axes.transpose();
      const Eigen::Vector3d t = q0 - R * p[0];
      Pose pose;
      for (int i = 0; i < 9; ++i) pose.R.m[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
      pose.t = {t[0], t[1], t[2]};
      poses.add(pose);
    }
  }
  return poses;
}

}  // namespace calibrate
