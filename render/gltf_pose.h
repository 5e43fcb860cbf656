// Where a glTF skin puts the vertices of a mesh.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace render {

// Column by column, as glTF writes it.
using GltfMatrix = std::array<double, 16>;

GltfMatrix operator*(const GltfMatrix& a, const GltfMatrix& b);

// Of a node's translation, rotation (x, y, z, w; of any length) and scale.
GltfMatrix gltf_matrix(const std::array<double, 3>& translation,
                       const std::array<double, 4>& rotation,
                       const std::array<double, 3>& scale);

// Nothing if it turns space into a plane, or is not finite. The last row must be 0 0 0 1.
std::optional<GltfMatrix> inverse(const GltfMatrix& m);

// Moves vertices by their joints: each by the mean of its joints' matrices, weighted. Vertices
// without weights stay. `positions`, `normals` (or none) are (vertices, 3), `tangents` (or none)
// (vertices, 4); `joints` and `weights` (vertices, influences). Throws std::runtime_error if a
// joint is not there.
//
// glTF 2.0 specification (Khronos Group, ISO/IEC 12113), section 3.7.3.
void apply_skin(std::span<const GltfMatrix> matrices,
                std::span<const float> joints,
                std::span<const float> weights,
                std::vector<float>& positions,
                std::vector<float>& normals,
                std::vector<float>& tangents);

}  // namespace render
