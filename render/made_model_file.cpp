// Scenes as GLB and PLY.
#include "render/made_model_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <vector>

#include "render/glass.h"
#include "render/standard.h"
#include "render/transform.h"

namespace render {
namespace {

using nlohmann::json;

void write_file(const std::string& path, std::span<const std::byte> bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

void append(std::vector<std::byte>& bytes, const void* data, std::size_t size) {
  const auto* from = static_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), from, from + size);
}
void append_word(std::vector<std::byte>& bytes, std::uint32_t word) {
  append(bytes, &word, sizeof word);
}

// The second chunk of the file, and what the first says of it.
class Buffer {
 public:
  template <class T>
  std::size_t add(const std::vector<T>& values,
                  std::size_t count,
                  int component,
                  const char* type,
                  const json& bounds = json::object()) {
    const std::size_t at = bytes_.size();
    append(bytes_, values.data(), values.size() * sizeof(T));
    views_.push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes_.size() - at}});
    json accessor{{"bufferView", views_.size() - 1},
                  {"componentType", component},
                  {"count", count},
                  {"type", type}};
    accessor.update(bounds);
    accessors_.push_back(std::move(accessor));
    return accessors_.size() - 1;
  }
  void describe(json& document) const {
    document["bufferViews"] = views_;
    document["accessors"] = accessors_;
    document["buffers"] = json::array({{{"byteLength", bytes_.size()}}});
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
  json views_ = json::array(), accessors_ = json::array();
};

json bounds_of(const Mesh& mesh) {
  Vec3f lower = mesh.positions.at(0), upper = lower;
  for (const Vec3f p : mesh.positions) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
  return {{"min", {lower.x, lower.y, lower.z}}, {"max", {upper.x, upper.y, upper.z}}};
}

constexpr int gl_float = 5126, gl_unsigned = 5125;

json mesh_of(const Mesh& mesh, Buffer& buffer) {
  if (mesh.materials.size() != 1) {
    throw std::invalid_argument("a mesh with several materials is not written as glTF");
  }
  const std::size_t vertices = mesh.positions.size();
  json attributes;
  attributes["POSITION"] = buffer.add(mesh.positions, vertices, gl_float, "VEC3", bounds_of(mesh));
  if (!mesh.normals.empty()) {
    attributes["NORMAL"] = buffer.add(mesh.normals, vertices, gl_float, "VEC3");
  }
  if (!mesh.uvs.empty()) {
    attributes["TEXCOORD_0"] = buffer.add(mesh.uvs, vertices, gl_float, "VEC2");
  }
  const std::size_t indices =
      buffer.add(mesh.triangles, 3 * mesh.triangles.size(), gl_unsigned, "SCALAR");
  const json primitive{
      {"attributes", attributes}, {"indices", indices}, {"material", mesh.materials[0]}};
  return {{"primitives", json::array({primitive})}};
}

json glass_of(const Material& material) {
  const GlassParameters glass = glass_parameters(material);
  json volume{{"thicknessFactor", 0.01}};
  json colour = json::array();
  constexpr float distance_m = 0.1F;
  for (const float absorption : glass.absorption) {
    colour.push_back(std::exp(-absorption * distance_m));
  }
  volume["attenuationDistance"] = distance_m;
  volume["attenuationColor"] = colour;
  json extensions{{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                  {"KHR_materials_ior", {{"ior", glass.index}}},
                  {"KHR_materials_volume", volume}};
  if (glass.abbe > 0) extensions["KHR_materials_dispersion"] = {{"dispersion", 20 / glass.abbe}};
  return {{"name", material.name},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {glass.tint[0], glass.tint[1], glass.tint[2], 1}},
            {"metallicFactor", 0},
            {"roughnessFactor", 0}}},
          {"extensions", extensions}};
}

json material_of(const Material& material, const SceneDescription& scene) {
  if (material.shader == "glass") return glass_of(material);
  const StandardParameters p =
      standard_parameters(material, scene.textures.size(), scene.videos.size());
  const auto& base = p.base_color;
  json emission = json::array();
  float most = 1;
  for (const float e : p.emission) most = std::max(most, e * p.emission_gain);
  for (const float e : p.emission) emission.push_back(e * p.emission_gain / most);
  json extensions{{"KHR_materials_emissive_strength", {{"emissiveStrength", most}}}};
  if (p.transmission > 0) {
    extensions["KHR_materials_transmission"] = {{"transmissionFactor", p.transmission}};
  }
  return {{"name", material.name},
          {"doubleSided", true},  // nothing is culled
          {"emissiveFactor", emission},
          {"extensions", extensions},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {base[0], base[1], base[2], p.base_color_alpha}},
            {"metallicFactor", p.metallic},
            {"roughnessFactor", p.roughness}}}};
}

// Column by column: from the object to glTF's frame, (x, y, z) of the set to (x, z, -y).
json matrix_of(const Instance& instance) {
  const auto& m = instance.set_from_object;
  json columns = json::array();
  for (std::size_t c = 0; c < 4; ++c) {
    columns.insert(columns.end(), {m[c], m[8 + c], -m[4 + c], c == 3 ? 1 : 0});
  }
  return columns;
}

}  // namespace

void write_glb(const std::string& path, const SceneDescription& scene) {
  json document{{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  Buffer buffer;
  for (const auto& mesh : scene.meshes) document["meshes"].push_back(mesh_of(*mesh, buffer));
  for (const Material& material : scene.materials) {
    document["materials"].push_back(material_of(material, scene));
  }
  json shown = json::array();
  for (const Instance& instance : scene.instances) {
    document["nodes"].push_back(
        {{"name", instance.name}, {"mesh", instance.mesh}, {"matrix", matrix_of(instance)}});
    shown.push_back(shown.size());
  }
  document["scenes"] = json::array({{{"nodes", shown}}});
  document["extensionsUsed"] = {"KHR_materials_transmission", "KHR_materials_volume",
                                "KHR_materials_ior", "KHR_materials_dispersion",
                                "KHR_materials_emissive_strength"};
  buffer.describe(document);
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');

  constexpr std::uint32_t magic = 0x46546C67, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;
  const std::size_t binary = buffer.bytes().size();  // of floats and words: whole words
  std::vector<std::byte> file;
  file.reserve(28 + text.size() + binary);
  for (const std::size_t word : {std::size_t{magic}, std::size_t{2}, 28 + text.size() + binary,
                                 text.size(), std::size_t{json_chunk}}) {
    append_word(file, static_cast<std::uint32_t>(word));
  }
  append(file, text.data(), text.size());
  append_word(file, static_cast<std::uint32_t>(binary));
  append_word(file, binary_chunk);
  append(file, buffer.bytes().data(), binary);
  write_file(path, file);
}

void write_ply(const std::string& path, const SceneDescription& scene) {
  std::vector<std::byte> vertices, faces;
  std::uint32_t first = 0;
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = *scene.meshes.at(instance.mesh);
    for (const Vec3f p : mesh.positions) {
      const Vec3f placed = transform_point(instance.set_from_object, p);
      append(vertices, &placed, sizeof placed);
    }
    for (const auto& triangle : mesh.triangles) {
      faces.push_back(std::byte{3});
      for (const std::uint32_t corner : triangle) append_word(faces, first + corner);
    }
    first += static_cast<std::uint32_t>(mesh.positions.size());
  }
  const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                           std::to_string(first) +
                           "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                           std::to_string(triangle_count(scene)) +
                           "\nproperty list uchar int vertex_indices\nend_header\n";
  std::vector<std::byte> file;
  append(file, head.data(), head.size());
  append(file, vertices.data(), vertices.size());
  append(file, faces.data(), faces.size());
  write_file(path, file);
}

}  // namespace render
