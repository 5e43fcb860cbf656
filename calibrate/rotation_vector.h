// Rotations as vectors: axis times angle, as mrcal's rt transforms have it.
#pragma once

#include "calibrate/vec.h"

namespace calibrate {

// Rodrigues's formula; any length, radians.
Mat3 rotation_of(Vec3 rotation_vector);

// Its inverse, of a length up to pi.
Vec3 rotation_vector(const Mat3& R);

// rotation_of(r + dr) = rotation_of(left_jacobian(r) dr) rotation_of(r), for small dr.
Mat3 left_jacobian(Vec3 r);

}  // namespace calibrate
