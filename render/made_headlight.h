// A made headlight: reflector, bulb and cover of glass, procedural, at real size.
#pragma once

#include <cstddef>

#include "render/mesh.h"
#include "render/scene.h"

namespace render {

// As many triangles as the headlight of Benthin et al. (EGPGV 2002).
inline constexpr std::size_t made_headlight_triangles = 800000;

// A headlight 25 cm wide that shines to +x: a parabolic reflector of facets, a cover of solid glass
// with ribs on its inside, a bulb of two glass shells about a filament, rings and a housing.
// Whatever starts with "bulb" belongs to the bulb and can be moved as one. "cover", "bulb envelope"
// and "bulb capsule" are closed bodies of the shader "glass"; all else is of the shader "standard".
// A path from the viewer to the reflector through the bulb and back passes up to 20 surfaces of
// glass.
SceneDescription make_headlight();

// The filament's middle, at the reflector's focus.
inline constexpr Vec3f headlight_focus{-0.068F, 0, 0};

// Parts, for make_headlight alone: the cover in the headlight's frame; the bulb's about the
// filament, its tip towards +z.
Mesh make_headlight_cover();
struct HeadlightBulb {
  Mesh envelope, capsule, filament, wires, base;
};
HeadlightBulb make_headlight_bulb();

// The shape that all parts follow, a rounded rectangle: (0, y, z) at u, v in -1..1.
Vec3f headlight_plan(double u, double v);
// x of the cover's outside there.
double headlight_front(double y, double z);
// Where the way around its edge is after `share` 0..1 of it, scaled; counter-clockwise seen from
// the front. 1 is where 0 is, to the bit.
Vec3f headlight_edge(double share, double scale);

}  // namespace render
