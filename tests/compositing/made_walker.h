// A made person who walks: capsules on two legs that swing, as a calibrated camera's matte.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
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
  MadeFoot foot(int side, double gone) const {
    const double cycle = 2 * step_m, offset = side * step_m;
    const double n = std::floor((gone - offset + 0.6 * step_m) / cycle);
    const double planted_at = n * cycle + offset, over = gone - (planted_at + 0.6 * step_m);
    double along = planted_at, lift = 0;
    if (over > 0) {
      const double u = std::min(1.0, over / (0.8 * step_m));
      along += cycle * u * u * (3 - 2 * u);
      lift = 0.06 * std::sin(3.14159265358979 * u);
    }
    const Vec3 left{-way.y, way.x, 0};
    const Vec3 ankle =
        start + along * way + (side == 0 ? 0.09 : -0.09) * left + Vec3{0, 0, foot_radius_m + lift};
    return {ankle - 0.07 * way, ankle + 0.14 * way, !(over > 0)};
  }

  std::vector<Capsule> shape(double time_s) const {
    const double gone = speed_m_s * time_s;
    const Vec3 left{-way.y, way.x, 0}, body = start + gone * way;
    std::vector<Capsule> capsules;
    for (const int side : {0, 1}) {
      const MadeFoot f = foot(side, gone);
      const double out = side == 0 ? 1 : -1;
      const Vec3 ankle = f.heel + 0.04 * way + Vec3{0, 0, 0.04};
      const Vec3 hip = body + 0.09 * out * left + Vec3{0, 0, 0.92};
      const Vec3 knee = 0.5 * (ankle + hip) + 0.06 * way;
      const Vec3 shoulder = body + 0.2 * out * left + Vec3{0, 0, 1.42};
      const Vec3 other = foot(1 - side, gone).heel;
      const Vec3 hand =
          body + 0.26 * out * left + (0.4 * dot(other - body, way)) * way + Vec3{0, 0, 0.82};
      capsules.insert(capsules.end(), {{f.heel, f.toe, foot_radius_m},
                                       {ankle, knee, 0.05},
                                       {knee, hip, 0.075},
                                       {shoulder, hand, 0.045}});
    }
    capsules.push_back({body + Vec3{0, 0, 0.98}, body + Vec3{0, 0, 1.38}, 0.17});
    capsules.push_back({body + Vec3{0, 0, 1.55}, body + Vec3{0, 0, 1.63}, 0.1});
    return capsules;
  }
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
inline double lower_edge_rad(const MadeView& view, Vec3 centre) {
  const Vec3 v = centre - view.camera();
  const double level = calibrate::hypotenuse(v.x, v.y);
  return std::atan2(-v.z, level) + std::asin(foot_radius_m / length(v));
}

// The end of a foot that is lowest in the picture, whose foot it is, and how deep.
struct Lowest {
  Vec3 centre;
  double below_rad = 0;
  int side = 0;
  bool planted = false;
};
inline Lowest lowest_of(const MadeView& view, const MadeWalker& walker, double time_s) {
  Lowest lowest;
  for (const int side : {0, 1}) {
    const MadeFoot foot = walker.foot(side, walker.speed_m_s * time_s);
    for (const Vec3 centre : {foot.heel, foot.toe}) {
      const double below = lower_edge_rad(view, centre);
      if (below > lowest.below_rad) lowest = {centre, below, side, foot.planted};
    }
  }
  return lowest;
}

// Distance between a ray from the origin and a segment, and how far along the ray.
inline std::pair<double, double> ray_to(Vec3 v, Vec3 a, Vec3 b) {
  const Vec3 s = b - a;
  const double vs = dot(v, s), ss = dot(s, s), va = dot(v, a), sa = dot(s, a);
  const double det = ss - vs * vs;
  double u = det > 1e-12 ? (va * vs - sa) / det : 0;
  u = std::clamp(u, 0.0, 1.0);
  const Vec3 p = a + u * s;
  const double t = dot(v, p);
  return {length(p - t * v), t};
}

// Alpha (height, width, 1): soft over a pixel at the edges. Parts add up as the nearest edge says.
inline void draw(capture::Image& matte, const MadeView& view, const std::vector<Capsule>& shape) {
  const double focal = view.lens.parameters[0];
  for (const Capsule& c : shape) {
    const Vec3 a = view.cam_from_set * c.a, b = view.cam_from_set * c.b;
    double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
    for (const Vec3 p : {a, b}) {
      const auto q = calibrate::project(view.lens, p);
      if (!q || p.z < 0.1) continue;
      const double margin = 1.3 * focal * c.radius / p.z + 3;
      left = std::min(left, q->x - margin);
      top = std::min(top, q->y - margin);
      right = std::max(right, q->x + margin);
      bottom = std::max(bottom, q->y + margin);
    }
    for (int y = std::max(0, static_cast<int>(top)); y <= std::min(matte.height - 1.0, bottom);
         ++y) {
      for (int x = std::max(0, static_cast<int>(left)); x <= std::min(matte.width - 1.0, right);
           ++x) {
        const std::size_t i = view.directions.index(y, x);
        const Vec3 v = normalize(calibrate::to_double(
            {view.directions.x[i], view.directions.y[i], view.directions.z[i]}));
        const auto [off, along] = ray_to(v, a, b);
        if (!(along > 0.1)) continue;
        const double cover = std::clamp(0.5 + (c.radius - off) * focal / along, 0.0, 1.0);
        float& alpha = matte.at(y, x);
        alpha = std::max(alpha, static_cast<float>(cover));
      }
    }
  }
}

inline capture::Image matte_of(const MadeView& view, const MadeWalker& walker, double time_s) {
  capture::Image matte = capture::make_image(view.lens.height, view.lens.width, 1);
  draw(matte, view, walker.shape(time_s));
  return matte;
}

// The height above the floor at which the lowest edge is drawn on an upright billboard through
// `standing` that faces the camera. Below 0 it is cut off.
inline double drawn_height_m(const MadeView& view, Vec3 standing, const Lowest& lowest) {
  const Vec3 to = standing - view.camera(), v = lowest.centre - view.camera();
  const double away = calibrate::hypotenuse(to.x, to.y);
  const double turned = (v.x * to.x + v.y * to.y) / (calibrate::hypotenuse(v.x, v.y) * away);
  return view.camera().z - std::tan(lowest.below_rad) * away / turned;
}

}  // namespace compositing
