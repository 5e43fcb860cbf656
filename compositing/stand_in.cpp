// Stand-ins and the plate.
#include "compositing/stand_in.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "compositing/billboard.h"
#include "compositing/visual_hull.h"
#include "render/shader.h"
#include "render/standard.h"
#include "render/trace.h"

namespace compositing {
namespace {

using render::Material;
using render::RayKind;
using render::SceneDescription;
using render::ShadeContext;
using render::ShadePoint;
using render::StandInParameters;
using render::Vec3f;

StandInParameters block_of(const Material& material) {
  StandInParameters parameters;
  std::memcpy(&parameters, material.parameters.data(), sizeof parameters);
  return parameters;
}

class StandInShader final : public render::Shader {
 public:
  void check(const SceneDescription&, const Material& material) const override {
    const auto refuse = [&](const char* reason) {
      throw std::invalid_argument("stand-in \"" + material.name + "\": " + reason);
    };
    if (material.parameters.size() != sizeof(StandInParameters)) refuse("wrong parameter block");
    const StandInParameters p = block_of(material);
    for (const float albedo : p.albedo) {
      if (!(albedo >= 0 && albedo <= 1)) refuse("albedo must be 0 to 1");
    }
    if (!(p.reflectance >= 0 && p.reflectance <= 1)) refuse("reflectance must be 0 to 1");
    if (!(p.roughness >= 0 && p.roughness <= 1)) refuse("roughness must be 0 to 1");
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             render::RaySink& rays) const override {
    for (ShadePoint* p : points) {
      if (p->kind != RayKind::camera && p->kind != RayKind::bent) continue;
      const StandInParameters block = block_of(context.scene->materials[p->hit.material]);
      p->light_normal = p->hit.normal;
      p->plate_share = {1, 1, 1};
      p->catches_shadow = block.catches_shadow != 0;
      p->catches_lamps = block.catches_light != 0 && p->kind == RayKind::camera;
      p->albedo = {block.albedo[0], block.albedo[1], block.albedo[2]};
      if (block.catches_reflection && block.reflectance > 0) push_reflection(*p, block, rays);
    }
  }

 private:
  static void push_reflection(const ShadePoint& p,
                              const StandInParameters& block,
                              render::RaySink& rays) {
    const Vec3f view = -p.incoming;
    const float f = render::schlick(block.reflectance, std::abs(dot(p.hit.normal, view)));
    const Vec3f direction = normalize(render::mirrored(view, p.hit.normal));
    rays.push(p, {render::offset_origin(p.hit, direction),
                  direction,
                  p.throughput * f,
                  p.hit.normal,
                  block.roughness,
                  {},
                  RayKind::difference});
  }
};

class PlateBackground final : public render::BackgroundShader {
 public:
  void shade(const ShadeContext&, std::span<ShadePoint* const> points) const override {
    for (ShadePoint* p : points) p->plate_share = {1, 1, 1};
  }
};

}  // namespace

void register_shaders() {
  render::register_shader("stand_in", std::make_shared<StandInShader>());
  register_billboards();
  register_hulls();
  render::register_background("plate", std::make_shared<PlateBackground>());
}

Material make_stand_in_material(std::string name, const StandInParameters& parameters) {
  Material material{std::move(name), "stand_in", {}};
  material.parameters.resize(sizeof parameters);
  std::memcpy(material.parameters.data(), &parameters, sizeof parameters);
  return material;
}

}  // namespace compositing
