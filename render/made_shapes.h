// Simple solids as meshes, for made scenes.
#pragma once

#include <array>
#include <span>

#include "render/mesh.h"

namespace render {

// All sizes are metres; texture coordinates count metres of surface divided by `tile_m`. Normals
// point outwards.

// A rectangle with corner `corner` and edges `along` and `up` (not parallel); it faces along x up.
// Texture u runs with `along` and v against `up`; with tile_m = 0 the picture fills the rectangle
// once.
Mesh make_rectangle(Vec3f corner, Vec3f along, Vec3f up, float tile_m);

// A box from `lower` to `upper`, edges along the axes, whose edges are bevelled by `bevel` (0 =
// none).
Mesh make_box(Vec3f lower, Vec3f upper, float bevel, float tile_m);

// A solid of revolution about the z axis: `profile` are (radius, height) from bottom to top, each
// stretch between two of them smooth around the axis, with a hard edge at each point. u runs once
// around.
Mesh make_lathe(std::span<const std::array<float, 2>> profile, int segments, float tile_m);

// Adds `part`, turned by yaw_rad about z and then moved to `position`, to `whole`. Both have
// normals and texture coordinates, or neither has.
void append(Mesh& whole, const Mesh& part, Vec3f position = {}, float yaw_rad = 0);

}  // namespace render
