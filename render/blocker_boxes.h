// Boxes around what may block light, for culling. Private to the kernel.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "render/scene.h"

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

inline bool blocks(const Instance& instance) {
  return instance.kind == ObjectKind::virtual_object || instance.blocks_light;
}

// At most 16 boxes that hold all triangles of the set which block light and do not move: halved
// four times along the longest side. Triangles that are not finite block nothing.
std::vector<Scene::Bounds> find_blocker_boxes(const SceneDescription& scene);

}  // namespace render
