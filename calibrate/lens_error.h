// What a lens is off by, and what that does to poses through it.
#pragma once

#include <span>

#include "calibrate/sight.h"

namespace calibrate {

// What a lens is thought to be off by: a smooth field over the picture, which shifts neighbouring
// sights alike, and a scale.
struct LensError {
  double sigma_px = 0;   // along each axis; 0 = unknown, and left out
  double reach_rad = 1;  // angle between sights over which the field changes
  double radius_px = 1;  // at which the scale is off by as much: the picture's RMS along an axis
};
LensError error_of(const Lens& lens);

// How alike the field shifts two sights, 0 to 1. Both are unit.
double likeness(const LensError& error, Vec3 v_cam, Vec3 other);

// The residual, in pixels, of a sight through a lens whose scale is off by 1.
Vec2 scale_shift(const Sight& sight);
// The variance of that scale, without unit.
double scale_variance(const LensError& error);

// J^T C J of a pose's six (PoseMatrix), J the slopes of the sights and C the covariance of the
// residuals that the lens's error makes, pixels^2. Zero if that is unknown.
PoseMatrix lens_part(std::span<const Sight> sights, const Pose& pose, const LensError& error);

}  // namespace calibrate
