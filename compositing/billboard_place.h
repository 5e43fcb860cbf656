// Where a person's billboard stands, which way it turns, and how large it is.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace compositing {

struct BillboardPlace {
  // 3 x 4, row by row, of make_billboard_mesh(): unit square x -0.5..0.5, z 0..1, y = 0, front to
  // -y. Vertical.
  std::array<float, 12> set_from_object{};
  bool shallow = false;       // the view is further round than asked for, by half a degree or more
  double view_angle_rad = 0;  // between both views, about the vertical, 0..pi
};

// A vertical rectangle through `standing` (on the floor), turned about the vertical towards
// `viewer`, but at most `turn_rad` (0..1.3) away from facing the person's camera, just large enough
// that the part `box` (left, top, right, bottom in pixels of the lens's picture) of that camera's
// picture falls on it, never below the floor. What falls further away than 20 times the camera's
// distance is left out. A viewer straight above counts as the person's camera.
// `lower`: pixels (Feet::lower) that are not to fall below the floor either: the rectangle comes
// nearer to the camera for them, by at most 1 m, which changes nothing in that camera's view.
// Nothing if the box is empty or falls wholly below the floor or behind, if the camera is straight
// above, or anything is not finite.
std::optional<BillboardPlace> place_billboard(const calibrate::Lens& lens,
                                              const calibrate::Pose& cam_from_set,
                                              calibrate::Vec3 standing,
                                              const std::array<float, 4>& box,
                                              calibrate::Vec3 viewer,
                                              double turn_rad,
                                              std::span<const calibrate::Vec2> lower = {});

// An upright thing that turns to a viewer: azimuths about the vertical, of any one sense and zero.
struct Facing {
  double azimuth_rad = 0;
  double view_angle_rad = 0;  // from its own azimuth to the viewer, 0..pi
  bool shallow = false;       // that is more than it turns
};
// From `own_rad` towards `viewer_rad`, but at most `turn_rad` (0..1.3).
Facing face(double own_rad, double viewer_rad, double turn_rad);

// How far a point that stands `depth_m` off the plane is displaced, in metres at the person across
// the view, for a view `view_angle_rad` away from the person's camera's: depth |sin(angle)|, for
// views from afar and a plane that faces the person's camera.
double parallax_m(double depth_m, double view_angle_rad);

}  // namespace compositing
