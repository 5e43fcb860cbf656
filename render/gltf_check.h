// glTF files, checked before anything is built from them.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace render {

struct GltfFacts {
  // Triangles of the shown scene's meshes, each counted once, as the accessors' counts say;
  // Draco-compressed ones are not counted, since Draco drops degenerate triangles.
  std::size_t plain_triangles = 0;
  std::vector<std::string> notes;  // extensions and features that a model uses and we leave out
};

// Checks the JSON of a .gltf, or of a .glb's first chunk (told apart by their first bytes): sizes
// and indices against each other, nodes form trees, required extensions are understood. Throws
// std::runtime_error naming place in the file and reason.
//
// glTF 2.0 specification (Khronos Group, ISO/IEC 12113), sections 3.5, 3.6 and 4.4.
GltfFacts check_gltf(std::span<const std::byte> file_bytes);

}  // namespace render
