// Meshes into Embree's trees: once, or fitted again and again where they deform.
#include <algorithm>
#include <limits>
#include <stdexcept>

#include "render/scene_parts.h"
#include "render/transform.h"

namespace render {
namespace {

// Embree leaves out what is farther away when it builds a tree, but not when it fits one.
constexpr float farthest = 1.8e18F;

// Above this a tree is built for the shape itself. A guess: no ray rates stand behind it yet.
constexpr double most_disorder = 4;

bool is_traceable(Vec3f p) {
  return std::abs(p.x) < farthest && std::abs(p.y) < farthest && std::abs(p.z) < farthest;
}

using Triangle = std::array<std::uint32_t, 3>;

Scene::Bounds box_of(const std::vector<Vec3f>& positions, const Triangle& t) {
  const Vec3f a = positions[t[0]], b = positions[t[1]], c = positions[t[2]];
  return joined(joined({a, a}, {b, b}), {c, c});
}

// Calls `use` with every triangle but those of `skipped`, which ascend.
template <class Use>
void for_each_left(std::size_t triangles, const std::vector<std::uint32_t>& skipped, Use use) {
  auto next = skipped.begin();
  for (std::uint32_t t = 0; t < triangles; ++t) {
    if (next != skipped.end() && *next == t) {
      ++next;
    } else {
      use(t);
    }
  }
}

}  // namespace

std::vector<std::uint32_t> untraceable_triangles(const std::vector<Vec3f>& positions,
                                                 const std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> skipped;
  if (std::ranges::all_of(positions, is_traceable)) return skipped;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    if (!is_traceable(positions[a]) || !is_traceable(positions[b]) || !is_traceable(positions[c])) {
      skipped.push_back(t);
    }
  }
  return skipped;
}

Scene::Bounds bounds_of(const Mesh& mesh, const std::array<float, 12>& m) {
  Scene::Bounds bounds = no_bounds;
  for (const Vec3f& position : mesh.positions) {
    if (!is_traceable(position)) continue;
    const Vec3f p = transform_point(m, position);
    if (is_finite(p)) bounds = joined(bounds, {p, p});
  }
  return bounds;
}

// Groups are what begins in the same box of a grid about the shape at rest.
Disorder::Disorder(const std::vector<Vec3f>& rest, const std::vector<Triangle>& triangles)
    : group_of_triangle_(triangles.size(), 0), skipped_(untraceable_triangles(rest, triangles)) {
  constexpr int side = 16;
  Scene::Bounds all = no_bounds;
  for_each_left(triangles.size(), skipped_,
                [&](std::uint32_t t) { all = joined(all, box_of(rest, triangles[t])); });
  const Vec3f size = all.upper - all.lower;
  const float longest = std::max({size.x, size.y, size.z});
  const float per_metre = longest > 1e-30F ? static_cast<float>(side) / longest : 0;
  const auto step = [&](float v) {
    return std::clamp(static_cast<int>(v * per_metre), 0, side - 1);
  };
  groups_ = std::size_t{side} * side * side;
  for_each_left(triangles.size(), skipped_, [&](std::uint32_t t) {
    const Vec3f p = rest[triangles[t][0]] - all.lower;
    group_of_triangle_[t] =
        static_cast<std::uint16_t>((step(p.z) * side + step(p.y)) * side + step(p.x));
  });
  spread_ = spread(rest, triangles, skipped_);
}

double Disorder::spread(const std::vector<Vec3f>& positions,
                        const std::vector<Triangle>& triangles,
                        const std::vector<std::uint32_t>& skipped) const {
  std::vector<Scene::Bounds> boxes(groups_, no_bounds);
  double area = 0;
  for_each_left(triangles.size(), skipped, [&](std::uint32_t t) {
    const Vec3f a = positions[triangles[t][0]];
    area += length(cross(positions[triangles[t][1]] - a, positions[triangles[t][2]] - a));
    Scene::Bounds& box = boxes[group_of_triangle_[t]];
    box = joined(box, box_of(positions, triangles[t]));
  });
  double of_boxes = 0;
  for (const Scene::Bounds& box : boxes) {
    if (!(box.lower.x <= box.upper.x)) continue;
    const Vec3f s = box.upper - box.lower;
    of_boxes += s.x * s.y + s.y * s.z + s.z * s.x;
  }
  return of_boxes / area;
}

double Disorder::of(const Mesh& mesh, const std::vector<std::uint32_t>& skipped) const {
  if (!std::ranges::includes(skipped, skipped_)) return std::numeric_limits<double>::infinity();
  return spread(mesh.positions, mesh.triangles, skipped) / spread_;
}

std::unique_ptr<Scene::MeshTree> Scene::TreePool::take(std::uint32_t mesh) {
  const std::scoped_lock lock(mutex_);
  for (std::unique_ptr<MeshTree>& tree : free_[mesh]) {
    if (tree) return std::move(tree);
  }
  return nullptr;
}

void Scene::TreePool::give_back(std::uint32_t mesh, std::unique_ptr<MeshTree> tree) {
  const std::scoped_lock lock(mutex_);
  for (std::unique_ptr<MeshTree>& place : free_[mesh]) {
    if (place) continue;
    place = std::move(tree);
    return;
  }
}

std::shared_ptr<const Scene::MeshTree> Scene::TreePool::lend(const std::shared_ptr<TreePool>& pool,
                                                             std::uint32_t mesh,
                                                             std::unique_ptr<MeshTree> tree) {
  return {tree.release(), [pool, mesh](const MeshTree* back) {
            pool->give_back(mesh, std::unique_ptr<MeshTree>(const_cast<MeshTree*>(back)));
          }};
}

void Scene::Compiled::build_tree(const SceneDescription& description,
                                 std::uint32_t mesh_index,
                                 bool for_rest,
                                 MeshTree& tree) const {
  tree.clear();
  rtcRetainDevice(device);
  tree.device = device;
  tree.scene = rtcNewScene(device);
  tree.for_rest = for_rest;
  const Mesh& mesh = *description.meshes[mesh_index];
  Target target{tree.scene, tree.parts};
  if (mesh.rest) {
    // Only with these does Embree fit a tree; with any others it builds one without a word.
    rtcSetSceneFlags(tree.scene, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(tree.scene, RTC_BUILD_QUALITY_LOW);
    if (for_rest) target.rest = mesh.rest.get();
  }
  add_parts(description, mesh_index, tree.skipped, target);
  rtcCommitScene(tree.scene);
}

// Which tree a shape has depends on the shape and its rest alone, never on shapes before: so rays
// meet what they meet in the same order, and where two triangles are met at once the same one wins.
std::shared_ptr<const Scene::MeshTree> Scene::Compiled::fit_tree(
    const SceneDescription& description, std::uint32_t mesh_index) const {
  const std::shared_ptr<const Mesh>& mesh = description.meshes[mesh_index];
  std::unique_ptr<MeshTree> tree = pool->take(mesh_index);
  const bool known = tree && (tree->mesh->rest == mesh->rest || *tree->mesh->rest == *mesh->rest) &&
                     (tree->mesh == mesh || tree->mesh->triangles == mesh->triangles);
  if (!known) {
    tree = std::make_unique<MeshTree>();
    tree->mesh = mesh;
    tree->disorder = std::make_unique<const Disorder>(*mesh->rest, mesh->triangles);
  }
  std::vector<std::uint32_t> skipped = untraceable_triangles(mesh->positions, mesh->triangles);
  const bool fits = tree->disorder->of(*mesh, skipped) <= most_disorder;
  const bool as_built = tree->scene && tree->for_rest && tree->skipped == skipped;
  tree->skipped = std::move(skipped);
  tree->bounds = bounds_of(*mesh, Instance{}.set_from_object);
  if (!fits) {
    tree->mesh = mesh;
    build_tree(description, mesh_index, false, *tree);
    check_built(device);
    return TreePool::lend(pool, mesh_index, std::move(tree));
  }
  if (!as_built) {
    tree->mesh = mesh;
    build_tree(description, mesh_index, true, *tree);
  }
  for (unsigned id = 0; id < tree->parts.size(); ++id) {
    std::ranges::transform(mesh->positions, tree->parts[id]->positions,
                           [](Vec3f p) { return is_traceable(p) ? p : Vec3f{}; });
    RTCGeometry geometry = rtcGetGeometry(tree->scene, id);
    rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry);
  }
  rtcCommitScene(tree->scene);
  check_built(device);
  return TreePool::lend(pool, mesh_index, std::move(tree));
}

void Scene::Compiled::add_parts(const SceneDescription& description,
                                std::uint32_t mesh_index,
                                const std::vector<std::uint32_t>& skipped,
                                const Target& target) const {
  const Mesh& mesh = *description.meshes[mesh_index];
  std::vector<std::uint32_t> opaque, with_filter;
  opaque.reserve(mesh.triangles.size());
  for_each_left(mesh.triangles.size(), skipped, [&](std::uint32_t t) {
    (filtered[material_of(mesh, t)] ? with_filter : opaque).push_back(t);
  });
  const bool all = opaque.size() == mesh.triangles.size();
  if (!opaque.empty()) add_part(description, mesh_index, target, false, opaque, all);
  if (!with_filter.empty()) add_part(description, mesh_index, target, true, with_filter, false);
}

void Scene::Compiled::add_part(const SceneDescription& description,
                               std::uint32_t mesh_index,
                               const Target& target,
                               bool with_filter,
                               const std::vector<std::uint32_t>& triangles,
                               bool all) const {
  const Mesh& mesh = *description.meshes[mesh_index];
  auto part = std::make_unique<Part>();
  part->mesh = mesh_index;
  part->instance = target.instance;
  part->filtered = with_filter;
  if (!all) part->triangle_of_prim = triangles;

  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (mesh.rest) {
    rtcSetGeometryBuildQuality(geometry,
                               target.rest ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_LOW);
  }
  auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                                mesh.positions.size()));
  Triangle* indices = nullptr;
  if (all) {
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(Triangle), mesh.triangles.size());
  } else {
    indices = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), triangles.size()));
  }
  if (!positions || (!indices && !all)) throw std::runtime_error("not enough memory for a mesh");
  if (!all) {
    for (std::size_t i = 0; i < triangles.size(); ++i) indices[i] = mesh.triangles[triangles[i]];
  }
  if (target.instance == Part::none) {
    std::ranges::copy(target.rest ? *target.rest : mesh.positions, positions);
  } else {
    const auto& m = description.instances[target.instance].set_from_object;
    std::transform(mesh.positions.begin(), mesh.positions.end(), positions,
                   [&m](Vec3f p) { return transform_point(m, p); });
    part->normals.reserve(mesh.normals.size());
    for (const Vec3f& n : mesh.normals) {
      part->normals.push_back(transform_normal(normal_matrices[target.instance], n));
    }
  }
  // Vertices that no triangle of ours uses may hold anything; Embree must not see NaN there.
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (!is_traceable(positions[i])) positions[i] = {};
  }
  part->positions = positions;
  rtcSetGeometryMask(geometry, target.mask);
  rtcSetGeometryUserData(geometry, part.get());
  const bool holes = std::ranges::any_of(
      triangles, [&](std::uint32_t t) { return !shadow[material_of(mesh, t)]; });
  if ((with_filter && holes) || may_stand_back[mesh_index]) {
    rtcSetGeometryIntersectFilterFunction(geometry, Impl::filter_closest);
  }
  if (with_filter) rtcSetGeometryOccludedFilterFunction(geometry, Impl::filter_any);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(target.scene, geometry, static_cast<unsigned>(target.parts.size()));
  rtcReleaseGeometry(geometry);
  target.parts.push_back(std::move(part));
}

}  // namespace render
