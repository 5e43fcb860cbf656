// Simple solids as meshes, for made scenes.
#pragma once

#include <array>
#include <span>
#include <string_view>

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

// The faces of a box that `faces` names ("-x +x -y +y -z +z"), for boxes that stand on something or
// against it. Throws std::invalid_argument if it names another.
Mesh make_box_faces(Vec3f lower, Vec3f upper, std::string_view faces, float tile_m);

// The shapes from here on have no texture coordinates.

// A smooth solid of revolution about the z axis. `profile` are (radius, height) with the outside to
// the right of the way along it: from bottom to top, and on from top to bottom for an inner wall. A
// point given twice makes a hard edge, a profile that ends where it began a ring. Where parts meet,
// their positions are the same to the bit, so that a body whose profile begins and ends on the axis
// is closed.
Mesh make_turned(std::span<const std::array<float, 2>> profile, int segments);

// A round tube along `line`, its ends closed by flat caps.
Mesh make_tube(std::span<const Vec3f> line, float radius, int sides);

// A cushion about the origin: |x/a|^e + |y/b|^e + |z/c|^e = 1, with (a, b, c) = half and e > 1; 2
// is an ellipsoid, larger is boxier. Each of its sides is a grid of `steps` x `steps`; with all
// six, as make_box_faces names them, it is closed.
Mesh make_cushion(Vec3f half,
                  float exponent,
                  int steps,
                  std::string_view faces = "-x +x -y +y -z +z");

// A sheet bent through space, smooth, through a grid of rows x columns points, row by row. It faces
// (to the next row) x (to the next column).
Mesh make_sheet(std::span<const Vec3f> points, int rows, int columns);

// Adds `part`, turned by yaw_rad about z and then moved to `position`, to `whole`. Both have
// normals and texture coordinates, or neither has.
void append(Mesh& whole, const Mesh& part, Vec3f position = {}, float yaw_rad = 0);

}  // namespace render
