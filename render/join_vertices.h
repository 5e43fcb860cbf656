// Equal vertices made one, and normals made where a mesh has none.
#pragma once

#include "render/mesh.h"

namespace render {

// Joins vertices that are equal in position, normal and texture coordinates, to the bit; drops
// those that no triangle uses. A mesh without normals gets some: at each corner of a triangle the
// mean, weighted by their angles there, of the faces that share the place and turn away from its
// own by at most 50 degrees; of all its faces at places that 256 or more share. Takes time in
// proportion to the mesh. Tangents must not be there yet. Triangles must name vertices that are
// there, and positions be finite.
void join_vertices(Mesh& mesh);

}  // namespace render
