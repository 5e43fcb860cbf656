// Where a board is, from the bearings of its corners.
#pragma once

#include <optional>
#include <span>

#include "calibrate/pose.h"

namespace calibrate {

// A board's pose, and how well the bearings agree with it.
struct BoardPose {
  Pose cam_from_board;
  double error_rad = 0;  // RMS angle between bearings and corners
};

// Rough: the homography's pose and two steps, to compare lenses by. Both: either pose of the plane,
// refined.
enum class PoseEffort { rough, both };

// The pose of a flat board whose corners lie at `p_board` (z = 0, metres) and are seen along the
// unit directions `bearings`, at any angle off the axis but within some 80 degrees of their mean.
// Nothing if there are fewer than 6, or they do not tell (in one line, not finite). Not robust.
//
// Zhang, "A Flexible New Technique for Camera Calibration", IEEE PAMI 22(11), 2000, section 3.1, on
// the plane perpendicular to the mean bearing; then Gauss-Newton steps on the angles, from this
// pose and from the one that nearly looks the same, its normal mirrored at the line of sight
// (Schweighofer and Pinz, "Robust Pose Estimation from a Planar Target", IEEE PAMI 28(12), 2006).
std::optional<BoardPose> find_board_pose(std::span<const Vec3> bearings,
                                         std::span<const Vec3> p_board,
                                         PoseEffort effort = PoseEffort::both);

}  // namespace calibrate
