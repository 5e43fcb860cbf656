// What a lens is off by, and what that does to poses through it.
#include "calibrate/lens_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

namespace calibrate {
namespace {

// Of made calibrations of normal lenses and fish-eyes, from 6 to 30 views, the poses are off by
// what is told (lens_error_in_pose_test.cpp) if their lenses' errors change over this share of the
// picture's diagonal, and if this share of their variance more is one of scale.
constexpr double lens_error_reach = 0.3;
constexpr double lens_error_in_scale = 0.3;

}  // namespace

LensError error_of(const Lens& lens) {
  const double diagonal_px = std::hypot(lens.width, lens.height);
  LensError error{lens.error_px, 1, diagonal_px / std::sqrt(24.0)};
  const Vec2 middle{0.5 * (lens.width - 1), 0.5 * (lens.height - 1)};
  if (const auto sight = sight_of(lens, middle, {})) {
    error.reach_rad = lens_error_reach * diagonal_px / length(sight->right);
  }
  return error;
}

double likeness(const LensError& error, Vec3 v_cam, Vec3 other) {
  const double angle = std::acos(std::clamp(dot(v_cam, other), -1.0, 1.0)) / error.reach_rad;
  return std::exp(-0.5 * angle * angle);
}

Vec2 scale_shift(const Sight& sight) {
  const Vec3 v = sight.v_cam;
  const double sine = std::hypot(v.x, v.y);
  if (sine < 1e-9) return {0, 0};
  // Away from the axis, and as far as the angle off it.
  const Vec3 out = Vec3{v.x * v.z / sine, v.y * v.z / sine, -sine} * std::atan2(sine, v.z);
  return {dot(sight.right, out), dot(sight.down, out)};
}

double scale_variance(const LensError& error) {
  return lens_error_in_scale * error.sigma_px * error.sigma_px /
         (error.radius_px * error.radius_px);
}

PoseMatrix lens_part(std::span<const Sight> sights, const Pose& pose, const LensError& error) {
  using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  PoseMatrix result{};
  if (!(error.sigma_px > 0)) return result;
  Eigen::Map<Matrix6> part(result.data());
  std::vector<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> slopes;
  for (const Sight& sight : sights) {
    const SightSlopes told = slopes_of(sight, pose);
    slopes.emplace_back(
        Eigen::Map<const Eigen::Matrix<double, 2, 6, Eigen::RowMajor>>(told.data()));
  }
  const double variance = error.sigma_px * error.sigma_px;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    for (std::size_t j = 0; j < sights.size(); ++j) {
      part += variance * likeness(error, sights[i].v_cam, sights[j].v_cam) * slopes[i].transpose() *
              slopes[j];
    }
  }
  Eigen::Matrix<double, 6, 1> scaled = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const Vec2 away = scale_shift(sights[i]);
    scaled += slopes[i].transpose() * Eigen::Vector2d(away.x, away.y);
  }
  part += scale_variance(error) * scaled * scaled.transpose();
  return result;
}

}  // namespace calibrate
