// Maps from plane to plane.
#include "calibrate/homography.h"

#include <cmath>
#include <cstddef>

#include <Eigen/Dense>

namespace calibrate {
namespace {

using Eigen::Matrix3d;

// Moves points to mean 0 and mean distance sqrt(2) (Hartley's normalisation).
struct Normalisation {
  double x = 0, y = 0, scale = 1;

  explicit Normalisation(std::span<const Vec2> points) {
    const auto n = static_cast<double>(points.size());
    for (const Vec2 p : points) x += p.x / n, y += p.y / n;
    double distance = 0;
    for (const Vec2 p : points) distance += hypotenuse(p.x - x, p.y - y) / n;
    scale = distance > 0 ? std::sqrt(2.0) / distance : 0;
  }
  Vec2 operator()(Vec2 p) const { return {(p.x - x) * scale, (p.y - y) * scale}; }
  Matrix3d matrix() const {
    Matrix3d m;
    m << scale, 0, -x * scale, 0, scale, -y * scale, 0, 0, 1;
    return m;
  }
};

}  // namespace

std::optional<Mat3> find_homography(std::span<const Vec2> points, std::span<const Vec2> images) {
  if (points.size() != images.size() || points.size() < 4) return std::nullopt;
  const Normalisation from(points);
  const Normalisation to(images);
  if (!(from.scale > 0) || !(to.scale > 0)) return std::nullopt;
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2 a = from(points[i]);
    const Vec2 b = to(images[i]);
    Eigen::Matrix<double, 9, 2> rows;
    rows << a.x, 0, a.y, 0, 1, 0, 0, a.x, 0, a.y, 0, 1, -b.x * a.x, -b.y * a.x, -b.x * a.y,
        -b.y * a.y, -b.x, -b.y;
    sum.selfadjointView<Eigen::Lower>().rankUpdate(rows);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(sum);
  const auto& values = solver.eigenvalues();
  if (!(values(1) > 1e-12 * values(8))) return std::nullopt;  // several homographies do
  const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
  Matrix3d normalised;
  normalised << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8);
  const Matrix3d H = to.matrix().inverse() * normalised * from.matrix();
  Mat3 result;
  for (int i = 0; i < 9; ++i) result.m[static_cast<std::size_t>(i)] = H(i / 3, i % 3);
  return result;
}

}  // namespace calibrate
