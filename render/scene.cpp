// Scenes compiled to Embree's trees.
#include "render/scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "render/blocker_boxes.h"
#include "render/embree_context.h"
#include "render/glass.h"
#include "render/shader.h"
#include "render/transform.h"

namespace render {
namespace {

unsigned mask_of(const Instance& instance) {
  if (instance.kind == ObjectKind::virtual_object) return mask_virtual;
  return mask_stand_in | (instance.blocks_light ? mask_real_blocker : 0U) |
         (instance.occludes ? mask_occluder : 0U);
}

void check(const SceneDescription& scene) {
  const auto fail = [](const std::string& what) { throw std::invalid_argument("scene: " + what); };
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (!scene.meshes[i]) fail("mesh " + std::to_string(i) + " is missing");
    const Mesh& mesh = *scene.meshes[i];
    const std::size_t n = mesh.positions.size();
    const auto bad_size = [n](std::size_t size) { return size != 0 && size != n; };
    if (bad_size(mesh.normals.size()) || bad_size(mesh.uvs.size()) ||
        bad_size(mesh.tangents.size())) {
      fail("mesh " + std::to_string(i) + ": per-vertex arrays differ in length");
    }
    if (mesh.materials.size() != 1 && mesh.materials.size() != mesh.triangles.size()) {
      fail("mesh " + std::to_string(i) + ": needs one material, or one per triangle");
    }
    for (const auto& triangle : mesh.triangles) {
      if (triangle[0] >= n || triangle[1] >= n || triangle[2] >= n) {
        fail("mesh " + std::to_string(i) + ": a triangle names a vertex that is not there");
      }
    }
    for (const std::uint32_t material : mesh.materials) {
      if (material >= scene.materials.size()) {
        fail("mesh " + std::to_string(i) + ": names a material that is not there");
      }
    }
  }
  for (const Instance& instance : scene.instances) {
    if (instance.mesh >= scene.meshes.size()) fail("object " + instance.name + ": mesh is missing");
    for (const float value : instance.set_from_object) {
      if (!std::isfinite(value)) fail("object " + instance.name + ": pose is not finite");
    }
  }
}

}  // namespace

std::size_t triangle_count(const SceneDescription& scene) {
  std::size_t count = 0;
  for (const Instance& instance : scene.instances) {
    count += scene.meshes.at(instance.mesh)->triangles.size();
  }
  return count;
}

struct Scene::Impl {
  // One Embree geometry of a mesh: its opaque triangles, or those that need a filter.
  struct Part {
    const Impl* impl = nullptr;
    std::uint32_t mesh = 0;
    std::uint32_t instance = none;  // none: inside an instanced scene
    const Vec3f* positions = nullptr;
    std::vector<Vec3f> normals;                   // placed; empty: the mesh's own
    std::vector<std::uint32_t> triangle_of_prim;  // empty: prim is the triangle
  };
  static constexpr std::uint32_t none = ~0U;

  std::uint64_t id = 0;
  SceneDescription description;
  std::vector<std::shared_ptr<const Shader>> shaders;  // per material
  std::shared_ptr<const BackgroundShader> background;
  std::vector<std::optional<Glass>> glass;   // per material
  std::vector<std::uint8_t> filtered;        // per material
  std::vector<std::optional<Vec3f>> shadow;  // per material: what passes for shadows anywhere on it
  std::vector<std::uint8_t> may_stand_back;  // per mesh: of a stand-in that does not occlude
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<RTCScene> mesh_scenes;  // of meshes used more than once, else null
  std::vector<std::unique_ptr<Part>> parts;
  std::vector<const Part*> part_of_geometry;            // top level, null for instances
  std::vector<std::uint32_t> instance_of_geometry;      // top level
  std::vector<std::vector<const Part*>> parts_of_mesh;  // inside instanced scenes
  std::vector<std::array<float, 9>> normal_matrices;    // per instance
  std::vector<std::uint8_t> mirrored;                   // per instance: inside out by its matrix
  Bounds virtual_bounds{};
  Bounds all_bounds{};
  Bounds blocker_bounds = no_bounds;
  std::vector<Bounds> blocker_boxes;
  std::size_t skipped = 0;
  bool real_blockers = false;
  bool filters = false;
  bool has_glass = false;

  ~Impl() {
    for (RTCScene s : mesh_scenes) {
      if (s) rtcReleaseScene(s);
    }
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  void build();
  void add_parts(std::uint32_t mesh_index, std::uint32_t instance, unsigned mask, RTCScene target);
  void add_part(std::uint32_t mesh_index,
                std::uint32_t instance,
                unsigned mask,
                RTCScene target,
                bool with_filter,
                const std::vector<std::uint32_t>& triangles,
                bool all);
  void grow(Bounds& bounds, const std::array<float, 12>& m, const Mesh& mesh) const;

  const Part& part(unsigned geom_id, unsigned inst_id, std::uint32_t& instance) const {
    if (inst_id == RTC_INVALID_GEOMETRY_ID) {
      instance = instance_of_geometry[geom_id];
      return *part_of_geometry[geom_id];
    }
    instance = instance_of_geometry[inst_id];
    return *parts_of_mesh[description.instances[instance].mesh][geom_id];
  }
  HitPoint hit_point(
      unsigned geom_id, unsigned prim_id, unsigned inst_id, float u, float v, Vec3f incoming) const;

  static void filter_closest(const RTCFilterFunctionNArguments* args);
  static void filter_any(const RTCFilterFunctionNArguments* args);
  Vec3f passes(const RTCFilterFunctionNArguments* args, unsigned lane, RayKind kind) const;
  bool stands_back(const RTCFilterFunctionNArguments* args, unsigned lane) const;
};

void Scene::Impl::grow(Bounds& bounds, const std::array<float, 12>& m, const Mesh& mesh) const {
  for (const Vec3f& position : mesh.positions) {
    const Vec3f p = transform_point(m, position);
    if (is_finite(p)) bounds = joined(bounds, {p, p});
  }
}

void Scene::Impl::build() {
  check(description);
  for (const Material& material : description.materials) {
    const std::shared_ptr<const Shader>& shader =
        shaders.emplace_back(find_shader(material.shader));
    shader->check(description, material);
    shadow.push_back(shader->shadow_everywhere(material));
    filtered.push_back(shader->lets_light_through(material) ? 1 : 0);
    glass.push_back(material.shader == "glass" ? std::optional(make_glass(material))
                                               : std::nullopt);
    has_glass = has_glass || glass.back();
  }
  background = find_background(description.background);
  device = rtcNewDevice("");
  if (!device) throw std::runtime_error("Embree could not start on this machine");
  scene = rtcNewScene(device);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);

  std::vector<int> uses(description.meshes.size(), 0);
  may_stand_back.assign(description.meshes.size(), 0);
  for (const Instance& instance : description.instances) {
    ++uses[instance.mesh];
    if (instance.kind == ObjectKind::stand_in && !instance.occludes) {
      may_stand_back[instance.mesh] = 1;
    }
  }
  mesh_scenes.assign(description.meshes.size(), nullptr);
  parts_of_mesh.resize(description.meshes.size());

  virtual_bounds = all_bounds = no_bounds;
  for (std::uint32_t i = 0; i < description.instances.size(); ++i) {
    const Instance& instance = description.instances[i];
    const Mesh& mesh = *description.meshes[instance.mesh];
    normal_matrices.push_back(normal_matrix(instance.set_from_object));
    mirrored.push_back(determinant(instance.set_from_object) < 0 ? 1 : 0);
    grow(all_bounds, instance.set_from_object, mesh);
    if (instance.kind == ObjectKind::virtual_object) {
      grow(virtual_bounds, instance.set_from_object, mesh);
    }
    real_blockers |= instance.kind == ObjectKind::stand_in && instance.blocks_light;
    if (mesh.triangles.empty()) continue;
    if (uses[instance.mesh] == 1) {
      add_parts(instance.mesh, i, mask_of(instance), scene);
      continue;
    }
    RTCScene& inner = mesh_scenes[instance.mesh];
    if (!inner) {
      inner = rtcNewScene(device);
      add_parts(instance.mesh, none, ~0U, inner);
      rtcCommitScene(inner);
    }
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, inner);
    rtcSetGeometryMask(geometry, mask_of(instance));
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                            instance.set_from_object.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, static_cast<unsigned>(part_of_geometry.size()));
    rtcReleaseGeometry(geometry);
    part_of_geometry.push_back(nullptr);
    instance_of_geometry.push_back(i);
  }
  rtcCommitScene(scene);
  blocker_boxes = find_blocker_boxes(description);
  for (const Bounds& box : blocker_boxes) blocker_bounds = joined(blocker_bounds, box);
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
    throw std::runtime_error("Embree could not build the scene (error " +
                             std::to_string(static_cast<int>(error)) + "): is memory short?");
  }
}

void Scene::Impl::add_parts(std::uint32_t mesh_index,
                            std::uint32_t instance,
                            unsigned mask,
                            RTCScene target) {
  const Mesh& mesh = *description.meshes[mesh_index];
  std::vector<std::uint32_t> opaque, with_filter;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (!is_finite(mesh.positions[a]) || !is_finite(mesh.positions[b]) ||
        !is_finite(mesh.positions[c])) {
      ++skipped;
      continue;
    }
    const std::uint32_t material = mesh.materials[mesh.materials.size() == 1 ? 0 : t];
    (filtered[material] ? with_filter : opaque).push_back(t);
  }
  const bool all = with_filter.empty() && opaque.size() == mesh.triangles.size();
  if (!opaque.empty()) add_part(mesh_index, instance, mask, target, false, opaque, all);
  if (!with_filter.empty()) {
    filters = true;
    add_part(mesh_index, instance, mask, target, true, with_filter, false);
  }
}

void Scene::Impl::add_part(std::uint32_t mesh_index,
                           std::uint32_t instance,
                           unsigned mask,
                           RTCScene target,
                           bool with_filter,
                           const std::vector<std::uint32_t>& triangles,
                           bool all) {
  const Mesh& mesh = *description.meshes[mesh_index];
  auto part = std::make_unique<Part>();
  part->impl = this;
  part->mesh = mesh_index;
  part->instance = instance;
  if (!all) part->triangle_of_prim = triangles;

  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                                mesh.positions.size()));
  auto* indices = static_cast<std::array<std::uint32_t, 3>*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              sizeof(std::array<std::uint32_t, 3>), triangles.size()));
  if (!positions || !indices) throw std::runtime_error("not enough memory for a mesh");
  for (std::size_t i = 0; i < triangles.size(); ++i) indices[i] = mesh.triangles[triangles[i]];
  if (instance == none) {
    std::copy(mesh.positions.begin(), mesh.positions.end(), positions);
  } else {
    const auto& m = description.instances[instance].set_from_object;
    std::transform(mesh.positions.begin(), mesh.positions.end(), positions,
                   [&m](Vec3f p) { return transform_point(m, p); });
    part->normals.reserve(mesh.normals.size());
    for (const Vec3f& n : mesh.normals) {
      part->normals.push_back(transform_normal(normal_matrices[instance], n));
    }
  }
  // Vertices that no triangle of ours uses may hold anything; Embree must not see NaN there.
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (!is_finite(positions[i])) positions[i] = {};
  }
  part->positions = positions;
  rtcSetGeometryMask(geometry, mask);
  rtcSetGeometryUserData(geometry, part.get());
  const bool holes = std::ranges::any_of(triangles, [&](std::uint32_t t) {
    return !shadow[mesh.materials[mesh.materials.size() == 1 ? 0 : t]];
  });
  if ((with_filter && holes) || may_stand_back[mesh_index]) {
    rtcSetGeometryIntersectFilterFunction(geometry, filter_closest);
  }
  if (with_filter) rtcSetGeometryOccludedFilterFunction(geometry, filter_any);
  rtcCommitGeometry(geometry);
  if (instance == none) {
    auto& inner = parts_of_mesh[mesh_index];
    rtcAttachGeometryByID(target, geometry, static_cast<unsigned>(inner.size()));
    inner.push_back(part.get());
  } else {
    rtcAttachGeometryByID(target, geometry, static_cast<unsigned>(part_of_geometry.size()));
    part_of_geometry.push_back(part.get());
    instance_of_geometry.push_back(instance);
  }
  rtcReleaseGeometry(geometry);
  parts.push_back(std::move(part));
}

namespace {

// The linear change of the normal over a triangle, made symmetric. `d1` and `d2` are its changes
// along the edges `e1` and `e2`.
void find_turn(Vec3f e1, Vec3f e2, Vec3f d1, Vec3f d2, HitPoint& hit) {
  const float x1 = length(e1);
  if (!(x1 > 0)) return;
  const Vec3f edge = e1 * (1 / x1);
  const Vec3f across = cross(hit.geometric_normal, edge);
  const float x2 = dot(e2, edge), y2 = dot(e2, across);
  // Of a sliver nothing can be said across it.
  if (!(std::abs(y2) > 1e-3F * (x1 + std::abs(x2)))) return;
  const float along_a = dot(d1, edge) / x1, along_b = dot(d1, across) / x1;
  const float across_a = (dot(d2, edge) - along_a * x2) / y2;
  const float across_b = (dot(d2, across) - along_b * x2) / y2;
  hit.edge = edge;
  hit.turn_along = along_a;
  hit.turn_across = across_b;
  hit.turn_both = 0.5F * (along_b + across_a);
}

}  // namespace

HitPoint Scene::Impl::hit_point(
    unsigned geom_id, unsigned prim_id, unsigned inst_id, float u, float v, Vec3f incoming) const {
  HitPoint hit;
  const Part& p = part(geom_id, inst_id, hit.instance);
  const Mesh& mesh = *description.meshes[p.mesh];
  const std::uint32_t t = p.triangle_of_prim.empty() ? prim_id : p.triangle_of_prim[prim_id];
  const auto& [a, b, c] = mesh.triangles[t];
  const float w = 1 - u - v;
  const bool placed = p.instance != none;
  const auto& matrix = description.instances[hit.instance].set_from_object;
  Vec3f p0 = p.positions[a], p1 = p.positions[b], p2 = p.positions[c];
  if (!placed) {
    p0 = transform_point(matrix, p0);
    p1 = transform_point(matrix, p1);
    p2 = transform_point(matrix, p2);
  }
  hit.position = p0 * w + p1 * u + p2 * v;
  const Vec3f area = cross(p1 - p0, p2 - p0);
  const float double_area = length(area);
  hit.geometric_normal = double_area > 0 ? area * (1 / double_area) : -incoming;
  hit.back = dot(hit.geometric_normal, incoming) > 0;
  if (hit.back) hit.geometric_normal = -hit.geometric_normal;
  if (mirrored[hit.instance] != 0) hit.back = !hit.back;
  hit.normal = hit.geometric_normal;
  if (!mesh.normals.empty()) {
    const auto& normals = placed ? p.normals : mesh.normals;
    Vec3f n = normals[a] * w + normals[b] * u + normals[c] * v;
    n = placed ? normalize(n) : transform_normal(normal_matrices[hit.instance], n);
    if (dot(n, n) > 0.5F) {
      const auto turned = [&](std::uint32_t corner) {
        const Vec3f turned_n =
            placed ? normals[corner]
                   : transform_normal(normal_matrices[hit.instance], normals[corner]);
        return dot(n, hit.geometric_normal) < 0 ? -turned_n : turned_n;
      };
      find_turn(p1 - p0, p2 - p0, turned(b) - turned(a), turned(c) - turned(a), hit);
      hit.normal = dot(n, hit.geometric_normal) < 0 ? -n : n;
      // An interpolated normal may lean away from the viewer near silhouettes: bend it back.
      const float away = dot(hit.normal, incoming);
      if (away > -1e-3F) hit.normal = normalize(hit.normal - incoming * (away + 1e-3F));
    }
  }
  if (!mesh.uvs.empty()) {
    const auto &t0 = mesh.uvs[a], &t1 = mesh.uvs[b], &t2 = mesh.uvs[c];
    hit.u = t0[0] * w + t1[0] * u + t2[0] * v;
    hit.v = t0[1] * w + t1[1] * u + t2[1] * v;
    const float uv_area =
        std::abs((t1[0] - t0[0]) * (t2[1] - t0[1]) - (t2[0] - t0[0]) * (t1[1] - t0[1]));
    hit.uv_per_metre = double_area > 0 ? std::sqrt(uv_area / double_area) : 0;
  }
  if (!mesh.tangents.empty()) {
    const auto &t0 = mesh.tangents[a], &t1 = mesh.tangents[b], &t2 = mesh.tangents[c];
    const Vec3f tangent{t0[0] * w + t1[0] * u + t2[0] * v, t0[1] * w + t1[1] * u + t2[1] * v,
                        t0[2] * w + t1[2] * u + t2[2] * v};
    hit.tangent = normalize(transform_vector(matrix, tangent));
    hit.handedness = t0[3];
  }
  hit.material = mesh.materials[mesh.materials.size() == 1 ? 0 : t];
  return hit;
}

Vec3f Scene::Impl::passes(const RTCFilterFunctionNArguments* args,
                          unsigned lane,
                          RayKind kind) const {
  const unsigned n = args->N;
  const Vec3f incoming{RTCRayN_dir_x(args->ray, n, lane), RTCRayN_dir_y(args->ray, n, lane),
                       RTCRayN_dir_z(args->ray, n, lane)};
  const HitPoint hit =
      hit_point(RTCHitN_geomID(args->hit, n, lane), RTCHitN_primID(args->hit, n, lane),
                RTCHitN_instID(args->hit, n, lane, 0), RTCHitN_u(args->hit, n, lane),
                RTCHitN_v(args->hit, n, lane), incoming);
  const ShadeContext context{&description, nullptr};
  return shaders[hit.material]->transmittance(context, description.materials[hit.material], hit,
                                              incoming, kind);
}

// Whether a camera ray passes a real surface that hides nothing: it does where it meets something
// virtual, on either side, before anything real that hides.
bool Scene::Impl::stands_back(const RTCFilterFunctionNArguments* args, unsigned lane) const {
  const unsigned n = args->N;
  if ((RTCRayN_mask(args->ray, n, lane) & mask_stand_in) == 0) return false;
  std::uint32_t met = 0;
  part(RTCHitN_geomID(args->hit, n, lane), RTCHitN_instID(args->hit, n, lane, 0), met);
  const Instance& real = description.instances[met];
  if (real.kind != ObjectKind::stand_in || real.occludes) return false;
  Vec3f origin{RTCRayN_org_x(args->ray, n, lane), RTCRayN_org_y(args->ray, n, lane),
               RTCRayN_org_z(args->ray, n, lane)};
  Vec3f direction{RTCRayN_dir_x(args->ray, n, lane), RTCRayN_dir_y(args->ray, n, lane),
                  RTCRayN_dir_z(args->ray, n, lane)};
  if (RTCHitN_instID(args->hit, n, lane, 0) != RTC_INVALID_GEOMETRY_ID) {
    // Inside an instance the ray is in the object's frame.
    origin = transform_point(real.set_from_object, origin);
    direction = transform_vector(real.set_from_object, direction);
  }
  TraceContext context(RayKind::camera, false);
  RTCRayHit ray{};
  ray.ray = {.org_x = origin.x,
             .org_y = origin.y,
             .org_z = origin.z,
             .tnear = RTCRayN_tnear(args->ray, n, lane),
             .dir_x = direction.x,
             .dir_y = direction.y,
             .dir_z = direction.z,
             .time = 0,
             .tfar = std::numeric_limits<float>::max(),
             .mask = mask_virtual | mask_occluder,
             .id = 0,
             .flags = 0};
  ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context.context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  part(ray.hit.geomID, ray.hit.instID[0], met);
  return description.instances[met].kind == ObjectKind::virtual_object;
}

void Scene::Impl::filter_closest(const RTCFilterFunctionNArguments* args) {
  const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
  const auto& context = *reinterpret_cast<const TraceContext*>(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    if (part.impl->passes(args, i, context.kind) == Vec3f{1, 1, 1} ||
        part.impl->stands_back(args, i)) {
      args->valid[i] = 0;
    }
  }
}

void Scene::Impl::filter_any(const RTCFilterFunctionNArguments* args) {
  const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
  const auto& context = *reinterpret_cast<const TraceContext*>(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    const Mesh& mesh = *part.impl->description.meshes[part.mesh];
    const std::uint32_t prim = RTCHitN_primID(args->hit, args->N, i);
    const std::uint32_t t = part.triangle_of_prim.empty() ? prim : part.triangle_of_prim[prim];
    const auto& anywhere = part.impl->shadow[mesh.materials[mesh.materials.size() == 1 ? 0 : t]];
    const Vec3f share = anywhere ? *anywhere : part.impl->passes(args, i, RayKind::shadow);
    if (share == Vec3f{}) continue;
    if (context.transmittance_r) {
      const unsigned id = RTCRayN_id(args->ray, args->N, i);
      context.transmittance_r[id] *= share.x;
      context.transmittance_g[id] *= share.y;
      context.transmittance_b[id] *= share.z;
    }
    args->valid[i] = 0;
  }
}

Scene::Scene(SceneDescription description) : impl_(std::make_unique<Impl>()) {
  static std::atomic<std::uint64_t> scenes{0};
  impl_->id = ++scenes;
  impl_->description = std::move(description);
  impl_->build();
}

Scene::~Scene() = default;

const SceneDescription& Scene::description() const { return impl_->description; }
std::uint64_t Scene::id() const { return impl_->id; }
RTCSceneTy* Scene::embree() const { return impl_->scene; }
HitPoint Scene::hit_point(
    unsigned geom_id, unsigned prim_id, unsigned inst_id, float u, float v, Vec3f incoming) const {
  return impl_->hit_point(geom_id, prim_id, inst_id, u, v, incoming);
}
Scene::Surface Scene::surface_of(unsigned geom_id, unsigned prim_id, unsigned inst_id) const {
  Surface surface;
  const Impl::Part& part = impl_->part(geom_id, inst_id, surface.instance);
  const std::vector<std::uint32_t>& materials = impl_->description.meshes[part.mesh]->materials;
  const std::uint32_t triangle =
      part.triangle_of_prim.empty() ? prim_id : part.triangle_of_prim[prim_id];
  surface.material = materials[materials.size() == 1 ? 0 : triangle];
  return surface;
}
const Shader& Scene::shader_of(std::uint32_t material) const { return *impl_->shaders[material]; }
const Glass* Scene::glass_of(std::uint32_t material) const {
  const std::optional<Glass>& glass = impl_->glass[material];
  return glass ? &*glass : nullptr;
}
bool Scene::has_glass() const { return impl_->has_glass; }
const BackgroundShader& Scene::background() const { return *impl_->background; }
bool Scene::has_real_blockers() const { return impl_->real_blockers; }
bool Scene::has_filters() const { return impl_->filters; }
Scene::Bounds Scene::virtual_bounds() const { return impl_->virtual_bounds; }
Scene::Bounds Scene::bounds() const { return impl_->all_bounds; }
Scene::Bounds Scene::blocker_bounds() const { return impl_->blocker_bounds; }
const std::vector<Scene::Bounds>& Scene::blocker_boxes() const { return impl_->blocker_boxes; }
std::size_t Scene::skipped_triangles() const { return impl_->skipped; }

}  // namespace render
