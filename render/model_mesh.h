// Meshes of an imported model.
#pragma once

#include <cstddef>

#include "render/mesh.h"
#include "render/model_material.h"

struct aiMesh;

namespace render {

// A mesh with the texture coordinates that its material wants and, where that has a normal map,
// tangents. Triangles with positions that are not finite are left out and counted in `left_out`.
// Throws std::runtime_error if a triangle names a vertex that is not there.
Mesh convert_mesh(const aiMesh& source, const ImportedMaterial& material, std::size_t& left_out);

}  // namespace render
