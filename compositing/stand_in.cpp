// Stand-ins and the plate.
#include "compositing/stand_in.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <stdexcept>

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

constexpr float clipped_plate = 0.98F;  // of display white: the camera saw at least this
constexpr float dark_plate = 0.002F;    // below, noise decides the albedo

StandInParameters block_of(const Material& material) {
  StandInParameters parameters;
  std::memcpy(&parameters, material.parameters.data(), sizeof parameters);
  return parameters;
}

// 1 - lost/E, exactly 1 where nothing is lost.
float passing(float open, float arriving) {
  const float lost = open - arriving;
  return lost > 0 && open > 0 ? std::max(0.0F, 1 - lost / open) : 1.0F;
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

  void surface(const ShadeContext& context, std::span<ShadePoint* const> points) const override {
    for (ShadePoint* p : points) {
      const StandInParameters block = block_of(context.scene->materials[p->hit.material]);
      p->light_normal = p->hit.normal;
      p->receives_light = p->kind == RayKind::camera &&
                          (block.catches_shadow || block.catches_light || block.catches_reflection);
    }
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             render::RaySink& rays) const override {
    for (ShadePoint* p : points) {
      if (p->kind != RayKind::camera) continue;
      const StandInParameters block = block_of(context.scene->materials[p->hit.material]);
      p->plate_share = {1, 1, 1};
      if (block.catches_shadow) {
        p->plate_share = {passing(p->irradiance_open.x, p->irradiance.x),
                          passing(p->irradiance_open.y, p->irradiance.y),
                          passing(p->irradiance_open.z, p->irradiance.z)};
      }
      p->plate_passed = p->plate_share;
      if (block.catches_light && p->irradiance_lamps != Vec3f{}) {
        p->clipped_plate = add_lamps(*p, block);
      }
      if (block.catches_reflection && block.reflectance > 0)
        push_reflection(context, *p, block, rays);
    }
  }

 private:
  // Virtual lamps on the real surface. Returns whether the plate was too bright to tell its albedo.
  static bool add_lamps(ShadePoint& p, const StandInParameters& block) {
    constexpr float pi = std::numbers::pi_v<float>;
    const Vec3f plate = p.plate, open = p.irradiance_open;
    const bool clipped = std::max({plate.x, plate.y, plate.z}) >= clipped_plate;
    const auto tells = [](float value, float e) {
      return value > dark_plate && e > 0 && pi * value <= e;
    };
    if (!clipped && tells(plate.x, open.x) && tells(plate.y, open.y) && tells(plate.z, open.z)) {
      p.plate_share += Vec3f{p.irradiance_lamps.x / open.x, p.irradiance_lamps.y / open.y,
                             p.irradiance_lamps.z / open.z};
    } else {
      p.radiance +=
          Vec3f{block.albedo[0], block.albedo[1], block.albedo[2]} * p.irradiance_lamps * (1 / pi);
    }
    return clipped;
  }

  static void push_reflection(const ShadeContext& context,
                              ShadePoint& p,
                              const StandInParameters& block,
                              render::RaySink& rays) {
    const Vec3f view = -p.incoming;
    const float f = render::schlick(block.reflectance, std::abs(dot(p.hit.normal, view)));
    const Vec3f direction = normalize(render::mirrored(view, p.hit.normal));
    // The plate shows the compact sources mirrored; those that virtual objects hide are taken out.
    p.radiance -= render::compact_light(context, p.compact_open & ~p.compact_seen, p.hit.normal,
                                        view, block.roughness, {}) *
                  f;
    rays.push(p, {render::offset_origin(p.hit, direction),
                  direction,
                  p.throughput * f,
                  block.roughness,
                  {},
                  RayKind::difference});
  }
};

class PlateBackground final : public render::BackgroundShader {
 public:
  void shade(const ShadeContext&, std::span<ShadePoint* const> points) const override {
    for (ShadePoint* p : points) p->plate_share = p->plate_passed = {1, 1, 1};
  }
};

}  // namespace

void register_shaders() {
  render::register_shader("stand_in", std::make_shared<StandInShader>());
  render::register_background("plate", std::make_shared<PlateBackground>());
}

Material make_stand_in_material(std::string name, const StandInParameters& parameters) {
  Material material{std::move(name), "stand_in", {}};
  material.parameters.resize(sizeof parameters);
  std::memcpy(material.parameters.data(), &parameters, sizeof parameters);
  return material;
}

}  // namespace compositing
