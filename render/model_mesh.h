// Meshes of an imported model.
#pragma once

#include <cstddef>
#include <span>

#include "render/mesh.h"
#include "render/model_format.h"
#include "render/model_material.h"

struct aiMesh;

namespace render {

// A mesh with the texture coordinates that its material wants, vertex colours if it is `coloured`
// and, where the material has a normal map, tangents. Where the format has smooth normals, equal
// vertices become one, and missing normals are made (join_vertices.h); else a mesh without normals
// stays flat; where it has a normal map, each of its triangles gets vertices of its own. Triangles
// whose positions are not finite, or beyond `farthest_position`, are left out and counted in
// `left_out`; texture coordinates that are not finite, or beyond a million, become 0. Throws
// std::runtime_error if a triangle names a vertex that is not there. Normals that are missing are
// `corner_normals`, unless that is empty (normals_across).
//
// In STL, a normal that is not its triangle's (by over 25 degrees) is that.
Mesh convert_mesh(const aiMesh& source,
                  const ImportedMaterial& material,
                  const ModelFormat& format,
                  bool coloured,
                  std::span<const Vec3f> corner_normals,
                  std::size_t& left_out);

// Of the colours of a mesh's vertices, which it must have. Alpha is 0 where a file tells none.
struct ColourRange {
  float brightest = 0, least_alpha = 1, most_alpha = 0;
};
ColourRange colour_range(const aiMesh& source);

// The triangles of a mesh and their positions, nothing else; as in convert_mesh.
Mesh convert_shape(const aiMesh& source, std::size_t& left_out);

inline constexpr float farthest_position = 1e12F;

}  // namespace render
