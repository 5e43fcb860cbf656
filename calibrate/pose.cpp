// Rigid transforms between frames.
#include "calibrate/pose.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace calibrate {
namespace {

// Below this sine of the angle to the vertical, a view counts as straight up or down.
constexpr double vertical_sine = 1e-9;
// How far a rotation's rows may be from orthonormal, and still be taken as one.
constexpr double rotation_tolerance = 1e-3;

bool finite(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Mat3 from_rows(Vec3 a, Vec3 b, Vec3 c) { return {{a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z}}; }
Vec3 row(const Mat3& R, std::size_t i) { return {R.m[i * 3], R.m[i * 3 + 1], R.m[i * 3 + 2]}; }

double determinant(const Mat3& R) { return dot(row(R, 0), cross(row(R, 1), row(R, 2))); }

// The transposed inverse.
Mat3 cofactors_over_determinant(const Mat3& R) {
  const double d = determinant(R);
  return from_rows(cross(row(R, 1), row(R, 2)) / d, cross(row(R, 2), row(R, 0)) / d,
                   cross(row(R, 0), row(R, 1)) / d);
}

// The rotation next to a nearly orthonormal matrix, by Newton's iteration for the polar
// decomposition (Higham, "Computing the Polar Decomposition - with Applications", SIAM J. Sci.
// Stat. Comput. 7(4), 1986).
Mat3 nearest_rotation(Mat3 R) {
  for (int iteration = 0; iteration < 6; ++iteration) {
    const Mat3 inverse_transposed = cofactors_over_determinant(R);
    for (std::size_t i = 0; i < 9; ++i) R.m[i] = 0.5 * (R.m[i] + inverse_transposed.m[i]);
  }
  return R;
}

Pose at_position(const Mat3& cam_from_set_rotation, Vec3 position) {
  return {cam_from_set_rotation, -(cam_from_set_rotation * position)};
}

}  // namespace

Pose inverse(const Pose& b_from_a) {
  const Mat3 R = b_from_a.R.transposed();
  return {R, -(R * b_from_a.t)};
}

Vec3 position_of(const Pose& cam_from_set) { return inverse(cam_from_set).t; }

Pose look_at(Vec3 position, Vec3 look_at, double roll_rad) {
  return pose_from_axis(position, look_at - position, roll_rad);
}

Pose pose_from_axis(Vec3 position, Vec3 axis, double roll_rad) {
  if (!finite(position) || !finite(axis) || !std::isfinite(roll_rad)) {
    throw std::invalid_argument("a pose needs finite numbers");
  }
  if (length(axis) == 0) {
    throw std::invalid_argument("a pose needs a direction to look in, not the point it stands on");
  }
  const Vec3 forward = normalize(axis);
  const bool vertical = std::hypot(forward.x, forward.y) < vertical_sine;
  const Vec3 up = vertical ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  const Vec3 right = normalize(cross(forward, up));
  const Vec3 down = cross(forward, right);
  const double c = std::cos(roll_rad);
  const double s = std::sin(roll_rad);
  return at_position(from_rows(right * c + down * s, down * c - right * s, forward), position);
}

Pose pose_from_rotation(const Mat3& R, Vec3 position) {
  if (!finite(position) || !std::ranges::all_of(R.m, [](double x) { return std::isfinite(x); })) {
    throw std::invalid_argument("a pose needs finite numbers");
  }
  const Mat3 gram = R * R.transposed();
  for (std::size_t i = 0; i < 9; ++i) {
    if (std::abs(gram.m[i] - (i % 4 == 0 ? 1.0 : 0.0)) > rotation_tolerance) {
      throw std::invalid_argument("not a rotation: its rows are not orthonormal to 1e-3");
    }
  }
  if (determinant(R) < 0) {
    throw std::invalid_argument("not a rotation but a mirror image: its determinant is -1");
  }
  return at_position(nearest_rotation(R), position);
}

}  // namespace calibrate
