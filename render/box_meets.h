// Whether boxes and rays meet. Private to the kernel.
#pragma once

#include <algorithm>

#include "render/scene.h"

namespace render {

inline float part(Vec3f v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

// The stretch of from + t * direction, 0 <= t <= far, inside of a box; first > last: none.
struct Stretch {
  float first, last;
};
inline Stretch inside(const Scene::Bounds& box, Vec3f from, Vec3f direction, float far) {
  Stretch s{0, far};
  for (int axis = 0; axis < 3; ++axis) {
    const float o = part(from, axis), d = part(direction, axis);
    const float low = part(box.lower, axis), high = part(box.upper, axis);
    if (d == 0) {
      if (o < low || o > high) return {1, 0};
      continue;
    }
    const float a = (low - o) / d, b = (high - o) / d;
    s.first = std::max(s.first, std::min(a, b));
    s.last = std::min(s.last, std::max(a, b));
  }
  return s;
}

inline bool meets(const Scene::Bounds& box, Vec3f from, Vec3f direction, float far) {
  const auto [first, last] = inside(box, from, direction, far);
  return first <= last;
}

inline bool overlap(const Scene::Bounds& a, const Scene::Bounds& b) {
  return a.lower.x <= b.upper.x && a.upper.x >= b.lower.x && a.lower.y <= b.upper.y &&
         a.upper.y >= b.lower.y && a.lower.z <= b.upper.z && a.upper.z >= b.lower.z;
}

}  // namespace render
