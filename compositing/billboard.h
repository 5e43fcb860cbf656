// Persons as billboards: live video with alpha on an upright rectangle in the set.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "compositing/camera_grid.h"
#include "render/mesh.h"
#include "render/video_texture.h"

namespace compositing {

// How a billboard shows its live picture (render::Scene::pictures).
struct BillboardSettings {
  std::uint32_t picture = 0;
  std::array<float, 3> gain{1, 1, 1};  // radiance of the picture's white, in the plate's units
  // The picture as it is, or as the albedo of a matte surface in the set's light.
  bool lit = false;
  // Of the light that thin cloth catches, how much its threads pass on in their colour, 0 to 1: a
  // shadow where alpha is a, of colour c, then has (1 - a) (1 + translucency a c) of the light.
  // Not for what is lit.
  float translucency = 0;
};

// Registers the shader "billboard": a part of register_shaders() (stand_in.h).
//
// Rays of every kind see the picture's foreground and, through 1 - alpha of it, what is behind:
// camera rays, mirrored, bent and shadow rays. Light is dimmed alike in all colours, unless cloth
// is translucent. The picture is filtered as wide as the sample's cone; shadow rays, which have
// none, see its finest texels.
void register_billboards();

// A material of that shader. Without a camera the surface's texture coordinates 0..1 are the whole
// picture. With one, the lens is kept as a grid of `steps` by as many places, between which is
// interpolated: within a few hundredths of a pixel for lenses in use (billboards.md). Throws
// std::invalid_argument for a lens that sees wider, or settings that are out of their range.
render::Material make_billboard_material(std::string name, const BillboardSettings& settings);
render::Material make_billboard_material(std::string name,
                                         const BillboardSettings& settings,
                                         const BillboardCamera& camera,
                                         int steps = 96);

// The unit square that billboards are placed by: x -0.5..0.5, z 0..1, at y 0, facing -y; (u, v) =
// (0, 0) is its left upper corner as seen from there.
render::Mesh make_billboard_mesh(std::uint32_t material);

}  // namespace compositing
