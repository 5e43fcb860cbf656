// Planes through the camera, in which the straight lines of the scene lie.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/line_marks.h"
#include "calibrate/vec.h"

namespace calibrate {

// How far from the centre a direction at an angle t off the axis is seen.
enum class FisheyeLaw {
  equisolid,    // 2 f sin(t / 2)
  equidistant,  // f t
};

// The scale of Cauchy's loss, in standard deviations of a mark.
constexpr double line_loss_scale = 2;

// How many pixels a mark lies off the image of a plane through the camera, to first order. `lens`
// is f, cx, cy. False where the lens has no direction for the pixel.
template <class T>
bool distance_px(FisheyeLaw law, const T* lens, const T* normal, Vec2 q, T& distance) {
  using std::asin;
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T x = T(q.x) - lens[1];
  const T y = T(q.y) - lens[2];
  const T r = sqrt(x * x + y * y + T(1e-12));
  const T& f = lens[0];
  if (!(f > T(0))) return false;
  T angle, slope;  // off the axis, and its derivative by r
  if (law == FisheyeLaw::equisolid) {
    const T s = r / (T(2) * f);
    if (!(s < T(0.9999))) return false;
    angle = T(2) * asin(s);
    slope = T(1) / (f * sqrt(T(1) - s * s));
  } else {
    angle = r / f;
    if (!(angle < T(0.9999 * std::numbers::pi))) return false;
    slope = T(1) / f;
  }
  const T along = (normal[0] * x + normal[1] * y) / r;
  const T across = (normal[1] * x - normal[0] * y) / r;
  const T sine = sin(angle);
  const T cosine = cos(angle);
  const T off = sine * along + cosine * normal[2];
  const T by_radius = slope * (cosine * along - sine * normal[2]);
  const T by_turn = sine / r * across;
  distance = off / sqrt(by_radius * by_radius + by_turn * by_turn + T(1e-18));
  return true;
}

// Of a line's marks; nothing if the lens does not see one of them.
std::optional<std::vector<double>> distances_px(FisheyeLaw law,
                                                const std::array<double, 3>& lens,
                                                Vec3 normal,
                                                const MarkedLine& line);

// The normal of one line's plane, whatever it may be parallel to: steps of weighted least squares
// towards the least sum of losses.
std::optional<Vec3> plane_of(FisheyeLaw law,
                             const std::array<double, 3>& lens,
                             const MarkedLine& line,
                             double noise_px);

// The unit direction that the planes with these normals have most nearly in common, y >= 0.
Vec3 common_direction(std::span<const Vec3> normals);

}  // namespace calibrate
