// A model as its file says it, before its textures are decoded. Private to the import.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/bytes.h"
#include "render/glass.h"
#include "render/load_mesh.h"
#include "render/standard.h"

namespace render {

struct RawMaterial {
  std::string name;
  StandardParameters parameters;         // textures: indices into RawModel::textures
  std::optional<GlassParameters> glass;  // a volume that light passes: this, in place of those
};

struct RawTexture {
  std::string name;  // a file's, relative to the model, or for people if it is embedded
  bool srgb = false;
  bool embedded = false;
  std::array<Wrap, 2> wrap{};
  std::vector<std::byte>
      bytes;  // an embedded file, or, if it has a size, (height, width, 4) texels
  std::int32_t width = 0, height = 0;
};

struct RawModel {
  std::vector<Mesh> meshes;  // one material each, an index into `materials`
  std::vector<RawMaterial> materials;
  std::vector<RawTexture> textures;
  std::vector<Instance> instances;
  LoadReport report;  // all but what is known of textures
};

// How many elements the arrays of a model have that are sent apart from all else.
struct RawSizes {
  struct OfMesh {
    std::array<std::uint64_t, vertex_arrays> of_vertices{};  // as for_each_vertex_array has them
    std::uint64_t triangles = 0;
  };
  std::vector<OfMesh> meshes;
  std::vector<std::uint64_t> textures;
};

// All of a model but those arrays, as bytes and back. parse_head throws std::runtime_error on
// anything that is truncated, refers to what is not there or is larger than what is read: 64 M
// triangles, 192 M vertices, 2 GB of embedded textures.
std::vector<std::byte> write_head(const RawModel& model);
RawSizes parse_head(std::span<const std::byte> bytes, RawModel& model);

// Throws std::runtime_error unless positions, normals and texture coordinates are finite and every
// triangle names vertices that are there.
void check_arrays(const Mesh& mesh);

inline constexpr std::size_t max_model_triangles = std::size_t{64} << 20;

}  // namespace render
