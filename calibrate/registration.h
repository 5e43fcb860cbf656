// The pose of a camera from points of the set that it sees, at any angle to its axis.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibrate/lens_error.h"
#include "calibrate/sight.h"

namespace calibrate {

struct RegistrationOptions {
  // Standard deviation of a sight along each pixel axis that is to be expected; residuals that are
  // larger than that raise the uncertainty, smaller ones do not lower it.
  double noise_px = 0.5;
  // Raises the uncertainty only; more sights do not lower it. A turn by which all of the lens's
  // directions are off is none of it: the pose takes it back.
  LensError lens = {};
};

struct Registration {
  Pose cam_from_set;
  PoseMatrix covariance;           // of turn and move, see PoseMatrix
  double turn_sigma_rad = 0;       // root of the turn's total variance
  double position_sigma_m = 0;     // and of the position's
  double rms_px = 0;               // length of residuals, of the sights that agree
  std::vector<Vec2> residuals_px;  // of every sight: where the pose puts it, from where it is seen
  std::vector<bool> agrees;        // false: taken for wrong, and without a say in the pose
  // The best of other poses that explain the sights too, as the two of a small plane seen from
  // afar.
  std::optional<Pose> rival;
  double rival_rms_px = 0;
  bool ambiguous = false;             // the rival explains them nearly as well
  std::vector<std::string> warnings;  // for people
};

// From four sights or more, in one plane or not. A third may be wrong, one of six to eight; all of
// four or five are believed. 40 sights take below 1 ms.
//
// Poses of three sights each (pose_seeds.h), after Fischler and Bolles, "Random Sample Consensus",
// CACM 24(6), 1981. The best of them are refined with Cauchy's loss over all sights (refine_pose),
// so that no lens, plane or angle is special. Of a plane, the pose with its normal mirrored about
// the line of sight is tried too: Schweighofer and Pinz, "Robust Pose Estimation from a Planar
// Target", IEEE PAMI 28(12), 2006. Sights that lie beyond four standard deviations are left out of
// the final least squares; of up to twelve, those without which all is explained at the least cost.
//
// Throws std::invalid_argument for sights that are not finite, or noise that is not above 0;
// std::runtime_error, saying what to do, if there are fewer than four different points, if they
// lie on a line, if they do not agree on a pose, or leave it open.
Registration register_camera(std::span<const Sight> sights,
                             const RegistrationOptions& options = {});

}  // namespace calibrate
