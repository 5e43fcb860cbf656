// Markers of a made set, seen by a made fish-eye.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "calibrate/angles.h"
#include "calibrate/registration.h"

namespace made {

using calibrate::degree;

// Sees up to 110 degrees off its axis.
inline calibrate::Lens fish_eye() {
  return {
      "kannala_brandt", 1280, 1280, {330, 330, 639.5, 639.5, -0.02, 0.003, -0.0004}, 110 * degree};
}

class Random {
 public:
  explicit Random(unsigned seed) : bits_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits_()) + 0.5) / 4294967296.0;
  }
  double normal() {
    return std::sqrt(-2 * std::log(uniform(0, 1))) * std::cos(2 * std::numbers::pi * uniform(0, 1));
  }
  calibrate::Vec3 direction() {
    return calibrate::normalize(calibrate::Vec3{normal(), normal(), normal()});
  }

 private:
  std::mt19937 bits_;
};

inline calibrate::Pose random_pose(Random& random) {
  return calibrate::pose_from_axis({2 * random.normal(), 2 * random.normal(), random.normal()},
                                   random.direction(), random.uniform(0, 2 * std::numbers::pi));
}

// A camera, and what it sees of markers.
struct MarkerScene {
  calibrate::Pose cam_from_set;
  std::vector<calibrate::Sight> sights;
};

// The sight of a point with noise in its pixels, if the lens sees it.
inline std::optional<calibrate::Sight> noisy_sight(const calibrate::Lens& lens,
                                                   const calibrate::Pose& cam_from_set,
                                                   calibrate::Vec3 p_set,
                                                   double noise_px,
                                                   Random& random) {
  const auto q = project(lens, cam_from_set * p_set);
  if (!q) return std::nullopt;
  return sight_of(lens, {q->x + noise_px * random.normal(), q->y + noise_px * random.normal()},
                  p_set);
}

// Markers evenly over the directions up to an angle off the axis, 1 to 4 m away.
inline MarkerScene random_markers(std::size_t count,
                                  double angle_rad,
                                  double noise_px,
                                  Random& random) {
  MarkerScene scene{random_pose(random), {}};
  const calibrate::Pose set_from_cam = inverse(scene.cam_from_set);
  while (scene.sights.size() < count) {
    const double cosine = random.uniform(std::cos(angle_rad), 1);
    const double sine = std::sqrt(1 - cosine * cosine);
    const double turn = random.uniform(0, 2 * std::numbers::pi);
    const calibrate::Vec3 p_cam =
        random.uniform(1, 4) *
        calibrate::Vec3{sine * std::cos(turn), sine * std::sin(turn), cosine};
    if (const auto sight =
            noisy_sight(fish_eye(), scene.cam_from_set, set_from_cam * p_cam, noise_px, random)) {
      scene.sights.push_back(*sight);
    }
  }
  return scene;
}

// Markers in a square of 2 m, up to `thickness_m` off it, that the camera sees from 1 to 3 m, its
// axis up to an angle off the middle.
inline MarkerScene flat_markers(
    std::size_t count, double angle_rad, double thickness_m, double noise_px, Random& random) {
  for (;;) {
    MarkerScene scene;
    const calibrate::Vec3 position{random.uniform(-2, 2), random.uniform(-2, 2),
                                   random.uniform(0.7, 2)};
    scene.cam_from_set =
        calibrate::look_at(position, {0, 0, 0}, random.uniform(0, 2 * std::numbers::pi));
    const double off = random.uniform(0, angle_rad);
    const double c = std::cos(off);
    const double s = std::sin(off);
    scene.cam_from_set = calibrate::Pose{{{c, 0, s, 0, 1, 0, -s, 0, c}}, {}} * scene.cam_from_set;
    for (std::size_t tries = 0; tries < 5 * count && scene.sights.size() < count; ++tries) {
      const calibrate::Vec3 p{random.uniform(-1, 1), random.uniform(-1, 1),
                              random.uniform(-thickness_m, thickness_m)};
      if (const auto sight = noisy_sight(fish_eye(), scene.cam_from_set, p, noise_px, random)) {
        scene.sights.push_back(*sight);
      }
    }
    if (scene.sights.size() == count) return scene;
  }
}

// The first `wrong` sights are taken for the one that follows.
inline void mistake_markers(std::vector<calibrate::Sight>& sights, std::size_t wrong) {
  for (std::size_t i = 0; i < wrong; ++i) sights[i].p_set = sights[i + 1].p_set;
}

struct PoseError {
  double turn_rad = 0;
  double position_m = 0;
};

inline PoseError error_of(const calibrate::Pose& found, const calibrate::Pose& truth) {
  const calibrate::Mat3 turn = found.R * truth.R.transposed();
  double squares = 0;  // of R - 1: 8 sin^2(angle / 2), which is exact for small angles
  for (std::size_t i = 0; i < 9; ++i) {
    const double d = turn.m[i] - (i % 4 == 0 ? 1 : 0);
    squares += d * d;
  }
  return {2 * std::asin(std::min(1.0, std::sqrt(squares / 8))),
          length(position_of(found) - position_of(truth))};
}

// The error in units of its own covariance: chi-square of six degrees of freedom.
inline double chi_square(const calibrate::Registration& found, const calibrate::Pose& truth) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  const calibrate::Mat3 turn = truth.R * found.cam_from_set.R.transposed();
  const auto& m = turn.m;
  const calibrate::Vec3 move = position_of(truth) - position_of(found.cam_from_set);
  Eigen::Matrix<double, 6, 1> error;
  error << (m[7] - m[5]) / 2, (m[2] - m[6]) / 2, (m[3] - m[1]) / 2, move.x, move.y, move.z;
  const Matrix6 covariance = Eigen::Map<const Matrix6>(found.covariance.data());
  return error.dot(covariance.inverse() * error);
}

}  // namespace made
