// Triangle meshes, textures and materials: what a scene is described with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calibrate/vec.h"

namespace render {

using calibrate::Vec3;
using calibrate::Vec3f;

struct Mesh {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;                        // per vertex, unit; empty = flat
  std::vector<std::array<float, 2>> uvs;             // per vertex; empty = none
  std::vector<std::array<float, 2>> second_uvs;      // per vertex; empty = those
  std::vector<std::array<float, 4>> tangents;        // per vertex, xyz + handedness; empty = none
  std::vector<std::array<std::uint8_t, 3>> colours;  // per vertex, sRGB codes; empty = white
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> materials;  // per triangle, or one for all: of the scene
  // Of a mesh that deforms: where its vertices are at rest, which all its shapes share. Its tree is
  // built for them, and then fitted to `positions`. Null: it does not deform.
  std::shared_ptr<const std::vector<Vec3f>> rest;
};

// Visits the arrays that have a value for each vertex, positions first.
inline constexpr std::size_t vertex_arrays = 6;
template <class AnyMesh, class Visit>
void for_each_vertex_array(AnyMesh& mesh, const Visit& visit) {
  visit(mesh.positions), visit(mesh.normals), visit(mesh.uvs);
  visit(mesh.second_uvs), visit(mesh.tangents), visit(mesh.colours);
}

// Appends what a mesh, which may be the same, has of a vertex.
inline void append_vertex(Mesh& mesh, const Mesh& from, std::uint32_t vertex) {
  const auto append = [vertex](auto& to, const auto& values) {
    if (values.empty()) return;
    const auto value = values[vertex];
    to.push_back(value);
  };
  append(mesh.positions, from.positions), append(mesh.normals, from.normals);
  append(mesh.uvs, from.uvs), append(mesh.second_uvs, from.second_uvs);
  append(mesh.tangents, from.tangents), append(mesh.colours, from.colours);
}

// How a texture goes on beyond its edges: again, its last texels drawn out, or again mirrored.
enum class Wrap : std::uint8_t { repeat, clamp, mirror };

// 8-bit texels, 1 to 4 channels, with mip levels.
struct Texture {
  int width = 0;
  int height = 0;
  int channels = 0;
  bool srgb = false;                 // colour: the first three channels are decoded to linear light
  std::vector<std::uint8_t> texels;  // every level after the other, level 0 first
  std::array<Wrap, 2> wrap{};        // to the sides, up and down

  friend bool operator==(const Texture&, const Texture&) = default;
};

// A shader by name with its parameter block. Blocks are plain bytes, so that scenes travel.
struct Material {
  std::string name;
  std::string shader;  // "standard", "stand_in", ...: see shader.h
  std::vector<std::byte> parameters;

  friend bool operator==(const Material&, const Material&) = default;
};

}  // namespace render
