// glTF files, put in the words that assimp understands.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/gltf_values.h"

namespace render {

// What assimp does not know of a material, which it finds under the name `mended`.
struct MendedMaterial {
  std::string mended, name;  // ... in place of its own
  float dispersion = 0;      // KHR_materials_dispersion: 20 / Abbe's number
};

struct MendedGltf {
  std::vector<std::byte> file;      // .gltf or .glb, as before
  std::vector<std::byte> vertices;  // what stands in the buffer `mended_vertices` that it names now
  std::vector<MendedMaterial> materials;
  std::vector<std::string> notes;  // what of it could not be mended, and is left out
};

inline constexpr const char* mended_vertices = "mended-vertices.bin";

// The file in plainer words; nothing if it is plain already, or a buffer of it is not there.
// - vertices are floats: assimp 5.2 takes integers (KHR_mesh_quantization, also core texture
//   coordinates) for the bits of floats, and reads sparse values over interleaved ones wrongly;
// - morph targets and skins have done their work: the shape is that of the default weights, and of
//   the joints as their nodes stand; no animation is left;
// - instances of EXT_mesh_gpu_instancing are nodes;
// - nodes that KHR_node_visibility hides, and those below them, show nothing;
// - the texCoord of a KHR_texture_transform is that of its texture;
// - emission is times its KHR_materials_emissive_strength;
// - materials with a KHR_materials_dispersion have names of their own, to be found by.
// The file must have passed check_gltf. Throws std::runtime_error, naming the place in the file, if
// its buffers hold less than it says, or a part of it has the wrong type.
//
// glTF 2.0 specification (Khronos Group, ISO/IEC 12113), sections 3.6.2, 3.7.2 and 3.7.3.
std::optional<MendedGltf> mend_gltf(std::span<const std::byte> file_bytes,
                                    const ReadGltfFile& read);

}  // namespace render
