// A made person who walks: capsules on two legs that swing, as calibrated cameras see them.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"

namespace compositing {

using calibrate::Vec2;
using calibrate::Vec3;

struct Capsule {
  Vec3 a, b;
  double radius = 0;
};

// One foot: its lower edge is two spheres' and what is between them.
struct MadeFoot {
  Vec3 heel, toe;  // centres of the spheres
  bool planted = false;
};
inline constexpr double foot_radius_m = 0.04;

struct MadeWalker {
  Vec3 start{0, 7, 0};
  Vec3 way{0, -1, 0};  // unit vector
  double speed_m_s = 1.2;
  double step_m = 0.65;

  // Foot 0 or 1 when the body has gone `gone` metres. A foot stands while the body passes from 0.6
  // steps behind it to 0.6 steps before it.
  MadeFoot foot(int side, double gone) const;
  // Foot, calf, thigh and arm of each side, torso, head.
  std::vector<Capsule> shape(double time_s) const;
};

struct MadeView {
  calibrate::Lens lens;
  calibrate::Pose cam_from_set;
  calibrate::DirectionTable directions = calibrate::make_direction_table(lens);
  Vec3 camera() const { return calibrate::position_of(cam_from_set); }
};

// 1.5 m above the floor, looking along +y and 10 degrees down.
inline MadeView made_view(const calibrate::Lens& lens) {
  return {lens, calibrate::look_at({0, 0, 1.5}, {0, 5, 0.62}, 0)};
}
inline calibrate::Lens pinhole_lens() { return {"pinhole", 1280, 720, {900, 900, 639.5, 359.5}}; }
inline calibrate::Lens bent_lens() {
  return {"kannala_brandt", 1280, 720, {820, 824, 645, 352, -0.02, 0.004}};
}

// How deep below the horizon the lower edge of a sphere is seen from the camera, in radians.
double lower_edge_rad(const MadeView& view, Vec3 centre);

// The end of a foot that is lowest in the picture, whose foot it is, and how deep.
struct Lowest {
  Vec3 centre;
  double below_rad = 0;
  int side = 0;
  bool planted = false;
};
Lowest lowest_of(const MadeView& view, const MadeWalker& walker, double time_s);

// Distance between a ray from the origin and a segment, and how far along the ray.
std::pair<double, double> ray_to(Vec3 v, Vec3 a, Vec3 b);

// Alpha (height, width, 1): soft over a pixel at the edges. Parts add up as the nearest edge says.
void draw(capture::Image& matte, const MadeView& view, const std::vector<Capsule>& shape);
capture::Image matte_of(const MadeView& view, const MadeWalker& walker, double time_s);

// The walker in clothes, (height, width, 4): scene-linear, premultiplied, the mean of `detail` by
// `detail` rays a pixel. Colours and shading belong to the places of the body, so that all cameras
// see the same ones. Pinhole lenses only: std::invalid_argument for others.
capture::Image photograph_of(const calibrate::Lens& lens,
                             const calibrate::Pose& cam_from_set,
                             const MadeWalker& walker,
                             double time_s,
                             int detail = 4);

// The height above the floor at which the lowest edge is drawn on an upright billboard through
// `standing` that faces the camera. Below 0 it is cut off.
double drawn_height_m(const MadeView& view, Vec3 standing, const Lowest& lowest);

}  // namespace compositing
