// Paths of light, one at a time.
#include "render/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "calibrate/angles.h"
#include "render/stand_in_parameters.h"
#include "render/trace.h"

namespace render {
namespace {

using calibrate::pi_f;
constexpr float certain =
    std::numeric_limits<float>::infinity();  // density of a mirror's direction
constexpr int roulette_depth = 4;
// So many surfaces that a camera path meets straight on are split into their lobes, so that a weak
// mirror over a dull ground shows its sun in every path, not in a few very bright ones.
constexpr int split_depth = 2;
// After a diffuse bounce or a lobe of this roughness, lobes are taken as at least this rough:
// caustics are blurred by about two degrees, and keep their light, but a small sun's no longer come
// as single white dots.
//
// Kaplanyan and Dachsbacher, "Path Space Regularization for Holistic and Robust Light Transport",
// Eurographics 2013.
constexpr float caustic_roughness = 0.2F;

Vec3f times(Vec3f a, Vec3f b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

Vec3f cosine_direction(Vec3f normal, std::array<float, 2> random) {
  const float z = 1 - 2 * random[0];
  const float r = std::sqrt(std::max(0.0F, 1 - z * z));
  const float phi = 2 * pi_f * random[1];
  const Vec3f on_sphere{r * std::cos(phi), r * std::sin(phi), z};
  const Vec3f direction = normalize(normal + on_sphere);
  return dot(direction, direction) > 0.5F ? direction : normal;
}

}  // namespace

// How many times each lobe of a surface is followed: in the mean once all together, chosen by their
// shares of the light; or, split, every lobe that has a share once.
struct PathLobes {
  float diffuse = 0, coat = 0, specular = 0, transmission = 0;
  bool coat_mirror = false, specular_mirror = false;

  PathLobes(const StandardSurface& surface,
            const StandardWeights& weights,
            bool with_diffuse,
            bool split)
      : diffuse(with_diffuse ? mean(weights.diffuse) : 0),
        coat(weights.coat),
        specular(mean(weights.specular)),
        transmission(mean(weights.transmission)),
        coat_mirror(surface.clearcoat_roughness < mirror_roughness),
        specular_mirror(surface.roughness < mirror_roughness) {
    const float sum = diffuse + coat + specular + transmission;
    for (float* times : {&diffuse, &coat, &specular, &transmission}) {
      *times = !(*times > 0) ? 0.0F : split ? 1.0F : *times / sum;
    }
  }
};

enum class PathLobe : std::uint8_t { none, diffuse, coat, specular, transmission };

namespace {

// One of them, in proportion.
PathLobe chosen(const PathLobes& lobes, float choice) {
  const std::array<std::pair<PathLobe, float>, 4> chances{
      {{PathLobe::transmission, lobes.transmission},
       {PathLobe::coat, lobes.coat},
       {PathLobe::specular, lobes.specular},
       {PathLobe::diffuse, lobes.diffuse}}};
  PathLobe last = PathLobe::none;
  for (const auto& [lobe, chance] : chances) {
    if (!(chance > 0)) continue;
    if (choice < chance) return lobe;
    choice -= chance;
    last = lobe;
  }
  return last;
}

// `direction` mirrored at the triangle itself.
Vec3f other_side(const HitPoint& hit, Vec3f direction) {
  return direction - hit.geometric_normal * (2 * dot(direction, hit.geometric_normal));
}

// What the lobes that are no mirrors send from `direction` to `view`, cosine inside, and the
// density with which scattering chooses that direction.
struct LobeValue {
  Vec3f value;
  float density = 0;
};
struct LobeChoice {
  bool diffuse = false, specular = true;
};
LobeValue lobe_value(const StandardSurface& surface,
                     const StandardWeights& weights,
                     const PathLobes& lobes,
                     Vec3f view,
                     Vec3f direction,
                     LobeChoice of) {
  LobeValue result;
  if (of.diffuse) {
    const float d = std::max(0.0F, dot(surface.normal, direction)) / pi_f;
    result.value += weights.diffuse * d;
    result.density += lobes.diffuse * d;
  }
  if (!of.specular) return result;
  if (weights.coat > 0 && !lobes.coat_mirror) {
    const float d = lobe_density(surface.coat_normal, view, surface.clearcoat_roughness, direction);
    result.value += Vec3f{weights.coat, weights.coat, weights.coat} * d;
    result.density += lobes.coat * d;
  }
  if (!lobes.specular_mirror) {
    const float d = lobe_density(surface.normal, view, surface.roughness, direction);
    result.value += weights.specular * d;
    result.density += lobes.specular * d;
  }
  return result;
}

// The same for a direction above the triangle: what a mapped or interpolated normal would send
// below it is mirrored up again, and keeps its energy.
LobeValue folded_lobe_value(const HitPoint& hit,
                            const StandardSurface& surface,
                            const StandardWeights& weights,
                            const PathLobes& lobes,
                            Vec3f view,
                            Vec3f direction,
                            LobeChoice of) {
  LobeValue result = lobe_value(surface, weights, lobes, view, direction, of);
  const Vec3f below = other_side(hit, direction);
  if (dot(surface.normal, below) > 0 || dot(surface.coat_normal, below) > 0) {
    const LobeValue folded = lobe_value(surface, weights, lobes, view, below, of);
    result.value += folded.value;
    result.density += folded.density;
  }
  return result;
}

}  // namespace

// A path at work.
struct PathTracer::Walk {
  Vec3f origin, direction;
  unsigned mask = 0;
  RayKind kind = RayKind::camera;
  Vec3f share{1, 1, 1};         // of the light here that reaches the start
  float density = certain;      // with which the last scattering chose the direction
  Vec3f glow_share{1, 1, 1};    // the same of emission: less where lamps stand for it
  bool left_rough = false;      // was scattered by a diffuse surface
  bool left_diffuse = false;    // the last scattering was by a diffuse lobe
  bool sky_straight_on = true;  // whether the sky counts before the path was scattered
  bool mirrors_plate = false;
  int depth = 0;
  bool met_virtual = false;
  Media media;
  CameraPath result;
};

// Russian roulette, from some depth on.
bool PathTracer::survives(Walk& w, SampleSequence& numbers) {
  if (w.depth + 1 < roulette_depth) return true;
  const float survival = std::min(1.0F, largest(w.share));
  if (!(numbers.next() < survival)) return false;
  w.share *= 1 / survival;
  w.glow_share *= 1 / survival;
  return true;
}

PathTracer::PathTracer(const Scene& scene,
                       const EnvironmentSampler& environment,
                       std::span<const LocalLight> lamps,
                       const PathRules& rules,
                       std::span<const VideoTexture* const> videos)
    : scene_(scene), environment_(environment), lamps_(lamps), rules_(rules), videos_(videos) {
  const SceneDescription& description = scene.description();
  for (const Material& material : description.materials) {
    Surfacing surfacing;
    if (material.shader == "stand_in") {
      const StandInParameters stand_in = stand_in_parameters(material);
      std::copy_n(stand_in.albedo, 3, surfacing.parameters.base_color);
      surfacing.matte = true;
    } else if (material.shader == "glass") {
      surfacing.glass = true;
    } else if (!scene.shader_of(static_cast<std::uint32_t>(materials_.size()))
                    .pictures_of(material)
                    .empty()) {
      surfacing.picture = true;
    } else {
      surfacing.parameters =
          standard_parameters(material, description.textures.size(), videos.size());
    }
    materials_.push_back(surfacing);
  }
}

StandardSurface PathTracer::surface_at(const HitPoint& hit) const {
  const StandardParameters& parameters = materials_[hit.material].parameters;
  StandardSurface surface = standard_surface(parameters, scene_.description(), hit);
  if (parameters.emission_video >= 0) {
    const auto video = static_cast<std::size_t>(parameters.emission_video);
    surface.emission = times(surface.emission, sample(*videos_[video], hit.u, hit.v, 0));
  }
  return surface;
}

// What a live texture makes of the light that a matte surface sends back.
Vec3f PathTracer::paint_at(const HitPoint& hit) const {
  const std::int32_t index = materials_[hit.material].parameters.base_color_video;
  if (index < 0) return {1, 1, 1};
  const Vec3f light = sample(*videos_[static_cast<std::size_t>(index)], hit.u, hit.v, 0);
  return {std::min(light.x, 1.0F), std::min(light.y, 1.0F), std::min(light.z, 1.0F)};
}

void PathTracer::add_sky(const Walk& w, Vec3f& radiance) const {
  if (!w.sky_straight_on) return;
  float weight = 1;
  if (w.density != certain) weight = w.density / (w.density + environment_.density(w.direction));
  radiance += times(w.share, environment_.radiance(w.direction)) * weight;
}

Vec3f PathTracer::lamp_irradiance(const HitPoint& hit, Vec3f normal) const {
  Vec3f sum;
  const LampReceiver point{offset_origin(hit, hit.geometric_normal), normal, hit.geometric_normal};
  for (const LocalLight& lamp : lamps_) {
    const auto ray = ray_to_lamp(point, lamp);
    if (!ray) continue;
    Vec3f light = lamp.intensity * ray->per_intensity;
    if (ray->far_m > 0) {
      light = times(light, transmittance(scene_, point.origin, ray->direction, 0, ray->far_m,
                                         rules_.diffuse_blockers));
    }
    sum += light;
  }
  return sum;
}

Vec3f PathTracer::environment_light(const HitPoint& hit,
                                    const StandardSurface& surface,
                                    const StandardWeights& weights,
                                    const PathLobes& lobes,
                                    Vec3f view,
                                    bool mirrors_plate,
                                    SampleSequence& numbers) const {
  const auto sky = environment_.sample(numbers.next_pair());
  if (!sky) return {};
  const Vec3f l = sky->direction;
  if (!(dot(hit.geometric_normal, l) > 0)) return {};
  const float cosine = dot(surface.normal, l);
  const auto value_of = [&](LobeChoice of) {
    const LobeValue lobe = folded_lobe_value(hit, surface, weights, lobes, view, l, of);
    return lobe.value * (1 / (sky->density + lobe.density));
  };
  const bool apart = mirrors_plate && rules_.diffuse_bounces;
  Vec3f value = value_of({.diffuse = rules_.diffuse_bounces && !apart});
  // Diffuse light that is not followed comes from here alone.
  const Vec3f plain = rules_.diffuse_bounces || !(cosine > 0)
                          ? Vec3f{}
                          : weights.diffuse * (cosine / pi_f / sky->density);
  const Vec3f bounced = apart ? value_of({.diffuse = true, .specular = false}) : Vec3f{};
  if (value == Vec3f{} && plain == Vec3f{} && bounced == Vec3f{}) return {};
  const Vec3f origin = offset_origin(hit, l);
  // Clear bodies bend what lobes see: paths find it there.
  const Vec3f passing =
      transmittance(scene_, origin, l, 0, ray_far, rules_.lobe_blockers | ray_glass_blocks);
  // Where they see the plate, it is not the sky.
  const bool in_plate = mirrors_plate && value != Vec3f{} &&
                        transmittance(scene_, origin, l, 0, ray_far, mask_mirrored) == Vec3f{};
  value = times(in_plate ? bounced : value + bounced, passing);
  if (plain != Vec3f{}) {
    const Vec3f plain_passing =
        rules_.caustics || !scene_.has_glass()
            ? passing
            : transmittance(scene_, origin, l, 0, ray_far, rules_.lobe_blockers);
    const unsigned further = rules_.diffuse_blockers & ~rules_.lobe_blockers;
    const bool blocked = (further & mask_real_blocker) != 0 && scene_.has_real_blockers() &&
                         transmittance(scene_, origin, l, 0, ray_far, further) == Vec3f{};
    if (!blocked) value += times(plain, plain_passing);
  }
  return times(value, sky->radiance);
}

// Sends the path on by a lobe. False if it ends here.
bool PathTracer::scatter(Walk& w,
                         const HitPoint& hit,
                         const StandardSurface& surface,
                         const StandardWeights& weights,
                         const PathLobes& lobes,
                         PathLobe by,
                         SampleSequence& numbers) const {
  if (by == PathLobe::none) return false;
  const Vec3f view = -w.direction;
  if (by == PathLobe::transmission) {
    // Straight through: the direction keeps the density that it was chosen with.
    const Vec3f passed = weights.transmission * (1 / lobes.transmission);
    w.share = times(w.share, passed);
    w.glow_share = times(w.glow_share, passed);
    w.origin = offset_origin(hit, w.direction);
    return true;
  }
  w.kind = RayKind::reflection;
  w.left_diffuse = by == PathLobe::diffuse;
  w.mask = rules_.scattered_mask;
  if (w.mirrors_plate && !w.left_diffuse) w.mask |= mask_mirrored;
  w.sky_straight_on = true;
  const auto leave = [&](Vec3f direction) {
    w.direction = direction;
    w.origin = offset_origin(hit, direction);
  };
  const auto above = [&hit](Vec3f direction) {
    return dot(direction, hit.geometric_normal) < 0 ? normalize(other_side(hit, direction))
                                                    : direction;
  };
  const bool coat = by == PathLobe::coat;
  if (coat && lobes.coat_mirror) {
    w.share *= weights.coat / lobes.coat;
    w.glow_share = w.share;
    w.density = certain;
    leave(above(normalize(mirrored(view, surface.coat_normal))));
    return true;
  }
  const bool specular = by == PathLobe::specular;
  if (specular && lobes.specular_mirror) {
    w.share = times(w.share, weights.specular) * (1 / lobes.specular);
    w.glow_share = w.share;
    w.density = certain;
    leave(above(normalize(mirrored(view, surface.normal))));
    return true;
  }
  const auto random = numbers.next_pair();
  Vec3f direction;
  if (coat)
    direction = sample_lobe(surface.coat_normal, view, surface.clearcoat_roughness, random);
  else if (specular)
    direction = sample_lobe(surface.normal, view, surface.roughness, random);
  else
    direction = cosine_direction(surface.normal, random);
  const float roughness = coat ? surface.clearcoat_roughness : specular ? surface.roughness : 1.0F;
  w.left_rough = w.left_rough || roughness >= caustic_roughness;
  direction = above(direction);
  // Where only what lobes mirror sees the plate, each light has its own estimate.
  const bool apart = w.mirrors_plate && rules_.diffuse_bounces;
  const LobeChoice of{.diffuse = rules_.diffuse_bounces && (!apart || w.left_diffuse),
                      .specular = !apart || !w.left_diffuse};
  const LobeValue lobe = folded_lobe_value(hit, surface, weights, lobes, view, direction, of);
  if (!(lobe.density > 0)) return false;
  Vec3f glow = lobe.value;
  if (!lamps_.empty() && of.diffuse) {
    glow = folded_lobe_value(hit, surface, weights, lobes, view, direction,
                             {.diffuse = false, .specular = of.specular})
               .value;
  }
  w.glow_share = times(w.share, glow) * (1 / lobe.density);
  w.share = times(w.share, lobe.value) * (1 / lobe.density);
  w.density = lobe.density;
  leave(direction);
  return true;
}

// Mirrored or refracted, by Fresnel's share; one colour of three where they part.
void PathTracer::pass_glass(Walk& w, const HitPoint& hit, SampleSequence& numbers) const {
  const Crossing crossing = cross_surface(scene_, w.media, {hit.instance, hit.material}, hit.back);
  const auto leave = [&](Vec3f direction) {
    w.direction = direction;
    w.origin = offset_origin(hit, direction);
  };
  const auto pass = [&](Vec3f direction) {
    w.share = times(w.share, crossing.tint);
    w.glow_share = times(w.glow_share, crossing.tint);
    w.media = crossing.after;
    leave(direction);
  };
  if (!crossing.seen) {
    pass(w.direction);
    return;
  }
  std::size_t channel = 0;
  if (crossing.ratio[0] != crossing.ratio[1] || crossing.ratio[1] != crossing.ratio[2]) {
    const std::array shares{w.share.x, w.share.y, w.share.z};
    const float all = shares[0] + shares[1] + shares[2];
    if (!(all > 0)) return;
    float choice = numbers.next() * all;
    while (channel < 2 && choice >= shares[channel]) choice -= shares[channel++];
    const auto only = [channel](Vec3f v, float times) {
      return Vec3f{channel == 0 ? v.x * times : 0, channel == 1 ? v.y * times : 0,
                   channel == 2 ? v.z * times : 0};
    };
    const float chance = shares[channel] / all;
    if (!(chance > 0)) return;
    w.glow_share = only(w.glow_share, 1 / chance);
    w.share = only(w.share, 1 / chance);
  }
  if (w.kind == RayKind::camera) w.kind = RayKind::bent;
  if (w.mirrors_plate && w.kind == RayKind::reflection && !w.left_diffuse) w.mask |= mask_mirrored;
  w.density = certain;
  const float ratio = crossing.ratio[channel];
  if (numbers.next() < fresnel(-dot(w.direction, hit.normal), ratio)) {
    leave(mirrored_off(hit, w.direction));
    return;
  }
  pass(refracted_into(hit, w.direction, ratio));
}

// What a picture shows; nothing of other surfaces.
std::optional<Layer> PathTracer::layer_at(const Walk& w, const HitPoint& hit) const {
  if (!materials_[hit.material].picture) return std::nullopt;
  const SceneDescription& description = scene_.description();
  auto layer = scene_.shader_of(hit.material)
                   .layer({&description, &scene_, scene_.pictures(), scene_.prepared()},
                          description.materials[hit.material], hit, w.direction, w.kind, 0);
  // As much as environment_light() finds by shadow rays: they are two estimates of one light.
  if (layer && layer->lit_through && w.left_diffuse) layer->passed = *layer->lit_through;
  return layer;
}

// Goes on behind a picture that is not lit. False if there is nothing more to see.
bool PathTracer::pass_layer(Walk& w, const HitPoint& hit, const Layer& layer) {
  w.result.radiance += times(w.glow_share, layer.radiance);
  w.share = times(w.share, layer.passed);
  w.glow_share = times(w.glow_share, layer.passed);
  w.origin = offset_origin(hit, w.direction);
  return w.share != Vec3f{};
}

bool PathTracer::sees_plate(const Walk& w) const {
  return (w.kind == RayKind::camera || w.kind == RayKind::bent) && !rules_.sees_background;
}

// Whether the path sees the plate where it meets a stand-in.
bool PathTracer::ends_at(const Walk& w, const Instance& stand_in) const {
  if (sees_plate(w)) return true;
  return w.mirrors_plate && w.met_virtual && !w.left_diffuse && stand_in.mirrored;
}

void PathTracer::walk(Walk& w, SampleSequence& numbers) const {
  for (; w.depth < rules_.max_depth; ++w.depth) {
    const auto met = closest_hit(scene_, w.origin, w.direction, 0, w.mask, w.kind);
    if (!met) {
      if (sees_plate(w)) {
        w.result.ends.push_back(
            {w.share, w.kind == RayKind::bent, false, std::nullopt, w.direction});
      } else {
        add_sky(w, w.result.radiance);
      }
      break;
    }
    const HitPoint hit =
        scene_.hit_point(met->geom_id, met->prim_id, met->inst_id, met->u, met->v, w.direction);
    if (w.media.count > 0) {
      const Vec3f passed = passed_through(scene_, w.media, met->distance);
      w.share = times(w.share, passed);
      w.glow_share = times(w.glow_share, passed);
    }
    const Instance& instance = scene_.description().instances[hit.instance];
    const bool real = instance.kind == ObjectKind::stand_in;
    if (real && ends_at(w, instance)) {
      w.result.ends.push_back(
          {w.share, w.kind != RayKind::camera, w.kind == RayKind::reflection, hit, w.direction});
      break;
    }
    w.met_virtual = w.met_virtual || !real;
    if (materials_[hit.material].glass) {
      pass_glass(w, hit, numbers);
      if (!survives(w, numbers)) break;
      continue;
    }
    const std::optional<Layer> layer = layer_at(w, hit);
    if (layer && layer->albedo == Vec3f{}) {
      if (!pass_layer(w, hit, *layer)) break;
      if (!survives(w, numbers)) break;
      continue;
    }
    StandardSurface surface = surface_at(hit);
    if (w.left_rough) {
      surface.roughness = std::max(surface.roughness, caustic_roughness);
      surface.clearcoat_roughness = std::max(surface.clearcoat_roughness, caustic_roughness);
    }
    const Vec3f view = -w.direction;
    StandardWeights weights =
        layer ? StandardWeights{.diffuse = layer->albedo, .transmission = layer->passed}
        : materials_[hit.material].matte ? StandardWeights{.diffuse = surface.base}
                                         : standard_weights(surface, view);
    weights.diffuse = times(weights.diffuse, paint_at(hit));
    w.result.radiance += times(w.glow_share, surface.emission);
    const bool split = w.kind == RayKind::camera && w.depth < split_depth;
    const PathLobes lobes(surface, weights, rules_.diffuse_bounces, split);
    Vec3f light = environment_light(hit, surface, weights, lobes, view, w.mirrors_plate, numbers);
    if (!lamps_.empty() && weights.diffuse != Vec3f{})
      light += times(weights.diffuse, lamp_irradiance(hit, surface.normal)) * (1 / pi_f);
    if (rules_.caustics && !rules_.diffuse_bounces && weights.diffuse != Vec3f{})
      light += times(weights.diffuse, bent_irradiance(hit, surface.normal, numbers)) * (1 / pi_f);
    w.result.radiance += times(w.share, light);
    if (split) {
      // All but what goes straight on leave as paths of their own.
      for (const auto& [lobe, times] :
           {std::pair(PathLobe::coat, lobes.coat), std::pair(PathLobe::specular, lobes.specular),
            std::pair(PathLobe::diffuse, lobes.diffuse)}) {
        if (!(times > 0)) continue;
        Walk part = w;
        part.result = {};
        if (!scatter(part, hit, surface, weights, lobes, lobe, numbers)) continue;
        ++part.depth;
        walk(part, numbers);
        w.result.radiance += part.result.radiance;
        w.result.ends.insert(w.result.ends.end(), part.result.ends.begin(), part.result.ends.end());
        w.met_virtual = w.met_virtual || part.met_virtual;
      }
    }
    const PathLobe by = !split                   ? chosen(lobes, numbers.next())
                        : lobes.transmission > 0 ? PathLobe::transmission
                                                 : PathLobe::none;
    if (!scatter(w, hit, surface, weights, lobes, by, numbers)) break;
    if (!survives(w, numbers)) break;
  }
}

CameraPath PathTracer::camera_path(Vec3f origin, Vec3f direction, SampleSequence& numbers) const {
  Walk w;
  w.origin = origin;
  w.direction = direction;
  w.mask = rules_.camera_mask;
  w.mirrors_plate = !rules_.sees_background && scene_.has_mirrored();
  walk(w, numbers);
  return std::move(w.result);
}

PathTracer::Scattered PathTracer::scattered_path(Vec3f origin,
                                                 Vec3f direction,
                                                 unsigned mask,
                                                 SampleSequence& numbers) const {
  Walk w;
  w.origin = origin;
  w.direction = direction;
  w.mask = mask;
  w.kind = RayKind::reflection;
  w.mirrors_plate = scene_.has_mirrored();
  walk(w, numbers);
  return {w.result.radiance, w.met_virtual, std::move(w.result.ends)};
}

Vec3f PathTracer::bent_irradiance(const HitPoint& hit,
                                  Vec3f normal,
                                  SampleSequence& numbers) const {
  const Vec3f direction = cosine_direction(normal, numbers.next_pair());
  if (!(dot(direction, hit.geometric_normal) > 0)) return {};
  Walk w;
  w.origin = offset_origin(hit, direction);
  w.direction = direction;
  w.mask = rules_.diffuse_blockers;
  w.kind = RayKind::reflection;
  bool bent = false;
  for (; w.depth < rules_.max_depth; ++w.depth) {
    const auto met = closest_hit(scene_, w.origin, w.direction, 0, w.mask, w.kind);
    if (!met) return bent ? times(w.share, environment_.radiance(w.direction)) * pi_f : Vec3f{};
    const HitPoint at =
        scene_.hit_point(met->geom_id, met->prim_id, met->inst_id, met->u, met->v, w.direction);
    if (w.media.count > 0) {
      w.share = times(w.share, passed_through(scene_, w.media, met->distance));
    }
    if (!materials_[at.material].glass) return {};
    pass_glass(w, at, numbers);
    bent = true;
    if (!survives(w, numbers)) return {};
  }
  return {};
}

Vec3f PathTracer::virtual_irradiance(const HitPoint& hit, SampleSequence& numbers) const {
  const Vec3f direction = cosine_direction(hit.normal, numbers.next_pair());
  if (!(dot(direction, hit.geometric_normal) > 0)) return {};
  Walk w;
  w.origin = offset_origin(hit, direction);
  w.direction = direction;
  w.mask = mask_virtual;
  w.kind = RayKind::reflection;
  w.left_rough = w.left_diffuse = true;
  w.sky_straight_on = false;
  if (!lamps_.empty()) w.glow_share = {};
  walk(w, numbers);
  return w.result.radiance * pi_f;
}

}  // namespace render
