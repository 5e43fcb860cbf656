// The shader "standard", and the background "environment".
#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/builtin_shaders.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render {
namespace {

// The block of a material that check() has passed.
StandardParameters block_of(const Material& material) {
  StandardParameters parameters;
  std::memcpy(&parameters, material.parameters.data(), sizeof parameters);
  return parameters;
}

SeenVideo seen_video(const ShadePoint& p, std::int32_t index) {
  return {index,
          p.hit.u,
          p.hit.v,
          {uv_of_step(p.hit, p.steps.a), uv_of_step(p.hit, p.steps.b)},
          p.blur_m * p.hit.uv_per_metre};
}

class StandardShader final : public Shader {
 public:
  void check(const SceneDescription& scene, const Material& material) const override {
    standard_parameters(material, scene.textures.size(), scene.videos.size());
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             RaySink& rays) const override {
    for (ShadePoint* p : points) {
      const StandardParameters block = block_of(context.scene->materials[p->hit.material]);
      const Spread seen{as_wide(p->steps.a, p->blur_m), as_wide(p->steps.b, p->blur_m)};
      const StandardSurface surface =
          standard_surface(block, *context.scene, p->hit, seen, context.texture_filter);
      const Vec3f view = -p->incoming;
      const StandardWeights weights = standard_weights(surface, view);
      constexpr float per_pi = 0.318309886F;
      if (block.emission_video >= 0) {
        p->video = seen_video(*p, block.emission_video);
        p->video_gain = surface.emission;
      } else {
        p->radiance = surface.emission;
      }
      if (block.base_color_video >= 0) p->paint = seen_video(*p, block.base_color_video);
      p->diffuse = weights.diffuse * per_pi;
      p->light_normal = surface.normal;
      if (weights.coat > 0) {
        mirror(*p, surface.coat_normal, view, surface.clearcoat_roughness,
               {weights.coat, weights.coat, weights.coat}, rays);
      }
      mirror(*p, surface.normal, view, surface.roughness, weights.specular, rays);
      if (weights.transmission != Vec3f{}) {
        rays.push(*p, {offset_origin(p->hit, p->incoming),
                       p->incoming,
                       p->throughput * weights.transmission,
                       {},
                       0,
                       {},
                       p->kind});
      }
    }
  }

  bool glows_by_means() const override { return true; }

  float glow(const Material& material) const override {
    const StandardParameters block = block_of(material);
    return block.emission_gain * std::ranges::max(block.emission);
  }

  bool lets_light_through(const Material& material) const override {
    const StandardParameters parameters = block_of(material);
    return passes(parameters) || parameters.alpha_cutoff > 0;
  }

  Vec3f transmittance(const ShadeContext& context,
                      const Material& material,
                      const HitPoint& hit,
                      Vec3f incoming,
                      RayKind kind,
                      float) const override {
    const StandardParameters parameters = block_of(material);
    if (parameters.alpha_cutoff > 0 &&
        standard_alpha(parameters, *context.scene, hit) < parameters.alpha_cutoff) {
      return {1, 1, 1};
    }
    if (kind != RayKind::shadow || !passes(parameters)) return {};
    if (parameters.alpha_blend != 0 && parameters.transmission == 0 && parameters.opacity == 1) {
      const float open =
          1 - std::clamp(standard_alpha(parameters, *context.scene, hit), 0.0F, 1.0F);
      return {open, open, open};  // as below, without the other maps
    }
    const StandardSurface surface = standard_surface(parameters, *context.scene, hit);
    return standard_weights(surface, -incoming).transmission;
  }

 private:
  static bool passes(const StandardParameters& p) {
    return p.transmission > 0 || p.opacity < 1 || p.alpha_blend != 0;
  }
  // A step across what a sample sees, of all that a rough lobe sees there, which rays that stand
  // for a part of one have in their steps already.
  static Vec3f as_wide(Vec3f step, float blur_m) {
    const float l = length(step);
    return l > 0 ? step * (std::max(l, blur_m) / l) : step;
  }
  static void mirror(
      const ShadePoint& p, Vec3f normal, Vec3f view, float roughness, Vec3f weight, RaySink& rays) {
    Vec3f direction = normalize(mirrored(view, normal));
    // A mapped or interpolated normal may send the ray into the surface: mirror it out again.
    const float into = dot(direction, p.hit.geometric_normal);
    if (into < 0) direction -= p.hit.geometric_normal * (2 * into);
    rays.push(p, {offset_origin(p.hit, direction), direction, p.throughput * weight, normal,
                  roughness, mirrored_spread(p, normal, view),
                  p.kind == RayKind::difference ? RayKind::difference : RayKind::reflection});
  }
};

class EnvironmentBackground final : public BackgroundShader {
 public:
  void shade(const ShadeContext&, std::span<ShadePoint* const> points) const override {
    for (ShadePoint* p : points) p->environment_share = {1, 1, 1};
  }
};

}  // namespace

std::shared_ptr<const Shader> make_standard_shader() { return std::make_shared<StandardShader>(); }

std::shared_ptr<const BackgroundShader> make_environment_background() {
  return std::make_shared<EnvironmentBackground>();
}

}  // namespace render
