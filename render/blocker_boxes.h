// Boxes around what may block light, for culling. Private to the kernel.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "render/scene.h"
#include "render/soft_lights.h"

namespace render {

inline constexpr Scene::Bounds no_bounds{
    {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
     std::numeric_limits<float>::infinity()},
    {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
     -std::numeric_limits<float>::infinity()}};

inline Scene::Bounds joined(const Scene::Bounds& a, const Scene::Bounds& b) {
  return {{std::min(a.lower.x, b.lower.x), std::min(a.lower.y, b.lower.y),
           std::min(a.lower.z, b.lower.z)},
          {std::max(a.upper.x, b.upper.x), std::max(a.upper.y, b.upper.y),
           std::max(a.upper.z, b.upper.z)}};
}

// Whether a ray from any point of `from`, in any direction of a range, may meet anything in
// `things`. Never says no where it is yes.
inline bool may_be_met(const Scene::Bounds& things,
                       const Scene::Bounds& from,
                       const DirectionRange& to) {
  float near_t = 0, far_t = std::numeric_limits<float>::infinity();
  // Leaves those t >= 0 for which t * most >= least.
  const auto reach = [&](float least, float most) {
    if (std::abs(most) < 1e-12F) return least <= 0;
    if (most > 0) {
      near_t = std::max(near_t, least / most);
    } else {
      far_t = std::min(far_t, least / most);
    }
    return near_t <= far_t;
  };
  const auto slab = [&](float lower, float upper, float from_lower, float from_upper, float low,
                        float high) {
    return reach(lower - from_upper, high) && reach(from_lower - upper, -low);
  };
  return slab(things.lower.x, things.upper.x, from.lower.x, from.upper.x, to.lower.x, to.upper.x) &&
         slab(things.lower.y, things.upper.y, from.lower.y, from.upper.y, to.lower.y, to.upper.y) &&
         slab(things.lower.z, things.upper.z, from.lower.z, from.upper.z, to.lower.z, to.upper.z);
}

inline bool blocks(const Instance& instance) {
  return instance.kind == ObjectKind::virtual_object || instance.blocks_light;
}

// At most 16 boxes that hold all triangles of the set which block light and do not move: halved
// four times along the longest side. Triangles that are not finite block nothing.
std::vector<Scene::Bounds> find_blocker_boxes(const SceneDescription& scene);

}  // namespace render
