// How a ray's neighbours go on, to first order: where they begin and how they turn.
#pragma once

#include <algorithm>

#include "render/scene.h"

namespace render {

// One of a ray's neighbours, as differences to the ray: of where it is, in metres, and of its unit
// direction.
//
// Igehy, "Tracing Ray Differentials", SIGGRAPH 1999, section 3.
struct RayDifferential {
  Vec3f step, turn;
};

// Of a point on the surface at `hit`, which the ray reached along `incoming` (unit) after
// `distance_m`: the step lies in the surface. What comes in flatter than `least_cosine` is taken to
// come in at that.
inline RayDifferential arrived(
    RayDifferential d, const HitPoint& hit, Vec3f incoming, float distance_m, float least_cosine) {
  const Vec3f moved = d.step + d.turn * distance_m;
  const Vec3f across = moved - incoming * dot(moved, incoming);
  const Vec3f along = incoming * (1 / std::max(-dot(hit.normal, incoming), least_cosine));
  return {across + along * dot(across, hit.normal), d.turn};
}

// How the ray that a surface of unit normal `normal` mirrors turns; `d` has arrived.
inline Vec3f mirrored_turn(const HitPoint& hit, Vec3f normal, Vec3f incoming, RayDifferential d) {
  const Vec3f turned = turn_of_normal(hit, d.step);
  const float cosine = -dot(normal, incoming);
  return d.turn + turned * (2 * cosine) -
         normal * (2 * (dot(turned, incoming) + dot(d.turn, normal)));
}

// The same of the ray that is refracted to `direction` (unit), with `ratio` of the index before the
// surface to that behind it.
inline Vec3f refracted_turn(
    const HitPoint& hit, Vec3f incoming, Vec3f direction, float ratio, RayDifferential d) {
  const Vec3f normal = hit.normal;
  const float from = -dot(normal, incoming);
  const float to = std::max(-dot(normal, direction), 0.05F);
  const float bend = ratio * from - to;
  const Vec3f turned = turn_of_normal(hit, d.step);
  const float less = -(dot(d.turn, normal) + dot(incoming, turned));  // of the cosine
  return d.turn * ratio + turned * bend + normal * (less * ratio * (1 - ratio * from / to));
}

}  // namespace render
