// Rotations as vectors: axis times angle, as mrcal's rt transforms have it.
#include "calibrate/rotation_vector.h"

#include <cmath>

namespace calibrate {
namespace {

// I + a [r]x + b [r]x [r]x.
Mat3 polynomial(Vec3 r, double a, double b) {
  const double diagonal = 1 - b * dot(r, r);
  return {{diagonal + b * r.x * r.x, b * r.x * r.y - a * r.z, b * r.x * r.z + a * r.y,
           b * r.y * r.x + a * r.z, diagonal + b * r.y * r.y, b * r.y * r.z - a * r.x,
           b * r.z * r.x - a * r.y, b * r.z * r.y + a * r.x, diagonal + b * r.z * r.z}};
}

// Below this angle, sines and cosines are their series.
constexpr double small_angle_rad = 1e-4;

}  // namespace

Mat3 rotation_of(Vec3 r) {
  const double t = length(r);
  if (t < small_angle_rad) return polynomial(r, 1 - t * t / 6, 0.5 - t * t / 24);
  return polynomial(r, std::sin(t) / t, (1 - std::cos(t)) / (t * t));
}

Vec3 rotation_vector(const Mat3& R) {
  const Vec3 twice_sine_axis{R.m[7] - R.m[5], R.m[2] - R.m[6], R.m[3] - R.m[1]};
  const double sine = length(twice_sine_axis) / 2;
  const double cosine = (R.m[0] + R.m[4] + R.m[8] - 1) / 2;
  const double angle_rad = std::atan2(sine, cosine);
  if (sine > 1e-6) return twice_sine_axis * (angle_rad / (2 * sine));
  if (cosine > 0) return twice_sine_axis / 2;
  // Half a turn: R + I is twice the axis's outer product; its longest column shows the axis.
  Vec3 axis;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec3 column{R.m[j] + (j == 0), R.m[3 + j] + (j == 1), R.m[6 + j] + (j == 2)};
    if (length(column) > length(axis)) axis = column;
  }
  return normalize(axis) * angle_rad;
}

Mat3 left_jacobian(Vec3 r) {
  const double t = length(r);
  if (t < small_angle_rad) return polynomial(r, 0.5 - t * t / 24, 1.0 / 6 - t * t / 120);
  return polynomial(r, (1 - std::cos(t)) / (t * t), (t - std::sin(t)) / (t * t * t));
}

}  // namespace calibrate
