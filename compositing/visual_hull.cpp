// The shader "hull".
#include "compositing/visual_hull.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "compositing/hull_march.h"
#include "render/shader.h"
#include "render/trace.h"
#include "render/transform.h"

namespace compositing {
namespace {

using render::HitPoint;
using render::Layer;
using render::Material;
using render::RayKind;
using render::ShadeContext;
using render::ShadePoint;
using render::Vec3f;

constexpr float finest_step_px = 0.25F, coarsest_step_px = 64;
constexpr float clear_m = 0.02F;        // of the hull about a place that hides nothing from it
constexpr float least_penalty = 1e-4F;  // of 1 - cos: less than half a degree counts as none
constexpr float far_view = 1e-3F;       // weight of cameras that look the other way
constexpr float small_share = 0.01F;    // of the colour, that is not looked for

// The parameter block begins with this. Then come the cameras' places.
HullBlock hull_block_of(const Material& material) {
  HullBlock block;
  std::memcpy(&block, material.parameters.data(), sizeof block);
  return block;
}

// What is out of range in it, or null.
const char* fault_of(const HullBlock& block) {
  if (block.views < 2 || block.views > most_hull_views) return "must have 2 to 8 views";
  if (!(block.step_px >= finest_step_px && block.step_px <= coarsest_step_px)) {
    return "step_px must be 0.25 to 64";
  }
  for (const float gain : block.gain) {
    if (!(gain >= 0 && std::isfinite(gain))) return "gain must be finite, and 0 or more";
  }
  return nullptr;
}

[[noreturn]] void refuse(const std::string& name, const char* reason) {
  throw std::invalid_argument("hull \"" + name + "\": " + reason);
}

// Cells are there of whatever shows pictures (render::Scene).
HullMarch march_of(const ShadeContext& context, const HitPoint& hit) {
  const Material& material = context.scene->materials[hit.material];
  return {*static_cast<const HullCells*>(context.prepared_for(hit)),
          std::span(material.parameters).subspan(sizeof(HullBlock)), context.pictures};
}

// How far it is from a place in the box or on its rim, along a unit direction, to where it ends.
float way_in_box(const std::array<float, 12>& set_from_object, Vec3f from, Vec3f direction) {
  const auto& m = set_from_object;
  const Vec3f x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
  const Vec3f p = from - Vec3f{m[3], m[7], m[11]};
  const Vec3f yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
  const float volume = dot(x, yz);
  float way = render::ray_far;
  for (const Vec3f& side : {yz, zx, xy}) {
    const float at = dot(side, p) / volume, speed = dot(side, direction) / volume;
    if (speed > 0) way = std::min(way, (1 - at) / speed);
    if (speed < 0) way = std::min(way, -at / speed);
  }
  return way > 0 && way < render::ray_far ? way : 0;  // nor where it is no number
}

// Where the ray meets what is no picture, if it does so before `far_m`.
float next_surface(
    const ShadeContext& context, const HitPoint& hit, Vec3f incoming, RayKind kind, float far_m) {
  if (!context.compiled) return far_m;
  const bool real = kind == RayKind::camera || kind == RayKind::bent;
  const unsigned mask = render::mask_virtual | (real ? render::mask_occluder : 0U);
  const Vec3f origin = render::offset_origin(hit, incoming);
  constexpr int most_pictures = 16;
  float near_m = 0;
  for (int i = 0; i < most_pictures; ++i) {
    const auto met = render::closest_hit(*context.compiled, origin, incoming, near_m, mask, kind);
    if (!met || !(met->distance < far_m)) return far_m;
    const auto surface = context.compiled->surface_of(met->geom_id, met->prim_id, met->inst_id);
    if (!context.compiled->shows_pictures(surface.instance)) return met->distance;
    near_m = met->distance * (1 + 1e-5F) + 1e-5F;
  }
  return far_m;
}

Vec3f grey(float value) { return {value, value, value}; }

// Premultiplied light of what a ray sees, and its alpha.
struct Seen {
  Vec3f light;
  float alpha = 0;
};

struct Box {
  const HullBlock& block;
  const HullMarch& march;
  const std::array<float, 12>& set_from_object;
};

// Share of the way from a place to a camera that the hull leaves clear.
float clearness(const Box& box, std::size_t view, Vec3f place, float width_m) {
  const Vec3f to_camera = box.block.view[view].position - place;
  const float distance = length(to_camera);
  if (!(distance > clear_m)) return 1;
  const Vec3f direction = to_camera * (1 / distance);
  const float far_m = std::min(way_in_box(box.set_from_object, place, direction), distance);
  return 1 - box.march.opacity({place, direction, width_m, 0}, clear_m, far_m, 2);
}

// Colour at a place, times `alpha`: the cameras' foregrounds without their own alpha.
Vec3f light_at(const Box& box, Vec3f place, Vec3f direction, float width_m, float alpha) {
  std::array<float, most_hull_views> weights{};
  float all = 0;
  for (std::size_t i = 0; i < box.block.views; ++i) {
    const Vec3f from_camera = normalize(place - box.block.view[i].position);
    const float penalty = std::max(1 - dot(from_camera, direction), 0.0F);
    const float near = std::max(1 - penalty, 0.0F);
    weights[i] = (near * near + far_view) / (penalty + least_penalty);
    all += weights[i];
  }
  // Twice at most: where the hull hides the place from all cameras, as if it hid nothing.
  for (bool hides = box.block.hides != 0;; hides = false) {
    Vec3f sum;
    float covered = 0, left = all;
    auto open = weights;
    for (std::size_t k = 0; k < box.block.views && left > small_share * covered; ++k) {
      const auto best = static_cast<std::size_t>(
          std::max_element(open.begin(), open.begin() + box.block.views) - open.begin());
      left -= open[best];
      float weight = std::exchange(open[best], -1.0F);
      const auto rgba = box.march.look(best, place, width_m);
      if (!rgba) continue;
      if (hides) weight *= clearness(box, best, place, width_m);
      sum += Vec3f{(*rgba)[0], (*rgba)[1], (*rgba)[2]} * weight;
      covered += weight * (*rgba)[3];
    }
    if (covered > 1e-6F * all) return sum * (alpha / covered);
    if (!hides) return {};
  }
}

Seen seen_by(const ShadeContext& context, const HitPoint& hit, const HullRay& ray, RayKind kind) {
  const HullMarch march = march_of(context, hit);
  const HullBlock& block = march.block();
  const auto& set_from_object = context.scene->instances[hit.instance].set_from_object;
  HullMarch::Crossing crossing =
      march.find(ray, 0, way_in_box(set_from_object, ray.origin, ray.direction));
  if (!(crossing.alpha > 0)) return {};
  const float bound = next_surface(context, hit, ray.direction, kind, crossing.far_m);
  if (bound < crossing.far_m) crossing = march.find(ray, 0, bound);
  if (!(crossing.alpha > 0)) return {};
  const float width_m = ray.width_m + ray.width_per_m * crossing.at_m;
  const Vec3f light =
      light_at({block, march, set_from_object}, ray.origin + ray.direction * crossing.at_m,
               ray.direction, width_m, crossing.alpha);
  return {{light.x * block.gain[0], light.y * block.gain[1], light.z * block.gain[2]},
          crossing.alpha};
}

class HullShader final : public render::Shader {
 public:
  void check(const render::SceneDescription&, const Material& material) const override {
    const std::string& name = material.name;
    if (material.parameters.size() < sizeof(HullBlock)) refuse(name, "wrong parameter block");
    const HullBlock b = hull_block_of(material);
    if (const char* fault = fault_of(b)) refuse(name, fault);
    std::size_t bytes = 0;
    for (const MarchView& view : std::span(b.view).first(b.views)) {
      if (const char* fault = compositing::fault_of(view.camera)) refuse(name, fault);
      if (view.camera.columns == 0 || !calibrate::is_finite(view.position) ||
          !(view.px_per_tangent > 0 && std::isfinite(view.px_per_tangent)) ||
          !(view.root_aspect > 0 && std::isfinite(1 / view.root_aspect)) ||
          !(view.camera.uv_per_tangent > 0)) {
        refuse(name, "its camera is not finite");
      }
      if (view.first_byte != bytes) refuse(name, "wrong parameter block");
      bytes += bytes_of_places(view.camera);
    }
    if (material.parameters.size() != sizeof b + bytes) refuse(name, "wrong parameter block");
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             render::RaySink& rays) const override {
    for (ShadePoint* p : points) {
      // A rough lobe sees it as wide as the lobe is there.
      const float width_m = std::max(p->footprint_m, p->blur_m);
      const float growth = std::sqrt(length(p->turns.a) * length(p->turns.b));
      const Seen seen =
          seen_by(context, p->hit, {p->hit.position, p->incoming, width_m, growth}, p->kind);
      p->radiance = seen.light;
      if (!(seen.alpha < 1)) continue;
      rays.push(*p, {render::offset_origin(p->hit, p->incoming),
                     p->incoming,
                     p->throughput * (1 - seen.alpha),
                     {},
                     0,
                     {},
                     p->kind});
    }
  }

  bool lets_light_through(const Material&) const override { return true; }

  std::vector<std::size_t> pictures_of(const Material& material) const override {
    const HullBlock block = hull_block_of(material);
    std::vector<std::size_t> pictures;
    for (const MarchView& view : std::span(block.view).first(block.views)) {
      pictures.push_back(view.picture);
    }
    return pictures;
  }

  std::shared_ptr<const render::Prepared> prepare(
      const Material& material,
      const render::Mesh&,
      const std::array<float, 12>& set_from_object,
      std::span<const std::shared_ptr<const render::LivePicture>> pictures) const override {
    return std::make_shared<HullCells>(hull_block_of(material),
                                       std::span(material.parameters).subspan(sizeof(HullBlock)),
                                       set_from_object, pictures);
  }

  std::optional<Layer> layer(const ShadeContext& context,
                             const Material&,
                             const HitPoint& hit,
                             Vec3f incoming,
                             RayKind kind,
                             float footprint_m) const override {
    const Seen seen = seen_by(context, hit, {hit.position, incoming, footprint_m, 0}, kind);
    return Layer{seen.light, grey(1 - seen.alpha)};
  }

  // The box is seen where rays enter it, and where they leave it is a hole.
  Vec3f transmittance(const ShadeContext& context,
                      const Material&,
                      const HitPoint& hit,
                      Vec3f incoming,
                      RayKind kind,
                      float) const override {
    if (hit.back) return grey(1);
    if (kind != RayKind::shadow) return {};
    const auto& set_from_object = context.scene->instances[hit.instance].set_from_object;
    const float scale = length(incoming);
    if (!(scale > 0)) return grey(1);
    const HullRay ray{hit.position, incoming * (1 / scale)};
    const float far_m = way_in_box(set_from_object, ray.origin, ray.direction);
    return grey(1 - march_of(context, hit).opacity(ray, 0, far_m));
  }
};

}  // namespace

void register_hulls() { render::register_shader("hull", std::make_shared<HullShader>()); }

Material make_hull_material(std::string name,
                            const HullSettings& settings,
                            std::span<const HullView> views,
                            int steps) {
  HullBlock block{};
  block.views = static_cast<std::uint32_t>(views.size());
  block.hides = settings.hides ? 1 : 0;
  block.step_px = settings.step_px;
  block.gain = settings.gain;
  if (const char* fault = fault_of(block)) refuse(name, fault);
  std::vector<GridPlace> places;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const LensGrid grid = make_lens_grid(views[i].camera, steps);
    const calibrate::Lens& lens = views[i].camera.lens;
    MarchView& view = block.view[i];
    view.picture = views[i].picture;
    view.first_byte = static_cast<std::uint32_t>(places.size() * sizeof(GridPlace));
    view.camera = grid.camera;
    view.px_per_tangent = grid.camera.uv_per_tangent * std::sqrt(static_cast<float>(lens.width) *
                                                                 static_cast<float>(lens.height));
    view.root_aspect = std::sqrt(static_cast<float>(lens.height) / static_cast<float>(lens.width));
    view.position = calibrate::to_float(calibrate::position_of(views[i].camera.cam_from_set));
    places.insert(places.end(), grid.places.begin(), grid.places.end());
  }
  Material material{std::move(name), "hull", {}};
  material.parameters.resize(sizeof block + places.size() * sizeof(GridPlace));
  std::memcpy(material.parameters.data(), &block, sizeof block);
  std::memcpy(material.parameters.data() + sizeof block, places.data(),
              places.size() * sizeof(GridPlace));
  return material;
}

render::Mesh make_hull_mesh(std::uint32_t material) {
  render::Mesh mesh;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto side = [&](unsigned bit) { return static_cast<float>(corner >> bit & 1U); };
    mesh.positions.push_back({side(0), side(1), side(2)});
  }
  for (const std::array<std::uint32_t, 4>& face : {std::array<std::uint32_t, 4>{0, 2, 3, 1},
                                                   {4, 5, 7, 6},
                                                   {0, 1, 5, 4},
                                                   {2, 6, 7, 3},
                                                   {0, 4, 6, 2},
                                                   {1, 3, 7, 5}}) {
    mesh.triangles.push_back({face[0], face[1], face[2]});
    mesh.triangles.push_back({face[0], face[2], face[3]});
  }
  mesh.materials = {material};
  return mesh;
}

std::array<float, 12> placed_box(Vec3f lower, Vec3f upper) {
  constexpr float least_m = 1e-4F;
  const Vec3f way = upper - lower;
  const Vec3f size{std::max(way.x, least_m), std::max(way.y, least_m), std::max(way.z, least_m)};
  return {size.x, 0, 0, lower.x, 0, size.y, 0, lower.y, 0, 0, size.z, lower.z};
}

}  // namespace compositing
