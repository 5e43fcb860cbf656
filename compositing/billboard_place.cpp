// Where a person's billboard stands, which way it turns, and how large it is.
#include "compositing/billboard_place.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "calibrate/angles.h"

namespace compositing {

using calibrate::Vec2;
using calibrate::Vec3;

namespace {

constexpr double widest_turn_rad = 1.3;
constexpr double shallow_slack_rad = 0.5 * calibrate::degree;  // what nobody sees is not told
constexpr double furthest = 20;                                // times the camera's distance
constexpr double most_nearer_m = 1;  // for the lower edges: two feet stand no further apart
constexpr double least_away = 0.2;   // of what it was
constexpr double straight_m = 1e-3;  // what is nearer than this to the vertical has no azimuth

std::optional<double> azimuth(Vec3 from, Vec3 to) {
  const double x = to.x - from.x, y = to.y - from.y;
  if (!(calibrate::hypotenuse(x, y) > straight_m)) return std::nullopt;
  return std::atan2(y, x);
}

// Places along the box's outline, its corners among them: lenses bend the sides.
std::vector<Vec2> outline(const std::array<float, 4>& box) {
  constexpr int steps = 16;
  const double left = box[0], top = box[1], right = box[2], bottom = box[3];
  std::vector<Vec2> places;
  for (int i = 0; i <= steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    const double x = left + s * (right - left), y = top + s * (bottom - top);
    places.insert(places.end(), {{x, top}, {x, bottom}, {left, y}, {right, y}});
  }
  return places;
}

// On the plane: across, to the right as seen from its front, and up.
struct Extent {
  double left = std::numeric_limits<double>::infinity(), right = -left;
  double low = left, high = -left;
};

}  // namespace

std::optional<BillboardPlace> place_billboard(const calibrate::Lens& lens,
                                              const calibrate::Pose& cam_from_set,
                                              Vec3 standing,
                                              const std::array<float, 4>& box,
                                              Vec3 viewer,
                                              double turn_rad,
                                              std::span<const Vec2> lower) {
  const Vec3 camera = calibrate::position_of(cam_from_set);
  if (!is_finite(camera) || !is_finite(standing) || !is_finite(viewer)) return std::nullopt;
  if (!std::isfinite(turn_rad) || !(box[2] > box[0]) || !(box[3] > box[1])) return std::nullopt;
  if (!std::ranges::all_of(box, [](float edge) { return std::isfinite(edge); }))
    return std::nullopt;
  const auto to_camera = azimuth(standing, camera);
  if (!to_camera) return std::nullopt;

  BillboardPlace place;
  const Facing facing = face(*to_camera, azimuth(standing, viewer).value_or(*to_camera), turn_rad);
  place.view_angle_rad = facing.view_angle_rad;
  place.shallow = facing.shallow;
  const Vec3 front{std::cos(facing.azimuth_rad), std::sin(facing.azimuth_rad), 0},
      across{-front.y, front.x, 0};

  const double distance = calibrate::hypotenuse(camera.x - standing.x, camera.y - standing.y);
  const calibrate::Mat3 set_from_cam = cam_from_set.R.transposed();
  const double through_standing = dot(camera - standing, front);
  double away = through_standing;
  for (const auto& v_cam : calibrate::unproject_all(lens, lower)) {
    if (!v_cam) continue;
    const Vec3 v = set_from_cam * *v_cam;
    const double k = (standing.z - camera.z) / v.z;
    if (k > 0 && k < furthest * distance) away = std::min(away, -k * dot(v, front));
  }
  away = std::max({away, through_standing - most_nearer_m, least_away * through_standing});
  const Vec3 foot = standing + (through_standing - away) * front;  // of the plane, on the floor
  Extent extent;
  for (const auto& v_cam : calibrate::unproject_all(lens, outline(box))) {
    if (!v_cam) continue;
    const Vec3 v = set_from_cam * *v_cam;
    const double k = -away / dot(v, front);
    if (!(k > 0 && k < furthest * distance)) continue;
    const Vec3 p = camera + k * v - foot;
    const double x = dot(p, across);
    extent.left = std::min(extent.left, x);
    extent.right = std::max(extent.right, x);
    extent.low = std::min(extent.low, p.z);
    extent.high = std::max(extent.high, p.z);
  }
  extent.low = std::max(extent.low, 0.0);
  if (!(extent.right > extent.left && extent.high > extent.low)) return std::nullopt;

  const double wide = extent.right - extent.left, middle = 0.5 * (extent.left + extent.right);
  const Vec3 at = foot + middle * across + Vec3{0, 0, extent.low};
  const auto f = [](double value) { return static_cast<float>(value); };
  place.set_from_object = {f(wide * across.x),
                           f(-front.x),
                           0,
                           f(at.x),
                           f(wide * across.y),
                           f(-front.y),
                           0,
                           f(at.y),
                           0,
                           0,
                           f(extent.high - extent.low),
                           f(at.z)};
  if (!std::ranges::all_of(place.set_from_object, [](float v) { return std::isfinite(v); }))
    return std::nullopt;
  return place;
}

Facing face(double own_rad, double viewer_rad, double turn_rad) {
  const double off = std::remainder(viewer_rad - own_rad, 2 * std::numbers::pi);
  const double most = std::clamp(turn_rad, 0.0, widest_turn_rad);
  return {own_rad + std::clamp(off, -most, most), std::abs(off),
          std::abs(off) > most + shallow_slack_rad};
}

double parallax_m(double depth_m, double view_angle_rad) {
  if (!std::isfinite(depth_m) || !std::isfinite(view_angle_rad)) return 0;
  return std::abs(depth_m * std::sin(view_angle_rad));
}

}  // namespace compositing
