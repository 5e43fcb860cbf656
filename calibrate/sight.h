// Points of the set as a camera sees them, and the pose that explains them best.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace calibrate {

// A point of the set in a camera's picture.
struct Sight {
  Vec3 v_cam;  // unit, at any angle to the axis
  Vec3 p_set;  // metres
  // How many pixels a direction v_cam + d lies to the right and below, to first order: right . d
  // and down . d. Perpendicular to v_cam.
  Vec3 right;
  Vec3 down;
};

// Through a lens; nothing where it sees nothing.
std::optional<Sight> sight_of(const Lens& lens, Vec2 q, Vec3 p_set);
// Without a lens: what are pixels elsewhere are radians here. Throws std::invalid_argument for a
// direction without length.
Sight sight_of(Vec3 v_cam, Vec3 p_set);

// Where the pose puts the point, from where it is seen, in pixels. Of directions far from v_cam, it
// is the angle that counts.
Vec2 residual_of(const Sight& sight, const Pose& cam_from_set);

// A symmetric 6x6 matrix, row by row, over a turn of the camera and a move of it: cam_from_set's
// rotation becomes exp(turn) * R, turn in the camera's frame in radians, its position in the set
// p + move in metres.
using PoseMatrix = std::array<double, 36>;

// Derivatives of residual_of by the pose's six, row by row: right, then down. Zero for a point at
// the camera's own place.
using SightSlopes = std::array<double, 12>;
SightSlopes slopes_of(const Sight& sight, const Pose& cam_from_set);

// What least squares found.
struct RefinedPose {
  Pose cam_from_set;
  double cost = 0;         // the sum of losses
  PoseMatrix information;  // weighted sum of squared derivatives of the residuals, per pixel^2
};

// Levenberg's and Marquardt's steps from `seed`, at most `rounds`. The loss of residual r is
// Cauchy's, s^2 log(1 + r^2 / s^2), with s at least `loss_px` and, while the residuals are large,
// half again their median; plain squares if `loss_px` is infinite. Throws std::invalid_argument for
// no sights.
RefinedPose refine_pose(std::span<const Sight> sights,
                        const Pose& seed,
                        double loss_px,
                        int rounds);

}  // namespace calibrate
