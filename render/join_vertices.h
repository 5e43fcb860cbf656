// Equal vertices made one, and normals made where a mesh has none.
#pragma once

#include <span>
#include <vector>

#include "render/mesh.h"

namespace render {

// Joins vertices that are equal in position, normal, texture coordinates and colour, to the bit;
// drops those that no triangle uses. A mesh without normals gets some: at each corner of a triangle
// the mean, weighted by their angles there, of the faces that share the place and turn away from
// its own by at most 50 degrees; of all its faces at places that 256 or more share. Takes time in
// proportion to the mesh. Tangents must not be there yet. Triangles must name vertices that are
// there, and positions be finite. Where `made` is not empty, it has the normals of a mesh without
// any: of each corner, three a triangle.
void join_vertices(Mesh& mesh, std::span<const Vec3f> made = {});

// The normals that the corners of meshes without any would get if they were one mesh: by mesh,
// three a triangle. So a surface stays smooth where its material changes.
std::vector<std::vector<Vec3f>> normals_across(std::span<const Mesh> meshes);

}  // namespace render
