// Models whose shape changes, with a file for each of their shapes.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "render/load_mesh.h"

namespace render {

// More triangles than these do not deform.
inline constexpr std::size_t most_deforming_triangles = 1'000'000;

// The model of the first file, as load_model, so that each of its corners can go where any other
// file has it: each instance has a mesh of its own, which stands where the model has it (the
// instance's own placement does nothing), each corner of each triangle is a vertex of its own, in
// the order of the triangles, the mesh is at rest as it is (Mesh::rest), and the instance moves.
//
// Throws as load_model, and std::runtime_error if there are triangles with positions that are not
// finite or more than most_deforming_triangles.
LoadedModel load_deforming_model(const std::string& path,
                                 const LoadOptions& options = {},
                                 const std::stop_token& stop = {});

// A part of a deforming model, by its name.
struct DeformingPart {
  std::string name;
  std::shared_ptr<const Mesh> mesh;  // in any of its shapes
};

// What changes of a mesh from shape to shape.
struct MeshShape {
  std::vector<Vec3f> positions, normals;
  std::vector<std::array<float, 4>> tangents;
};

// The shape that another file gives to `parts`, which are those of a deforming model in its order:
// only positions, normals and tangents are taken. What of vertices the file joins does not matter.
// Throws as load_deforming_model, and std::runtime_error naming file and part where that has other
// triangles, or not the normals or tangents that the first file has.
std::vector<MeshShape> load_shape(const std::string& path,
                                  const LoadOptions& options,
                                  std::span<const DeformingPart> parts,
                                  const std::stop_token& stop = {});

// The mesh in another shape; the rest of it stays.
std::shared_ptr<const Mesh> in_shape(const Mesh& mesh, MeshShape shape);

// Bytes that a shape of the mesh takes.
std::size_t bytes_of(const Mesh& mesh);

}  // namespace render
