// The standard surface: glTF 2.0 metallic-roughness with clear coat, thin transmission, emission.
//
// With unit view direction v, normal n, Fc = coat * Schlick(.04, n.v), Fd = specular * Schlick(.04,
// n.v), F = lerp(Fd, Schlick(base, n.v), metallic):
//   coat         reflects Fc, in a lobe of coat_roughness
//   specular     reflects (1 - Fc) F, in a lobe of roughness
//   diffuse      (1 - Fc)(1 - metallic)(1 - Fd)(1 - transmission) base facing / pi
//   transmission (1 - Fc)(1 - metallic)(1 - Fd) transmission * base, straight through (thin wall)
//   emission     added
// Opacity below 1 takes that share of diffuse, of transmission and of what metal mirrors; the rest
// goes straight through untinted. Coverage below 1 (blended alpha) takes that share of all of it.
// The lobes are GGX's distribution of visible normals (Heitz, "Sampling the GGX Distribution of
// Visible Normals", JCGT 2018), mirrored once more where they would go below the surface, and not
// weakened by masking: each keeps all its energy, so that a white furnace stays white.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "render/environment.h"
#include "render/lanes.h"
#include "render/light_table.h"
#include "render/mesh.h"
#include "render/texture.h"

namespace render {

// Where a texture is looked up, of a mesh's coordinates (u, v), v down: u' = u[0] u + u[1] v +
// u[2], and v' as well.
struct UvTransform {
  std::array<float, 3> u{1, 0, 0}, v{0, 1, 0};
  std::int32_t second = 0;  // 1 = of the mesh's second coordinates, if it has any
  friend bool operator==(const UvTransform&, const UvTransform&) = default;
  std::array<float, 2> of_place(std::array<float, 2> uv) const {
    const auto [du, dv] = of_step(uv);
    return {du + u[2], dv + v[2]};
  }
  std::array<float, 2> of_step(std::array<float, 2> uv) const {
    return {u[0] * uv[0] + u[1] * uv[1], v[0] * uv[0] + v[1] * uv[1]};
  }
};

// Parameter block of the shader "standard". Texture indices are into SceneDescription::textures,
// -1 = none; factors multiply texels as glTF says.
struct StandardParameters {
  float base_color[3] = {1, 1, 1};
  float metallic = 0;
  float roughness = 0.5F;
  float clearcoat = 0;
  float clearcoat_roughness = 0;
  float transmission = 0;
  float emission[3] = {0, 0, 0};  // radiance
  float emission_gain = 1;
  float normal_scale = 1;
  float alpha_cutoff = 0;        // texels of base alpha below this are holes; 0 = none are
  std::int32_t alpha_blend = 0;  // 1 = base alpha is the share of what is behind that is covered
  float opacity = 1;  // 1 - the share that passes untinted, beside what a dielectric mirrors
  std::int32_t base_color_texture = -1;
  std::int32_t metallic_roughness_texture = -1;  // green roughness, blue metallic
  std::int32_t normal_texture = -1;
  std::int32_t clearcoat_texture = -1;     // red
  std::int32_t transmission_texture = -1;  // red
  std::int32_t emission_texture = -1;
  float base_color_alpha = 1;
  float specular = 1;  // share of the mirrored light of what is not metal (KHR_materials_specular)
  std::int32_t emission_video = -1;  // of SceneDescription::videos: emission is times its light
  // What of the surface is matte is times this one, which counts as 1 at most. It tints neither
  // what metal mirrors nor what passes.
  std::int32_t base_color_video = -1;
  std::int32_t clearcoat_roughness_texture = -1;  // green
  // In the place of the base texture's alpha: its alpha if it has one, else red.
  std::int32_t alpha_texture = -1;
  // Where each of these is looked up; live video is at the mesh's own coordinates. A mesh's
  // tangents are those of its normal map, as that is looked up.
  UvTransform base_color_uv, metallic_roughness_uv, normal_uv, clearcoat_uv, transmission_uv,
      emission_uv, clearcoat_roughness_uv, alpha_uv;
};

// The block in a material of the shader "standard", and back. Throws std::invalid_argument, naming
// the material, if the block is not one, holds numbers that are not finite, or names textures or
// videos that are not among so many.
StandardParameters standard_parameters(const Material& material,
                                       std::size_t texture_count,
                                       std::size_t video_count = 0);
Material make_standard_material(std::string name, const StandardParameters& parameters);

// What a point of a standard surface does with light, textures looked up.
struct StandardSurface {
  Vec3f base;  // with the vertex colour
  float metallic, roughness, clearcoat, clearcoat_roughness, transmission;
  Vec3f emission;     // without the light of a video
  Vec3f normal;       // with the normal map, unit, on the viewer's side of the surface
  Vec3f coat_normal;  // without it: the coat is smooth over a rough ground
  float alpha;        // below alpha_cutoff = hole
  float coverage = 1;
  float specular = 1;
  // Of diffuse light, what the normals within the footprint get beside their mean.
  float facing = 1;
  float opacity = 1;
};

struct HitPoint;          // scene.h
struct SceneDescription;  // scene.h

// The surface at `hit`, textures filtered over the parallelogram on it that has `footprint` as its
// sides, in metres. The parameters' texture indices must be those of `scene` (see
// standard_parameters). Safe from any thread; does not throw.
StandardSurface standard_surface(const StandardParameters& parameters,
                                 const SceneDescription& scene,
                                 const HitPoint& hit,
                                 const Spread& footprint = {},
                                 TextureFilter filter = TextureFilter::dense);
// Its alpha alone, at one point, for rays that only ask whether there is a hole.
float standard_alpha(const StandardParameters& parameters,
                     const SceneDescription& scene,
                     const HitPoint& hit);

// Lobes smoother than this are mirrors: followed along the mirrored direction alone. At alpha =
// roughness^2 = 4e-4 a lobe is narrower than any light that a table or a map resolves.
inline constexpr float mirror_roughness = 0.02F;

// Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Eurographics 1994.
inline float schlick(float f0, float cosine) {
  const float m = std::clamp(1 - cosine, 0.0F, 1.0F);
  const float m2 = m * m;
  return f0 + (1 - f0) * (m2 * m2 * m);
}

// The share of light that each part of a surface passes on, seen from the unit direction `view`.
// Per colour they sum to 1 where the base is white, and to less elsewhere.
struct StandardWeights {
  float coat = 0;
  Vec3f specular{};
  Vec3f diffuse{};  // albedo: divide by pi for the BRDF
  Vec3f transmission{};
};
inline StandardWeights standard_weights(const StandardSurface& surface, Vec3f view) {
  StandardWeights weights;
  const float cosine = std::abs(dot(surface.normal, view));
  weights.coat = surface.clearcoat * schlick(0.04F, std::abs(dot(surface.coat_normal, view)));
  const float under = 1 - weights.coat;
  const float dielectric = 1 - surface.metallic;
  const float sheen = surface.specular * schlick(0.04F, cosine);
  const float below = under * dielectric * (1 - sheen);
  const float opacity = surface.opacity, coverage = surface.coverage;
  const float matte = below * (1 - surface.transmission) * surface.facing * opacity;
  const float tinted = below * surface.transmission * opacity;
  const float untinted = (below + under * surface.metallic) * (1 - opacity);
  const float metal = surface.metallic * opacity;
  weights.coat *= coverage;
  const auto channel = [&](float base, float& specular, float& diffuse, float& transmission) {
    specular = coverage * under * (dielectric * sheen + metal * schlick(base, cosine));
    diffuse = coverage * matte * base;
    transmission = coverage * (tinted * base + untinted) + (1 - coverage);
  };
  channel(surface.base.x, weights.specular.x, weights.diffuse.x, weights.transmission.x);
  channel(surface.base.y, weights.specular.y, weights.diffuse.y, weights.transmission.y);
  channel(surface.base.z, weights.specular.z, weights.diffuse.z, weights.transmission.z);
  return weights;
}

// `view` mirrored at a surface of unit normal `normal`.
inline Vec3f mirrored(Vec3f view, Vec3f normal) { return normal * (2 * dot(normal, view)) - view; }

// A direction of the lobe about `normal` seen from `view` (both unit), from two numbers in 0..1,
// and the density, per steradian, with which it is chosen. A lobe of weight W sends W *
// lobe_density of the radiance from each direction to the viewer (the cosine is inside).
// `roughness` must be at least mirror_roughness; directions below the surface have density 0. A
// view from below the shading normal counts as grazing.
Vec3f sample_lobe(Vec3f normal, Vec3f view, float roughness, std::array<float, 2> random);
float lobe_density(Vec3f normal, Vec3f view, float roughness, Vec3f direction);

// All lobes about a normal as one view sees them.
class SeenLobe {
 public:
  SeenLobe(Vec3f normal, Vec3f geometric_normal, Vec3f view);

  // lobe_density of a lobe of alpha = roughness^2.
  float density(float alpha, Vec3f direction) const;
  // What a lobe mirrors to the view of light from `direction`, per irradiance of it, if both are
  // blurred as by a disc of radius blur_rad. What an interpolated or mapped normal would send below
  // the triangle, of unit normal `geometric_normal`, is mirrored up again.
  float blurred(float roughness, float blur_rad, Vec3f direction) const;
  // The same of eight at once.
  Eight blurred(float roughness, Eight blur_rad, const calibrate::Vec3T<Eight>& direction) const;
  // The view mirrored at the normal: where narrow lobes have their middle.
  Vec3f middle() const { return middle_; }

 private:
  Vec3f x_, y_, normal_;  // the lobe's frame
  Vec3f geometric_normal_;
  Vec3f middle_;
  Vec3f view_;           // in the frame
  float slope_squared_;  // of the view
};

}  // namespace render
