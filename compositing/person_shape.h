// What a person is shown as: the billboard of one camera or the visual hull of several, by how far
// off either is for a view from aside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace compositing {

// `automatic`: whichever holds the error that is asked for.
enum class PersonShape : std::uint8_t { automatic, billboard, hull };

// Half of a body's width, and by how much a body is off its billboard's plane; metres, of the made
// walker (hull.md). Through the foot that stands, a step before the body or behind it, that is more
// than through the body's middle.
inline constexpr double half_width_m = 0.18;
inline constexpr double off_foot_m = 0.2, off_body_m = 0.1;

// How far off the outline of a billboard is, in metres on the person, for a view `view_angle_rad`
// about the vertical from its camera's: parallax_m() of `off_plane_m`, and from behind no less than
// from the side.
double billboard_error_m(double view_angle_rad, double off_plane_m);

// How far the outline of a visual hull stands out, in metres on the person, for a view from
// `view_rad`, where its cameras stand at `cameras_rad`: azimuths about the person, of any one sense
// and zero. 0 from each camera's own place; at most 1 m, which fewer than 2 cameras, or 2 in one
// line, are said to err by.
//
// That of a cylinder of half_width_m seen from afar: its hull is a polygon whose sides touch it.
// Between two cameras' lines, `gap` apart, at `off` from the nearer one, a corner stands out by
// cos(gap / 2 - off) / cos(gap / 2) half widths less one. Lines are the same from both ends: from
// behind all cameras the outline is as good, but what it shows is the other side, and the error is
// said to be off_foot_m at least. Heights of cameras and view are not looked at.
double hull_error_m(std::span<const double> cameras_rad, double view_rad);

// One of a person's cameras, as it is at a frame.
struct ShapeCamera {
  double azimuth_rad = 0;  // where it stands about the person
  bool is_good = true;     // its picture is of this moment, and shows the person
};

struct ShapeQuestion {
  PersonShape wanted = PersonShape::automatic;
  std::span<const ShapeCamera> cameras;
  double view_rad = 0;  // azimuth of the view about the person
  double off_plane_m = off_foot_m;
  double error_m = 0.05;      // that is asked for
  bool hull_is_there = true;  // unless the view is from within its box
};

struct ShapeChoice {
  bool hull = false;
  std::size_t camera = 0;   // the billboard's; of a hull, the one that is nearest to the view
  double view_rad = 0;      // between that camera's view and the view asked for, 0..pi
  double error_m = 0;       // stated, of what is chosen
  double hull_error_m = 1;  // stated, of the hull of the good cameras
  bool holds = true;        // error_m is no more than asked for
};

// Automatic: the billboard of the nearest camera while it holds the error, else the hull if it
// does, else whichever errs less. What was chosen `before` stays until another is clearly better
// (by 15 %), or alone holds the error: so a view that trembles does not flicker. Cameras that are
// not good are left out; if none is, the nearest one's billboard is shown. A hull needs two good
// ones. Depends on nothing but its arguments. Throws std::invalid_argument if there is no camera.
ShapeChoice choose_shape(const ShapeQuestion& question, const std::optional<ShapeChoice>& before);

}  // namespace compositing
