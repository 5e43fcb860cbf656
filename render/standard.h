// The standard surface: glTF 2.0 metallic-roughness with clear coat, thin transmission, emission.
//
// With unit view direction v, normal n, F0 = lerp(.04, base, metallic), Fc = coat * Schlick(.04, n.v),
// F = Schlick(F0, n.v):
//   coat         reflects Fc, in a lobe of coat_roughness
//   specular     reflects (1 - Fc) F, in a lobe of roughness
//   diffuse      (1 - Fc)(1 - F)(1 - metallic)(1 - transmission) base / pi
//   transmission (1 - Fc)(1 - F)(1 - metallic) transmission * base, straight through (thin wall)
//   emission     added
// The lobes are GGX's distribution of visible normals (Heitz, "Sampling the GGX Distribution of
// Visible Normals", JCGT 2018), mirrored once more where they would go below the surface, and not
// weakened by masking: each keeps all its energy, so that a white furnace stays white.
#pragma once

#include <cstdint>

#include "render/mesh.h"

namespace render {

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
  float alpha_cutoff = 0;  // texels of base alpha below this are holes; 0 = opaque
  std::int32_t base_color_texture = -1;
  std::int32_t metallic_roughness_texture = -1;  // green roughness, blue metallic
  std::int32_t normal_texture = -1;
  std::int32_t clearcoat_texture = -1;  // red
  std::int32_t transmission_texture = -1;  // red
  std::int32_t emission_texture = -1;
  float base_color_alpha = 1;
  std::uint32_t two_sided = 1;
};

// What a point of a standard surface does with light, textures looked up.
struct StandardSurface {
  Vec3f base;
  float metallic, roughness, clearcoat, clearcoat_roughness, transmission;
  Vec3f emission;
  Vec3f normal;  // shading normal, unit, on the viewer's side of the surface
  float alpha;   // < cutoff = hole
};

struct HitPoint;  // scene.h

}  // namespace render
