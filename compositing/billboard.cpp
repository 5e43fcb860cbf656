// The shader "billboard".
#include "compositing/billboard.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <stdexcept>

#include "render/lanes.h"
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

// The parameter block begins with this. Then come the camera's places, if it has one.
struct Block {
  std::uint32_t picture;
  std::uint32_t lit;
  std::array<float, 3> gain;
  float translucency;
  CameraGrid camera;
};

Block block_of(const Material& material) {
  Block block;
  std::memcpy(&block, material.parameters.data(), sizeof block);
  return block;
}

// Where its video shows a point; false = nowhere. `own` is where the billboard's mesh has it.
bool find(const Material& material,
          const Block& block,
          Vec3f position,
          GridPlace own,
          float uv_per_metre,
          LookUp& at) {
  if (block.camera.columns == 0) {
    at = {own, uv_per_metre};
    return true;
  }
  const auto found =
      seen_by_camera(block.camera, std::span(material.parameters).subspan(sizeof block),
                     in_camera(block.camera, position));
  if (found) at = *found;
  return found.has_value();
}
bool find(const Material& material, const Block& block, const HitPoint& hit, LookUp& at) {
  return find(material, block, hit.position, {hit.u, hit.v}, hit.uv_per_metre, at);
}

// Points that are looked up together.
constexpr std::size_t together = 32;

// Of as many points at most, on one billboard. A rough lobe sees it as wide as the lobe is there.
void see(const ShadeContext& context,
         const Material& material,
         const Block& block,
         std::span<ShadePoint* const> points,
         std::span<std::array<float, 4>> rgba) {
  std::array<render::PicturePlace, together> places;
  std::array<std::array<float, 4>, together> found;
  std::array<std::size_t, together> point;
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ShadePoint& p = *points[i];
    rgba[i] = {};
    LookUp at{};
    if (!find(material, block, p.hit, at)) continue;
    point[count] = i;
    places[count++] = {at.place.u, at.place.v, std::max(p.footprint_m, p.blur_m) * at.uv_per_metre};
  }
  context.pictures[block.picture]->look_up_all(std::span(places).first(count),
                                               std::span(found).first(count));
  for (std::size_t k = 0; k < count; ++k) rgba[point[k]] = found[k];
}

std::array<float, 4> seen(const ShadeContext& context,
                          const Material& material,
                          const Block& block,
                          const HitPoint& hit,
                          float footprint_m) {
  LookUp at{};
  if (!find(material, block, hit, at)) return {};
  return context.pictures[block.picture]->look_up(at.place.u, at.place.v,
                                                  footprint_m * at.uv_per_metre);
}

Vec3f foreground(const Block& block, const std::array<float, 4>& rgba) {
  return {rgba[0] * block.gain[0], rgba[1] * block.gain[1], rgba[2] * block.gain[2]};
}

// What shadow rays keep. The picture's light is taken for the colour of cloth.
Vec3f passed(const Block& block, const std::array<float, 4>& rgba) {
  const float open = 1 - rgba[3];
  const auto of = [&](float caught) {
    return open * (1 + block.translucency * std::min(caught, rgba[3]));
  };
  return {of(rgba[0]), of(rgba[1]), of(rgba[2])};
}

// What is wrong with it but for the camera; null = nothing.
const char* fault_of(const Block& block) {
  for (const float gain : block.gain) {
    if (!(gain >= 0 && std::isfinite(gain))) return "gain must be finite, and 0 or more";
  }
  if (!(block.translucency >= 0 && block.translucency <= 1)) return "translucency must be 0 to 1";
  if (block.lit != 0 && block.translucency > 0) return "translucency is not for what is lit";
  return nullptr;
}

Vec3f grey(float value) { return {value, value, value}; }

// The same of a place of the picture.
Vec3f dimmed(
    const Block& block, const render::LivePicture& picture, float u, float v, float footprint_uv) {
  if (picture.is_clear(u, v, footprint_uv)) return grey(1);
  if (block.translucency == 0) return grey(1 - picture.quick_alpha(u, v, footprint_uv));
  return passed(block, picture.look_up(u, v, footprint_uv));
}

void show(const Block& block,
          const std::array<float, 4>& rgba,
          ShadePoint& p,
          render::RaySink& rays) {
  constexpr float per_pi = 0.318309886F;
  if (block.lit != 0) {
    p.diffuse = foreground(block, rgba) * per_pi;
    p.light_normal = p.hit.normal;
  } else {
    p.radiance = foreground(block, rgba);
  }
  if (!(rgba[3] < 1)) return;
  rays.push(p, {render::offset_origin(p.hit, p.incoming),
                p.incoming,
                p.throughput * (1 - rgba[3]),
                {},
                0,
                {},
                p.kind});
}

// A billboard where it stands in a frame: a parallelogram.
class StandingBillboard final : public render::StandingPicture {
 public:
  StandingBillboard(const Material& material,
                    const std::array<float, 12>& set_from_object,
                    std::shared_ptr<const render::LivePicture> picture)
      : block_(block_of(material)), material_(material), picture_(std::move(picture)) {
    const Vec3f right = render::transform_vector(set_from_object, {1, 0, 0});
    const Vec3f up = render::transform_vector(set_from_object, {0, 0, 1});
    corner_ = render::transform_point(set_from_object, {-0.5F, 0, 0});
    const Vec3f across = cross(right, up);
    const float area = length(across);
    if (!(area > 0)) return;
    normal_ = across * (1 / area);
    along_right_ = cross(up, normal_) * (1 / area);
    along_up_ = cross(normal_, right) * (1 / area);
    uv_per_metre_ = 1 / std::sqrt(area);
  }

  bool shows_nothing() const override { return picture_->shows_nothing(); }

  void dim(const render::LightRays& light) const override {
    for_each_met(light.rays, [&](std::size_t ray, const Met& met) {
      const float slant = std::max(std::abs(met.facing), 1e-6F);
      const float width_m = light.width_m[ray] + light.cone_rad[ray] * met.distance_m;
      LookUp at{};
      if (!find(material_, block_, met.position, {met.u, met.v}, uv_per_metre_, at)) return;
      const Vec3f share = dimmed(block_, *picture_, at.place.u, at.place.v,
                                 width_m / std::sqrt(slant) * at.uv_per_metre);
      light.red[ray] *= share.x, light.green[ray] *= share.y, light.blue[ray] *= share.z;
    });
  }

  void meet(const render::SightRays& rays, std::vector<render::Sight>& sights) const override {
    for_each_met(rays, [&](std::size_t ray, const Met& met) {
      LookUp at{};
      if (!find(material_, block_, met.position, {met.u, met.v}, uv_per_metre_, at)) return;
      sights.push_back({static_cast<std::uint32_t>(ray), met.distance_m, met.position,
                        met.facing > 0 ? -normal_ : normal_, at.place.u, at.place.v,
                        at.uv_per_metre});
    });
  }

  void see(std::span<render::Sight> sights) const override {
    std::array<render::PicturePlace, together> places;
    std::array<std::array<float, 4>, together> found;
    for (; !sights.empty(); sights = sights.subspan(std::min(sights.size(), together))) {
      const auto some = sights.first(std::min(sights.size(), together));
      std::ranges::transform(some, places.begin(), [](const render::Sight& s) {
        return render::PicturePlace{s.u, s.v, s.footprint_m * s.uv_per_metre};
      });
      picture_->look_up_all(std::span(places).first(some.size()),
                            std::span(found).first(some.size()));
      for (std::size_t i = 0; i < some.size(); ++i) {
        some[i].radiance = foreground(block_, found[i]);
        some[i].passed = grey(1 - found[i][3]);
      }
    }
  }

 private:
  using Eight = render::Eight;
  using Eights = calibrate::Vec3T<Eight>;

  // Where a ray meets it: (u, v) as its mesh has them, and the cosine between ray and normal.
  struct Met {
    float distance_m, facing, u, v;
    Vec3f position;
  };
  template <class Visit>
  void for_each_met(const render::SightRays& rays, Visit&& visit) const {
    for (std::size_t first = 0; first < rays.count; first += 8) {
      const std::size_t n = std::min<std::size_t>(rays.count - first, 8);
      const auto eight = [&](const float* from) {
        if (n == 8) return render::load_eight(from + first);
        std::array<float, 8> some{};
        std::copy_n(from + first, n, some.begin());
        return render::load_eight(some.data());
      };
      const auto along = [](const Eights& a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
      const Eights d{eight(rays.dx), eight(rays.dy), eight(rays.dz)};
      const Eights from_corner{eight(rays.ox) - corner_.x, eight(rays.oy) - corner_.y,
                               eight(rays.oz) - corner_.z};
      const Eight facing = along(d, normal_), t = -along(from_corner, normal_) / facing;
      const Eights at{from_corner.x + d.x * t, from_corner.y + d.y * t, from_corner.z + d.z * t};
      const Eight u = along(at, along_right_), v = along(at, along_up_);
      unsigned met = render::bits_of((t > 0) & (t < eight(rays.far_m)) & (u >= 0) & (u <= 1) &
                                     (v >= 0) & (v <= 1));
      for (met &= (1U << n) - 1; met != 0; met &= met - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(met));
        visit(first + i,
              Met{t[i], facing[i], u[i], 1 - v[i], corner_ + Vec3f{at.x[i], at.y[i], at.z[i]}});
      }
    }
  }

  Block block_;
  Material material_;
  std::shared_ptr<const render::LivePicture> picture_;
  Vec3f corner_{}, normal_{}, along_right_{}, along_up_{};
  float uv_per_metre_ = 0;
};

bool is_billboard_mesh(const render::Mesh& mesh) {
  const render::Mesh own = make_billboard_mesh(0);
  return mesh.positions == own.positions && mesh.uvs == own.uvs && mesh.triangles == own.triangles;
}

class BillboardShader final : public render::Shader {
 public:
  void check(const render::SceneDescription&, const Material& material) const override {
    const auto refuse = [&](const char* reason) {
      throw std::invalid_argument("billboard \"" + material.name + "\": " + reason);
    };
    if (material.parameters.size() < sizeof(Block)) refuse("wrong parameter block");
    const Block b = block_of(material);
    if (const char* fault = fault_of(b.camera)) refuse(fault);
    if (material.parameters.size() != sizeof(Block) + bytes_of_places(b.camera)) {
      refuse("wrong parameter block");
    }
    if (const char* fault = fault_of(b)) refuse(fault);
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             render::RaySink& rays) const override {
    std::array<std::array<float, 4>, together> rgba;
    while (!points.empty()) {
      const std::uint32_t number = points.front()->hit.material;
      const auto most = points.first(std::min(points.size(), together));
      const auto end = std::ranges::find_if(
          most, [&](const ShadePoint* p) { return p->hit.material != number; });
      const auto some = points.first(static_cast<std::size_t>(end - most.begin()));
      const Material& material = context.scene->materials[number];
      const Block block = block_of(material);
      see(context, material, block, some, rgba);
      for (std::size_t i = 0; i < some.size(); ++i) show(block, rgba[i], *some[i], rays);
      points = points.subspan(some.size());
    }
  }

  bool lets_light_through(const Material&) const override { return true; }
  bool glows_by_means() const override { return true; }
  bool only_shows(const Material& material, const render::Mesh& mesh) const override {
    return block_of(material).lit == 0 && is_billboard_mesh(mesh);
  }

  std::vector<std::size_t> pictures_of(const Material& material) const override {
    return {block_of(material).picture};
  }

  std::shared_ptr<const render::Prepared> prepare(
      const Material& material,
      const render::Mesh& mesh,
      const std::array<float, 12>& set_from_object,
      std::span<const std::shared_ptr<const render::LivePicture>> pictures) const override {
    if (!is_billboard_mesh(mesh)) return nullptr;
    return std::make_shared<StandingBillboard>(material, set_from_object,
                                               pictures[block_of(material).picture]);
  }

  std::optional<Layer> layer(const ShadeContext& context,
                             const Material& material,
                             const HitPoint& hit,
                             Vec3f,
                             RayKind,
                             float footprint_m) const override {
    const Block block = block_of(material);
    const std::array<float, 4> rgba = seen(context, material, block, hit, footprint_m);
    const Vec3f shown = foreground(block, rgba), open = grey(1 - rgba[3]);
    Layer layer = block.lit != 0 ? Layer{{}, open, shown} : Layer{shown, open};
    if (block.translucency > 0) layer.lit_through = passed(block, rgba);
    return layer;
  }

  // A hole is where the camera does not see, and where its picture is clear as far as the ray is
  // wide, which is mostly told for many texels at once. The rest is left to shade().
  Vec3f transmittance(const ShadeContext& context,
                      const Material& material,
                      const HitPoint& hit,
                      Vec3f,
                      RayKind kind,
                      float footprint_m) const override {
    const Block block = block_of(material);
    LookUp at{};
    if (!find(material, block, hit, at)) return grey(1);
    const render::LivePicture& picture = *context.pictures[block.picture];
    const auto [u, v] = at.place;
    const float footprint_uv = footprint_m * at.uv_per_metre;
    if (kind == RayKind::shadow) return dimmed(block, picture, u, v, footprint_uv);
    if (picture.is_clear(u, v, footprint_uv)) return grey(1);
    const bool clear = std::isfinite(footprint_uv) &&
                       picture.look_up(u, v, footprint_uv) == std::array<float, 4>{};
    return clear ? grey(1) : Vec3f{};
  }
};

Material material_of(std::string name, const Block& block, const std::vector<GridPlace>& grid) {
  Material material{std::move(name), "billboard", {}};
  material.parameters.resize(sizeof block + grid.size() * sizeof(GridPlace));
  std::memcpy(material.parameters.data(), &block, sizeof block);
  if (!grid.empty()) {
    std::memcpy(material.parameters.data() + sizeof block, grid.data(),
                grid.size() * sizeof(GridPlace));
  }
  return material;
}

Block block_from(const BillboardSettings& settings) {
  Block block{};
  block.translucency = settings.translucency;
  block.picture = settings.picture;
  block.lit = settings.lit ? 1 : 0;
  block.gain = settings.gain;
  if (const char* fault = fault_of(block)) {
    throw std::invalid_argument(std::string("a billboard's ") + fault);
  }
  return block;
}

}  // namespace

void register_billboards() {
  render::register_shader("billboard", std::make_shared<BillboardShader>());
}

Material make_billboard_material(std::string name, const BillboardSettings& settings) {
  return material_of(std::move(name), block_from(settings), {});
}

Material make_billboard_material(std::string name,
                                 const BillboardSettings& settings,
                                 const BillboardCamera& camera,
                                 int steps) {
  const LensGrid grid = make_lens_grid(camera, steps);
  Block block = block_from(settings);
  block.camera = grid.camera;
  return material_of(std::move(name), block, grid.places);
}

render::Mesh make_billboard_mesh(std::uint32_t material) {
  render::Mesh mesh;
  mesh.positions = {{-0.5F, 0, 0}, {0.5F, 0, 0}, {0.5F, 0, 1}, {-0.5F, 0, 1}};
  mesh.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.materials = {material};
  return mesh;
}

}  // namespace compositing
