// The shader "glass": both rays at each surface.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/builtin_shaders.h"
#include "render/glass.h"
#include "render/ray_differential.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render {
namespace {

class GlassShader final : public Shader {
 public:
  void check(const SceneDescription&, const Material& material) const override {
    glass_parameters(material);
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             RaySink& rays) const override {
    for (ShadePoint* p : points) shade_one(*context.compiled, *p, rays);
  }

  bool lets_light_through(const Material&) const override { return true; }

  std::optional<Vec3f> shadow_everywhere(const Material& material) const override {
    const GlassParameters p = glass_parameters(material);
    return Vec3f{p.shadow[0] * p.tint[0], p.shadow[1] * p.tint[1], p.shadow[2] * p.tint[2]};
  }

 private:
  static void shade_one(const Scene& scene, ShadePoint& p, RaySink& rays) {
    const Crossing crossing =
        cross_surface(scene, p.media, {p.hit.instance, p.hit.material}, p.hit.back);
    if (!crossing.seen) {
      rays.push(p, {offset_origin(p.hit, p.incoming),
                    p.incoming,
                    p.throughput * crossing.tint,
                    {},
                    0,
                    {},
                    p.kind,
                    crossing.after});
      return;
    }
    const bool one_index =
        crossing.ratio[0] == crossing.ratio[1] && crossing.ratio[1] == crossing.ratio[2];
    if (one_index) {
      split(p, crossing, crossing.ratio[0], p.throughput, rays);
      return;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      split(p, crossing, crossing.ratio[c], only_colour(p.throughput, c), rays);
    }
  }

  static RayKind kind_after(RayKind kind) { return kind == RayKind::camera ? RayKind::bent : kind; }

  // The mirrored ray and the refracted one.
  static void split(
      const ShadePoint& p, const Crossing& crossing, float ratio, Vec3f throughput, RaySink& rays) {
    const Vec3f view = -p.incoming;
    const Vec3f normal = p.hit.normal;
    const float cosine = dot(normal, view);
    const float share = fresnel(cosine, ratio);
    const RayKind kind = kind_after(p.kind);
    if (share > 0) {
      const Vec3f direction = mirrored_off(p.hit, p.incoming);
      rays.push(p, {offset_origin(p.hit, direction),
                    direction,
                    throughput * share,
                    {},
                    0,
                    mirrored_spread(p, normal, view),
                    kind,
                    p.media});
    }
    if (!(share < 1)) return;
    const Vec3f direction = refracted_into(p.hit, p.incoming, ratio);
    if (direction == Vec3f{}) return;
    rays.push(p, {offset_origin(p.hit, direction),
                  direction,
                  throughput * (1 - share) * crossing.tint,
                  {},
                  0,
                  refracted_spread(p, direction, ratio),
                  kind,
                  crossing.after});
  }

  // How the refracted direction turns over the sample's piece of surface, and with its cone.
  static Spread refracted_spread(const ShadePoint& p, Vec3f direction, float ratio) {
    return {refracted_turn(p.hit, p.incoming, direction, ratio, {p.steps.a, p.turns.a}),
            refracted_turn(p.hit, p.incoming, direction, ratio, {p.steps.b, p.turns.b})};
  }
};

}  // namespace

std::shared_ptr<const Shader> make_glass_shader() { return std::make_shared<GlassShader>(); }

}  // namespace render
