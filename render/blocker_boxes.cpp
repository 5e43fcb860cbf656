// Boxes around what may block light.
#include "render/blocker_boxes.h"

#include <span>

#include "render/transform.h"

namespace render {
namespace {

constexpr int halvings = 4;

std::vector<Scene::Bounds> bounds_of_blockers(const SceneDescription& scene) {
  std::vector<Scene::Bounds> triangles;
  for (const Instance& instance : scene.instances) {
    if (instance.moves || !blocks(instance)) continue;
    const Mesh& mesh = *scene.meshes[instance.mesh];
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vec3f p = transform_point(instance.set_from_object, mesh.positions[a]);
      const Vec3f q = transform_point(instance.set_from_object, mesh.positions[b]);
      const Vec3f r = transform_point(instance.set_from_object, mesh.positions[c]);
      if (!is_finite(p) || !is_finite(q) || !is_finite(r)) continue;
      triangles.push_back(joined(joined({p, p}, {q, q}), {r, r}));
    }
  }
  return triangles;
}

void split(std::span<Scene::Bounds> part, int depth, std::vector<Scene::Bounds>& boxes) {
  if (part.empty()) return;
  Scene::Bounds all = no_bounds;
  for (const Scene::Bounds& triangle : part) all = joined(all, triangle);
  if (depth == 0 || part.size() < 2) {
    boxes.push_back(all);
    return;
  }
  const Vec3f side = all.upper - all.lower;
  const auto middle_of = [&](const Scene::Bounds& triangle) {
    const Vec3f sum = triangle.lower + triangle.upper;
    return side.x >= side.y && side.x >= side.z ? sum.x : side.y >= side.z ? sum.y : sum.z;
  };
  const std::size_t half = part.size() / 2;
  std::nth_element(
      part.begin(), part.begin() + static_cast<std::ptrdiff_t>(half), part.end(),
      [&](const Scene::Bounds& a, const Scene::Bounds& b) { return middle_of(a) < middle_of(b); });
  split(part.first(half), depth - 1, boxes);
  split(part.subspan(half), depth - 1, boxes);
}

}  // namespace

std::vector<Scene::Bounds> find_blocker_boxes(const SceneDescription& scene) {
  std::vector<Scene::Bounds> triangles = bounds_of_blockers(scene);
  std::vector<Scene::Bounds> boxes;
  split(triangles, halvings, boxes);
  return boxes;
}

}  // namespace render
