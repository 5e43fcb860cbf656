// The shader "billboard".
#include "compositing/billboard.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <stdexcept>

#include "render/shader.h"
#include "render/trace.h"

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

// Where its video shows the hit; false = nowhere.
bool find(const Material& material, const Block& block, const HitPoint& hit, LookUp& at) {
  if (block.camera.columns == 0) {
    at = {{hit.u, hit.v}, hit.uv_per_metre};
    return true;
  }
  const auto found =
      seen_by_camera(block.camera, std::span(material.parameters).subspan(sizeof block),
                     in_camera(block.camera, hit.position));
  if (found) at = *found;
  return found.has_value();
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

  std::vector<std::size_t> pictures_of(const Material& material) const override {
    return {block_of(material).picture};
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
    if (picture.is_clear(u, v, footprint_uv)) return grey(1);
    if (kind != RayKind::shadow) {
      const bool clear = std::isfinite(footprint_uv) &&
                         picture.look_up(u, v, footprint_uv) == std::array<float, 4>{};
      return clear ? grey(1) : Vec3f{};
    }
    if (block.translucency == 0) return grey(1 - picture.quick_alpha(u, v, 0));
    return passed(block, picture.look_up(u, v, 0));
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
