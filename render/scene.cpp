// Scenes compiled to Embree's trees.
#include "render/scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "render/scene_parts.h"
#include "render/srgb_codes.h"
#include "render/transform.h"

namespace render {
namespace {

void check(const SceneDescription& scene) {
  const auto fail = [](const std::string& what) { throw std::invalid_argument("scene: " + what); };
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (!scene.meshes[i]) fail("mesh " + std::to_string(i) + " is missing");
    const Mesh& mesh = *scene.meshes[i];
    const std::size_t n = mesh.positions.size();
    bool fits = true;
    for_each_vertex_array(
        mesh, [&](const auto& values) { fits = fits && (values.empty() || values.size() == n); });
    if (!fits) {
      fail("mesh " + std::to_string(i) + ": per-vertex arrays differ in length");
    }
    if (mesh.rest && mesh.rest->size() != n) {
      fail("mesh " + std::to_string(i) + ": has not as many vertices as at rest");
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
    if (scene.meshes[instance.mesh]->rest && !instance.moves) {
      fail("object " + instance.name + ": its mesh deforms, but it is not one that moves");
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

namespace {

// The linear change of the normal over a triangle, made symmetric. `d1` and `d2` are its changes
// along the edges `e1` and `e2`.
[[gnu::always_inline]] inline void find_turn(
    Vec3f e1, Vec3f e2, Vec3f d1, Vec3f d2, Vec3f geometric_normal, HitPoint& hit) {
  const float x1 = length(e1);
  if (!(x1 > 0)) return;
  const Vec3f edge = e1 * (1 / x1);
  const Vec3f across = cross(geometric_normal, edge);
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

// How texture coordinates, of the corners t0 to t2, grow along a triangle, per metre.
std::pair<Vec3f, Vec3f> uv_slopes(const Facet& facet,
                                  float per_double_area,
                                  const std::array<float, 2>& t0,
                                  const std::array<float, 2>& t1,
                                  const std::array<float, 2>& t2) {
  const auto& [p0, p1, p2] = facet.corners;
  // How the second and the third corner's shares of a point grow.
  const Vec3f second = cross(p2 - p0, facet.normal) * per_double_area;
  const Vec3f third = cross(facet.normal, p1 - p0) * per_double_area;
  return {second * (t1[0] - t0[0]) + third * (t2[0] - t0[0]),
          second * (t1[1] - t0[1]) + third * (t2[1] - t0[1])};
}

}  // namespace

Facet facet_of(const Mesh& mesh,
               const Vec3f* positions,
               std::uint32_t triangle,
               const std::array<float, 12>* set_from_mesh) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  Facet facet{{positions[a], positions[b], positions[c]}, {}, 0, 0, {}, {}};
  for (Vec3f& corner : facet.corners) {
    if (set_from_mesh) corner = transform_point(*set_from_mesh, corner);
    facet.largest_coordinate = std::max(
        {facet.largest_coordinate, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
  }
  const auto& [p0, p1, p2] = facet.corners;
  const Vec3f area = cross(p1 - p0, p2 - p0);
  const float double_area = length(area);
  if (!(double_area > 0)) return facet;
  facet.normal = area * (1 / double_area);
  if (mesh.uvs.empty()) return facet;
  const auto &t0 = mesh.uvs[a], &t1 = mesh.uvs[b], &t2 = mesh.uvs[c];
  const float u1 = t1[0] - t0[0], v1 = t1[1] - t0[1], u2 = t2[0] - t0[0], v2 = t2[1] - t0[1];
  facet.uv_per_metre = std::sqrt(std::abs(u1 * v2 - u2 * v1) / double_area);
  std::tie(facet.u_slope, facet.v_slope) = uv_slopes(facet, 1 / double_area, t0, t1, t2);
  return facet;
}

// Each value goes to its place once, from a register: what is read again soon after parts of it
// were written waits until they have arrived.
[[gnu::always_inline]] inline void Scene::Impl::read_hit(unsigned geom_id,
                                                         unsigned prim_id,
                                                         unsigned inst_id,
                                                         float u,
                                                         float v,
                                                         const Vec3f& incoming,
                                                         HitPoint& hit) const {
  std::uint32_t instance = 0;
  const Part& p = part(geom_id, inst_id, instance);
  const Mesh& mesh = *description.meshes[p.mesh];
  const std::uint32_t t = p.triangle_of_prim.empty() ? prim_id : p.triangle_of_prim[prim_id];
  const auto& [a, b, c] = mesh.triangles[t];
  const float w = 1 - u - v;
  const bool placed = p.instance != Part::none;
  const auto& matrix = description.instances[instance].set_from_object;
  const std::vector<Facet>& known = facets[instance];
  Facet found;
  if (known.empty()) found = facet_of(mesh, p.positions, t, placed ? nullptr : &matrix);
  const Facet& facet = known.empty() ? found : known[t];
  const auto& [p0, p1, p2] = facet.corners;
  hit.instance = instance;
  hit.material = material_of(mesh, t);
  hit.position = p0 * w + p1 * u + p2 * v;
  hit.largest_coordinate = facet.largest_coordinate;
  Vec3f side = facet.normal != Vec3f{} ? facet.normal : -incoming;
  const bool back = dot(side, incoming) > 0;
  if (back) side = -side;
  hit.back = back != (mirrored[instance] != 0);
  bool turned_over = hit.back;  // the normal is seen from behind
  hit.geometric_normal = side;
  Vec3f normal = side;
  hit.edge = {};
  hit.turn_along = hit.turn_across = hit.turn_both = 0;
  if (!mesh.normals.empty()) {
    const auto& normals = placed ? p.normals : mesh.normals;
    Vec3f n = normals[a] * w + normals[b] * u + normals[c] * v;
    n = placed ? normalize(n) : transform_normal(normal_matrices[instance], n);
    if (dot(n, n) > 0.5F) {
      const bool away = dot(n, side) < 0;
      turned_over = away != (mirrored[instance] != 0);  // which turns normals over, too
      const auto turned = [&](std::uint32_t corner) {
        const Vec3f turned_n =
            placed ? normals[corner] : transform_normal(normal_matrices[instance], normals[corner]);
        return away ? -turned_n : turned_n;
      };
      find_turn(p1 - p0, p2 - p0, turned(b) - turned(a), turned(c) - turned(a), side, hit);
      normal = away ? -n : n;
      // An interpolated normal may lean away from the viewer near silhouettes: bend it back.
      const float lean = dot(normal, incoming);
      if (lean > -1e-3F) normal = normalize(normal - incoming * (lean + 1e-3F));
    }
  }
  hit.normal = normal;
  hit.u = hit.v = hit.uv_per_metre = 0;
  hit.u_slope = hit.v_slope = {};
  if (!mesh.uvs.empty()) {
    const auto &t0 = mesh.uvs[a], &t1 = mesh.uvs[b], &t2 = mesh.uvs[c];
    hit.u = t0[0] * w + t1[0] * u + t2[0] * v;
    hit.v = t0[1] * w + t1[1] * u + t2[1] * v;
    hit.uv_per_metre = facet.uv_per_metre;
    hit.u_slope = facet.u_slope;
    hit.v_slope = facet.v_slope;
  }
  hit.colour = {1, 1, 1};
  if (!mesh.colours.empty()) {
    hit.colour = light_of_codes(mesh.colours[a]) * w + light_of_codes(mesh.colours[b]) * u +
                 light_of_codes(mesh.colours[c]) * v;
  }
  hit.has_second_uvs = !mesh.second_uvs.empty();
  if (hit.has_second_uvs) {
    const auto &t0 = mesh.second_uvs[a], &t1 = mesh.second_uvs[b], &t2 = mesh.second_uvs[c];
    hit.second_uv = {t0[0] * w + t1[0] * u + t2[0] * v, t0[1] * w + t1[1] * u + t2[1] * v};
    const float double_area = length(cross(p1 - p0, p2 - p0));
    std::tie(hit.second_u_slope, hit.second_v_slope) =
        uv_slopes(facet, double_area > 0 ? 1 / double_area : 0, t0, t1, t2);
  }
  hit.tangent = {};
  hit.handedness = 1;
  if (!mesh.tangents.empty()) {
    const auto &t0 = mesh.tangents[a], &t1 = mesh.tangents[b], &t2 = mesh.tangents[c];
    const Vec3f tangent{t0[0] * w + t1[0] * u + t2[0] * v, t0[1] * w + t1[1] * u + t2[1] * v,
                        t0[2] * w + t1[2] * u + t2[2] * v};
    hit.tangent = normalize(transform_vector(matrix, tangent));
    // A mirrored bitangent is on the other side; seen from behind, so are tangent and bitangent.
    hit.handedness = mirrored[instance] != 0 ? -t0[3] : t0[3];
    if (turned_over) {
      hit.tangent = -hit.tangent;
      hit.handedness = -hit.handedness;
    }
  }
}

// A ray that is filtered, in the set: Embree gives it in the object's frame inside an instance.
[[gnu::always_inline]] inline Scene::Impl::FilteredRay Scene::Impl::ray_of(
    const RTCFilterFunctionNArguments* args, unsigned lane) const {
  const unsigned n = args->N;
  FilteredRay ray{{RTCRayN_org_x(args->ray, n, lane), RTCRayN_org_y(args->ray, n, lane),
                   RTCRayN_org_z(args->ray, n, lane)},
                  {RTCRayN_dir_x(args->ray, n, lane), RTCRayN_dir_y(args->ray, n, lane),
                   RTCRayN_dir_z(args->ray, n, lane)}};
  const unsigned inst_id = RTCHitN_instID(args->hit, n, lane, 0);
  if (inst_id != RTC_INVALID_GEOMETRY_ID && instance_of_geometry[inst_id] != Part::none) {
    const auto& placed = description.instances[instance_of_geometry[inst_id]].set_from_object;
    ray.origin = transform_point(placed, ray.origin);
    ray.direction = transform_vector(placed, ray.direction);
  }
  return ray;
}

[[gnu::always_inline]] inline Vec3f Scene::Impl::passes(const RTCFilterFunctionNArguments* args,
                                                        unsigned lane,
                                                        RayKind kind,
                                                        float cone_rad) const {
  const unsigned n = args->N;
  const Vec3f incoming = ray_of(args, lane).direction;
  HitPoint hit;
  read_hit(RTCHitN_geomID(args->hit, n, lane), RTCHitN_primID(args->hit, n, lane),
           RTCHitN_instID(args->hit, n, lane, 0), RTCHitN_u(args->hit, n, lane),
           RTCHitN_v(args->hit, n, lane), incoming, hit);
  const ShadeContext context{&description, nullptr, pictures, prepared};
  const float slant = std::max(std::abs(dot(incoming, hit.geometric_normal)), 1e-6F);
  const float footprint_m = cone_rad * RTCRayN_tfar(args->ray, n, lane) / slant;
  return compiled->shaders[hit.material]->transmittance(
      context, description.materials[hit.material], hit, incoming, kind, footprint_m);
}

// Whether a ray that sees the real world passes a real surface that hides nothing: it does where it
// meets something virtual, on either side, before anything real that hides.
bool Scene::Impl::stands_back(const RTCFilterFunctionNArguments* args, unsigned lane) const {
  const unsigned n = args->N;
  if ((RTCRayN_mask(args->ray, n, lane) & (mask_stand_in | mask_mirrored)) == 0) return false;
  std::uint32_t met = 0;
  part(RTCHitN_geomID(args->hit, n, lane), RTCHitN_instID(args->hit, n, lane, 0), met);
  const Instance& real = description.instances[met];
  if (real.kind != ObjectKind::stand_in || real.occludes) return false;
  const auto [origin, direction] = ray_of(args, lane);
  const auto& traced = *reinterpret_cast<const TraceContext*>(args->context);
  TraceContext context(*traced.scene, RayKind::camera, false);
  context.cone_rad = traced.cone_rad;  // what it passed on its way here it passes again
  context.pictures = traced.pictures;
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

// Whether the ray is one for which the live picture that it meets is not there.
bool Scene::Impl::is_past_picture(const RTCFilterFunctionNArguments* args) const {
  const auto& context = *reinterpret_cast<const TraceContext*>(args->context);
  const auto& met = *static_cast<const Part*>(args->geometryUserPtr);
  switch (context.pictures) {
    case LivePictures::met:
      return false;
    case LivePictures::passed:
      return !compiled->pictures_of_mesh[met.mesh].empty();
    case LivePictures::passed_apart:
      return compiled->shows_apart[met.mesh] != 0;
  }
  return false;
}

void Scene::Impl::filter_closest(const RTCFilterFunctionNArguments* args) {
  const Impl& impl = of(args);
  const auto& context = *reinterpret_cast<const TraceContext*>(args->context);
  const bool past_picture = impl.is_past_picture(args);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    if (past_picture || impl.passes(args, i, context.kind, context.cone_rad) == Vec3f{1, 1, 1} ||
        impl.stands_back(args, i)) {
      args->valid[i] = 0;
    }
  }
}

void Scene::Impl::filter_any(const RTCFilterFunctionNArguments* args) {
  const Impl& impl = of(args);
  const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
  const auto& context = *reinterpret_cast<const TraceContext*>(args->context);
  const Mesh& mesh = *impl.description.meshes[part.mesh];
  const bool past_picture = impl.is_past_picture(args);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    if (past_picture) {
      args->valid[i] = 0;
      continue;
    }
    const std::uint32_t prim = RTCHitN_primID(args->hit, args->N, i);
    const std::uint32_t t = part.triangle_of_prim.empty() ? prim : part.triangle_of_prim[prim];
    const std::uint32_t material = material_of(mesh, t);
    if ((RTCRayN_mask(args->ray, args->N, i) & ray_glass_blocks) != 0 &&
        impl.compiled->glass[material]) {
      continue;
    }
    const auto& anywhere = impl.compiled->shadow[material];
    const unsigned id = RTCRayN_id(args->ray, args->N, i);
    const Vec3f share = anywhere ? *anywhere : impl.passes(args, i, RayKind::shadow, 0);
    if (share == Vec3f{}) continue;
    if (context.transmittance_r) {
      context.transmittance_r[id] *= share.x;
      context.transmittance_g[id] *= share.y;
      context.transmittance_b[id] *= share.z;
    }
    args->valid[i] = 0;
  }
}

namespace {

// Whether two scenes differ in nothing but where moving instances stand, and in shapes of meshes
// that deform.
bool differ_in_moves_only(const SceneDescription& a, const SceneDescription& b) {
  if (a.textures != b.textures || a.materials != b.materials || a.background != b.background ||
      a.videos != b.videos || a.instances.size() != b.instances.size()) {
    return false;
  }
  if (!std::ranges::equal(a.meshes, b.meshes, [](const auto& x, const auto& y) {
        return x == y || (x->rest && y->rest && x->materials == y->materials);
      })) {
    return false;
  }
  return std::ranges::equal(a.instances, b.instances, [](Instance x, const Instance& y) {
    if (x.moves) x.set_from_object = y.set_from_object;
    return x == y;
  });
}

std::uint64_t next_id() {
  static std::atomic<std::uint64_t> scenes{0};
  return ++scenes;
}

}  // namespace

Scene::Scene(SceneDescription description, Pictures pictures) : impl_(std::make_unique<Impl>()) {
  check(description);
  impl_->pictures = std::move(pictures);
  auto compiled = std::make_shared<Compiled>();
  compiled->build(description);
  compiled->id = impl_->id = next_id();
  impl_->description = std::move(description);
  impl_->compiled = std::move(compiled);
  impl_->assemble(nullptr);
  impl_->prepare(nullptr);
}

Scene::Scene(SceneDescription description, const Scene& before, Pictures pictures)
    : impl_(std::make_unique<Impl>()) {
  check(description);
  impl_->pictures = std::move(pictures);
  impl_->id = next_id();
  if (before.impl_->compiled->two_level &&
      differ_in_moves_only(description, before.description())) {
    impl_->compiled = before.impl_->compiled;
  } else {
    auto compiled = std::make_shared<Compiled>();
    compiled->build(description);
    compiled->id = impl_->id;
    impl_->compiled = std::move(compiled);
  }
  impl_->description = std::move(description);
  impl_->assemble(before.impl_.get());
  impl_->prepare(before.impl_.get());
}

Scene::~Scene() = default;

const SceneDescription& Scene::description() const { return impl_->description; }
std::uint64_t Scene::id() const { return impl_->id; }
RTCSceneTy* Scene::embree() const { return impl_->scene; }
void Scene::read_hit(unsigned geom_id,
                     unsigned prim_id,
                     unsigned inst_id,
                     float u,
                     float v,
                     const Vec3f& incoming,
                     HitPoint& hit) const {
  impl_->read_hit(geom_id, prim_id, inst_id, u, v, incoming, hit);
}
void Scene::fetch_hits(const unsigned* geom_ids,
                       const unsigned* prim_ids,
                       const unsigned* inst_ids,
                       std::size_t count) const {
  const auto fetch = [](const void* place) { __builtin_prefetch(place); };
  // First the triangles, then what they point to.
  for (const bool corners : {false, true}) {
    for (std::size_t i = 0; i < count; ++i) {
      if (geom_ids[i] == RTC_INVALID_GEOMETRY_ID) continue;
      std::uint32_t instance = 0;
      const Part& part = impl_->part(geom_ids[i], inst_ids[i], instance);
      const Mesh& mesh = *impl_->description.meshes[part.mesh];
      const std::uint32_t t =
          part.triangle_of_prim.empty() ? prim_ids[i] : part.triangle_of_prim[prim_ids[i]];
      if (!corners) {
        fetch(&mesh.triangles[t]);
        continue;
      }
      const auto& normals = part.instance != Part::none ? part.normals : mesh.normals;
      for (const std::uint32_t corner : mesh.triangles[t]) {
        fetch(&part.positions[corner]);
        if (!normals.empty()) fetch(&normals[corner]);
      }
    }
  }
}

Scene::Surface Scene::surface_of(unsigned geom_id, unsigned prim_id, unsigned inst_id) const {
  Surface surface;
  const Part& part = impl_->part(geom_id, inst_id, surface.instance);
  const std::uint32_t triangle =
      part.triangle_of_prim.empty() ? prim_id : part.triangle_of_prim[prim_id];
  surface.material = material_of(*impl_->description.meshes[part.mesh], triangle);
  return surface;
}
Vec3f Scene::normal_in_set(unsigned inst_id, Vec3f normal) const {
  if (inst_id == RTC_INVALID_GEOMETRY_ID) return normal;
  const std::uint32_t instance = impl_->instance_of_geometry[inst_id];
  return instance == Part::none ? normal
                                : transform_normal(impl_->normal_matrices[instance], normal);
}
const Shader& Scene::shader_of(std::uint32_t material) const {
  return *impl_->compiled->shaders[material];
}
const Glass* Scene::glass_of(std::uint32_t material) const {
  const std::optional<Glass>& glass = impl_->compiled->glass[material];
  return glass ? &*glass : nullptr;
}
bool Scene::has_glass() const { return impl_->compiled->has_glass; }
bool Scene::has_standing_back() const { return impl_->compiled->stands_back; }
bool Scene::has_mirrored() const { return impl_->compiled->has_mirrored; }
bool Scene::has_moving() const { return impl_->compiled->two_level; }
const BackgroundShader& Scene::background() const { return *impl_->compiled->background; }
bool Scene::has_real_blockers() const { return impl_->compiled->real_blockers; }
bool Scene::has_filters() const { return impl_->compiled->filters; }
Scene::Bounds Scene::virtual_bounds() const { return impl_->virtual_bounds; }
Scene::Bounds Scene::bounds() const { return impl_->all_bounds; }
Scene::Bounds Scene::blocker_bounds() const { return impl_->blocker_bounds; }
const std::vector<Scene::Bounds>& Scene::blocker_boxes() const { return impl_->blocker_boxes; }
const std::vector<Scene::GlowingPart>& Scene::glowing_parts() const { return impl_->glowing_parts; }
std::size_t Scene::skipped_triangles() const { return impl_->skipped; }
const Scene::Pictures& Scene::pictures() const { return impl_->pictures; }
const std::vector<PreparedSurface>& Scene::prepared() const { return impl_->prepared; }
bool Scene::shows_pictures(std::uint32_t instance) const {
  return !impl_->compiled->pictures_of_mesh[impl_->description.instances[instance].mesh].empty();
}
const Scene::Places& Scene::places() const { return impl_->places; }

bool Scene::shows_apart(std::uint32_t instance) const {
  return impl_->compiled->shows_apart[impl_->description.instances[instance].mesh] != 0;
}

namespace {

template <class Counts>
std::optional<std::vector<Scene::Bounds>> moved_of(const Scene::Places& before,
                                                   const Scene::Places& now,
                                                   Counts&& counts) {
  if (before.parts != now.parts) return std::nullopt;
  std::vector<Scene::Bounds> where;
  for (std::size_t i = 0; i < now.bounds.size(); ++i) {
    if (!counts(i)) continue;
    if (before.set_from_object[i] == now.set_from_object[i] &&
        before.pictures[i] == now.pictures[i] && before.shapes[i] == now.shapes[i]) {
      continue;
    }
    for (const Scene::Bounds& bounds : {before.bounds[i], now.bounds[i]}) {
      if (bounds.lower.x <= bounds.upper.x) where.push_back(bounds);
    }
  }
  return where;
}

}  // namespace

std::optional<std::vector<Scene::Bounds>> Scene::moved(const Places& before, const Places& now) {
  return moved_of(before, now, [](std::size_t) { return true; });
}

std::optional<std::vector<Scene::Bounds>> Scene::moved_but_apart(const Places& before,
                                                                 const Places& now) {
  return moved_of(before, now, [&](std::size_t i) { return now.apart[i] == 0; });
}

}  // namespace render
