// Planes through the camera, in which the straight lines of the scene lie.
#include "calibrate/line_planes.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace calibrate {
namespace {

using std::numbers::pi;

Vec3 least_eigenvector(const Eigen::Matrix3d& M) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(M);
  return {solver.eigenvectors()(0, 0), solver.eigenvectors()(1, 0), solver.eigenvectors()(2, 0)};
}

}  // namespace

std::optional<std::vector<double>> distances_px(FisheyeLaw law,
                                                const std::array<double, 3>& lens,
                                                Vec3 normal,
                                                const MarkedLine& line) {
  std::vector<double> result;
  const std::array<double, 3> n{normal.x, normal.y, normal.z};
  for (const Vec2 q : line.pixels) {
    double d = 0;
    if (!distance_px(law, lens.data(), n.data(), q, d)) return std::nullopt;
    result.push_back(d);
  }
  return result;
}

std::optional<Vec3> plane_of(FisheyeLaw law,
                             const std::array<double, 3>& lens,
                             const MarkedLine& line,
                             double noise_px) {
  std::vector<Vec3> bearings;
  for (const Vec2 q : line.pixels) {
    const double x = q.x - lens[1];
    const double y = q.y - lens[2];
    const double r = std::max(hypotenuse(x, y), 1e-9);
    const double s = r / (law == FisheyeLaw::equisolid ? 2 * lens[0] : pi * lens[0]);
    if (!(s < 0.9999)) return std::nullopt;
    const double angle = law == FisheyeLaw::equisolid ? 2 * std::asin(s) : pi * s;
    bearings.push_back({std::sin(angle) * x / r, std::sin(angle) * y / r, std::cos(angle)});
  }
  std::vector<double> weights(bearings.size(), 1);
  Vec3 normal;
  for (int round = 0; round < 6; ++round) {
    Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      const Eigen::Vector3d v(bearings[i].x, bearings[i].y, bearings[i].z);
      M += weights[i] * v * v.transpose();
    }
    normal = least_eigenvector(M);
    const auto d = distances_px(law, lens, normal, line);
    if (!d) return std::nullopt;
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      const double off = dot(normal, bearings[i]);
      // Pixels per radian across the plane, squared.
      const double scale = std::abs(off) > 1e-15 ? (*d)[i] / off : 0;
      const double in_noise = (*d)[i] / (line_loss_scale * noise_px);
      if (scale != 0) weights[i] = scale * scale / (1 + in_noise * in_noise);
    }
  }
  return normal;
}

Vec3 common_direction(std::span<const Vec3> normals) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const Vec3 n : normals) {
    const Eigen::Vector3d v(n.x, n.y, n.z);
    M += v * v.transpose();
  }
  const Vec3 d = least_eigenvector(M);
  return d.y < 0 ? -d : d;
}

}  // namespace calibrate
