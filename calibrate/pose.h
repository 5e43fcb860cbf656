// Rigid transforms between frames.
#pragma once

#include "calibrate/vec.h"

namespace calibrate {

// b_from_a: p_b = R * p_a + t. A camera's pose is cam_from_set.
// Camera: x right, y down, z forward. Set: metres, z up.
struct Pose {
  Mat3 R;
  Vec3 t;

  Vec3 operator*(Vec3 p) const { return R * p + t; }
  Pose operator*(const Pose& a_from_c) const { return {R * a_from_c.R, R * a_from_c.t + t}; }
  friend bool operator==(const Pose&, const Pose&) = default;
};

Pose inverse(const Pose& b_from_a);

// The origin of frame a, in b's inverse: where a camera stands in the set.
Vec3 position_of(const Pose& cam_from_set);

// cam_from_set of a camera at `position` that looks at `look_at` with the set's z up in its
// picture, then rolled clockwise (as seen through it) by roll_rad. Looking straight up or down, the
// top of the picture points to +y. Throws std::invalid_argument if both points are the same or not
// finite.
Pose look_at(Vec3 position, Vec3 look_at, double roll_rad);

// probe_from_set of a lightprobe whose optical axis points along `axis` in the set; with axis +z
// and no roll its picture's top is +y. Throws as look_at.
Pose pose_from_axis(Vec3 position, Vec3 axis, double roll_rad);

// cam_from_set from a set-to-camera rotation (row-major) and the camera's position in the set.
// Throws std::invalid_argument unless R is a rotation to 1e-3 (it is then made exactly
// orthonormal).
Pose pose_from_rotation(const Mat3& R, Vec3 position);

}  // namespace calibrate
