// Parts of a scene that glow, and those that a camera sees as small.
#include "render/glowing_parts.h"

#include <algorithm>
#include <cmath>

#include "render/blocker_boxes.h"
#include "render/scene_parts.h"
#include "render/transform.h"

namespace render {
namespace {

using Part = Scene::GlowingPart;
using Parts = std::span<Part>;

constexpr int most_cuts = 12;

float along(Vec3f v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

// Calls `call` with each group of boxes that no gap along the axis divides.
template <class F>
void for_each_group(Parts boxes, int axis, F&& call) {
  std::ranges::sort(boxes, {}, [axis](const Part& p) { return along(p.bounds.lower, axis); });
  std::size_t first = 0;
  float end = along(boxes.front().bounds.upper, axis);
  for (std::size_t i = 1; i < boxes.size(); ++i) {
    if (along(boxes[i].bounds.lower, axis) > end) {
      call(boxes.subspan(first, i - first));
      first = i;
    }
    end = std::max(end, along(boxes[i].bounds.upper, axis));
  }
  call(boxes.subspan(first));
}

// Cuts along each axis in turn, until three of them find no gap.
void cut(Parts boxes, int axis, int whole_along, int cuts, std::vector<Part>& parts) {
  if (boxes.size() == 1 || whole_along == 3 || cuts == most_cuts ||
      parts.size() >= most_glowing_parts) {
    Part all{no_bounds};
    for (const auto& [box, radiance] : boxes) {
      all = {joined(all.bounds, box), std::max(all.radiance, radiance)};
    }
    parts.push_back(all);
    return;
  }
  for_each_group(boxes, axis, [&](Parts group) {
    const bool whole = group.size() == boxes.size();
    cut(group, (axis + 1) % 3, whole ? whole_along + 1 : 0, cuts + 1, parts);
  });
}

}  // namespace

std::vector<Part> find_glowing_parts(const Mesh& mesh,
                                     const std::array<float, 12>& set_from_object,
                                     std::span<const float> glow) {
  std::vector<Part> boxes, parts;
  if (std::ranges::none_of(mesh.materials, [&](std::uint32_t m) { return glow[m] > 0; })) {
    return parts;
  }
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const float radiance = glow[material_of(mesh, t)];
    if (!(radiance > 0)) continue;
    Scene::Bounds box = no_bounds;
    bool finite = true;
    for (const std::uint32_t corner : mesh.triangles[t]) {
      const Vec3f p = transform_point(set_from_object, mesh.positions[corner]);
      finite = finite && std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
      box = joined(box, {p, p});
    }
    if (finite) boxes.push_back({box, radiance});
  }
  if (!boxes.empty()) cut(boxes, 0, 0, 0, parts);
  return parts;
}

std::vector<SmallLight> find_small_lights(std::span<const Part> parts,
                                          Vec3f camera,
                                          const CameraTurn& turn,
                                          float pixel_angle) {
  std::vector<SmallLight> lights;
  for (const auto& [box, radiance] : parts) {
    const Vec3f to = (box.lower + box.upper) * 0.5F - camera;
    const float distance = length(to), radius = 0.5F * length(box.upper - box.lower);
    if (!(radius < pixel_angle * distance) || !std::isfinite(distance)) continue;
    lights.push_back({turn.to_camera(to * (1 / distance)), radius / distance, radiance});
  }
  std::ranges::sort(lights, {}, [](const SmallLight& light) { return light.direction.x; });
  return lights;
}

}  // namespace render
