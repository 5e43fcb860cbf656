// glTF files, checked before anything is built from them.
#include "render/gltf_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

namespace render {
namespace {

using nlohmann::json;

constexpr int max_json_depth = 64;
constexpr int max_node_depth = 256;
constexpr std::uint64_t max_buffer_bytes = std::uint64_t{2} << 30;
constexpr std::uint64_t max_accessor_count = std::uint64_t{192} << 20;

// Required extensions that the import understands.
constexpr std::array understood_extensions{
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_sheen",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
    "KHR_materials_pbrSpecularGlossiness",
};
// What is shown, tells nothing of how a model looks, or is told of elsewhere: all else that a model
// may use without need is left out.
constexpr std::array quiet_extensions{
    "EXT_mesh_gpu_instancing",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_volume",
    "KHR_materials_transmission",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    "KHR_xmp",
    "KHR_materials_pbrSpecularGlossiness",
};

template <std::size_t size>
bool is_in(const std::array<const char*, size>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_hidden(const json& node) {
  static const json::json_pointer visible("/extensions/KHR_node_visibility/visible");
  return node.contains(visible) && node[visible] == false;
}

std::uint32_t little_endian(const std::byte* bytes) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<std::uint32_t>(bytes[i]);
  return value;
}

// The parser's own way to tell its depth takes time with the square of an array's length.
bool is_too_deep(std::string_view text) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '\\') {
      ++i;  // whatever follows does not end it
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && (c == '{' || c == '[')) {
      if (++depth > max_json_depth) return true;
    } else if (!quoted && (c == '}' || c == ']')) {
      --depth;
    }
  }
  return false;
}

// Of a text that may quote all of a buffer: as much as one reads.
std::string beginning_of(std::string_view text) {
  constexpr std::size_t most = 200;
  if (text.size() <= most) return std::string(text);
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80) --end;  // of UTF-8
  return std::string(text.substr(0, end)) + " ...";
}

class Checker {
 public:
  explicit Checker(std::span<const std::byte> bytes) {
    const std::string_view text = json_text(bytes);
    if (is_too_deep(text)) refuse("its JSON is nested too deeply");
    try {
      document_ = json::parse(text);
    } catch (const json::exception& error) {
      // Without the library's name for the error, in brackets.
      const std::string_view what = error.what();
      refuse("its JSON is damaged: " + beginning_of(what.substr(what.find(']') + 2)));
    }
    if (!document_.is_object()) refuse("it is not a glTF file");
  }

  GltfFacts check() {
    try {
      check_version();
      check_extensions();
      check_buffers();
      check_accessors();
      check_meshes();
      check_nodes();
      count_triangles();
    } catch (const json::exception& error) {
      refuse(std::string("a value has the wrong type: ") + error.what());
    }
    if (!array("animations").empty()) facts_.notes.push_back("animations are left out");
    return std::move(facts_);
  }

 private:
  [[noreturn]] static void refuse(const std::string& why) { throw std::runtime_error(why); }

  static std::string_view json_text(std::span<const std::byte> bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!text.starts_with("glTF")) return text;
    if (bytes.size() < 20) refuse("the file is truncated");
    if (little_endian(&bytes[4]) != 2) refuse("only version 2 of binary glTF is read");
    if (little_endian(&bytes[8]) > bytes.size()) refuse("the file is truncated");
    const std::uint32_t length = little_endian(&bytes[12]);
    if (text.substr(16, 4) != "JSON" || length > bytes.size() - 20)
      refuse("its first chunk is damaged");
    return text.substr(20, length);
  }

  const json& array(const char* key) const {
    static const json none = json::array();
    const auto found = document_.find(key);
    if (found == document_.end()) return none;
    if (!found->is_array()) refuse(std::string("'") + key + "' is not an array");
    return *found;
  }

  static std::string place(const char* key, std::size_t index) {
    return std::string(key).append(" ").append(std::to_string(index));
  }

  // A whole number at or above 0, or `otherwise`.
  std::uint64_t number(const json& object,
                       const char* key,
                       std::uint64_t otherwise,
                       const std::string& where) const {
    const auto found = object.find(key);
    if (found == object.end()) return otherwise;
    if (!found->is_number_unsigned()) refuse(where + ": '" + key + "' must be a whole number");
    return found->get<std::uint64_t>();
  }

  void check_index(std::uint64_t index, const char* of, const std::string& where) const {
    if (index >= array(of).size())
      refuse(where + " names number " + std::to_string(index) + " of " +
             std::to_string(array(of).size()) + " " + of);
  }

  void check_version() const {
    static const json::json_pointer place("/asset/version");
    const auto version = document_.value(place, std::string("2.0"));
    if (version != "2" && !version.starts_with("2."))
      refuse("it is glTF " + version + ", of which only version 2 is read; export it anew");
  }

  void check_extensions() {
    for (const json& name : array("extensionsRequired")) {
      const auto text = name.get<std::string>();
      if (!is_in(understood_extensions, text))
        refuse("it needs the extension " + text +
               ", which is not understood; export the model without it");
    }
    for (const json& name : array("extensionsUsed")) {
      const auto text = name.get<std::string>();
      if (!is_in(quiet_extensions, text)) facts_.notes.push_back(text + " is left out");
    }
    for (const json& material : array("materials")) note_refraction(material);
  }

  // The index of refraction and dispersion are only known to solid glass.
  void note_refraction(const json& material) {
    static const json::json_pointer thickness("/KHR_materials_volume/thicknessFactor");
    const json extensions = material.value("extensions", json::object());
    const bool solid =
        extensions.value(thickness, 0.0) > 0 && extensions.contains("KHR_materials_transmission");
    if (solid) return;
    const auto leave_out = [&](const std::string& name, const char* value, double plain) {
      if (!extensions.contains(name) || extensions[name].value(value, plain) == plain) return;
      const std::string note = name + " is left out, but for solid glass";
      if (std::ranges::find(facts_.notes, note) == facts_.notes.end()) facts_.notes.push_back(note);
    };
    leave_out("KHR_materials_ior", "ior", 1.5);
    leave_out("KHR_materials_dispersion", "dispersion", 0);
  }

  void check_buffers() const {
    const json& buffers = array("buffers");
    for (std::size_t i = 0; i < buffers.size(); ++i)
      if (number(buffers[i], "byteLength", 0, place("buffer", i)) > max_buffer_bytes)
        refuse(place("buffer", i) + " is larger than 2 GB, the most that is read");
    const json& views = array("bufferViews");
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::string where = place("bufferView", i);
      const std::uint64_t buffer = number(views[i], "buffer", max_buffer_bytes, where);
      check_index(buffer, "buffers", where);
      const std::uint64_t offset = number(views[i], "byteOffset", 0, where);
      const std::uint64_t length = number(views[i], "byteLength", 0, where);
      const std::uint64_t whole = number(buffers[buffer], "byteLength", 0, where);
      if (offset > whole || length > whole - offset) refuse(where + " reaches beyond its buffer");
    }
  }

  void check_accessors() const {
    const json& accessors = array("accessors");
    const json& views = array("bufferViews");
    for (std::size_t i = 0; i < accessors.size(); ++i) {
      const std::string where = place("accessor", i);
      const json& accessor = accessors[i];
      const std::uint64_t count = number(accessor, "count", 0, where);
      if (count > max_accessor_count) refuse(where + " is too large");
      const std::uint64_t element =
          component_bytes(accessor, where) * components(accessor.value("type", ""), where);
      if (!accessor.contains("bufferView") || count == 0) continue;
      const std::uint64_t view = number(accessor, "bufferView", 0, where);
      check_index(view, "bufferViews", where);
      const std::uint64_t offset = number(accessor, "byteOffset", 0, where);
      const std::uint64_t stride = number(views[view], "byteStride", element, where);
      const std::uint64_t length = number(views[view], "byteLength", 0, where);
      if (stride < element || stride > 252 + element) refuse(where + " has a wrong byteStride");
      if (offset > length || (count - 1) * stride + element > length - offset)
        refuse(where + " reaches beyond its bufferView");
    }
  }

  std::uint64_t component_bytes(const json& accessor, const std::string& where) const {
    switch (number(accessor, "componentType", 0, where)) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
      case 5126:
        return 4;
      default:
        refuse(where + " has an unknown componentType");
    }
  }

  std::uint64_t components(const std::string& type, const std::string& where) const {
    static constexpr std::array<std::pair<const char*, std::uint64_t>, 7> types{{{"SCALAR", 1},
                                                                                 {"VEC2", 2},
                                                                                 {"VEC3", 3},
                                                                                 {"VEC4", 4},
                                                                                 {"MAT2", 4},
                                                                                 {"MAT3", 9},
                                                                                 {"MAT4", 16}}};
    for (const auto& [name, count] : types)
      if (type == name) return count;
    refuse(where + " has the unknown type '" + type + "'");
  }

  void check_meshes() {
    const json& meshes = array("meshes");
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const std::string where = place("mesh", i);
      std::size_t plain_triangles = 0;
      for (const json& primitive : meshes[i].value("primitives", json::array())) {
        const json attributes = primitive.value("attributes", json::object());
        std::uint64_t vertices = 0;
        for (const auto& [name, accessor] : attributes.items()) {
          if (!accessor.is_number_unsigned())
            refuse(where + ": attribute " + name + " is no index");
          check_index(accessor.get<std::uint64_t>(), "accessors", where);
          const std::uint64_t count =
              number(array("accessors")[accessor.get<std::size_t>()], "count", 0, where);
          if (vertices != 0 && count != vertices)
            refuse(where + ": attribute " + name + " has another length than the others");
          vertices = count;
        }
        if (primitive.contains("material"))
          check_index(number(primitive, "material", 0, where), "materials", where);
        std::uint64_t corners = vertices;
        if (primitive.contains("indices")) {
          const std::uint64_t indices = number(primitive, "indices", 0, where);
          check_index(indices, "accessors", where);
          corners = number(array("accessors")[indices], "count", 0, where);
        }
        const std::uint64_t mode = number(primitive, "mode", 4, where);
        const json extensions = primitive.value("extensions", json::object());
        if (extensions.contains("KHR_draco_mesh_compression")) continue;
        if (mode == 4) plain_triangles += corners / 3;
        if ((mode == 5 || mode == 6) && corners > 2) plain_triangles += corners - 2;
      }
      mesh_triangles_.push_back(plain_triangles);
    }
  }

  // Counts the triangles of the meshes that the shown scene holds; the nodes must be trees.
  void count_triangles() {
    const json& scenes = array("scenes");
    const std::uint64_t shown = number(document_, "scene", 0, "the file");
    if (scenes.empty()) return;
    check_index(shown, "scenes", "the file");
    std::vector<bool> used(mesh_triangles_.size(), false);
    std::vector<json> pending{scenes[shown].value("nodes", json::array())};
    while (!pending.empty()) {
      const json indices = std::move(pending.back());
      pending.pop_back();
      for (const json& index : indices) {
        if (!index.is_number_unsigned()) refuse("a node of the scene is no index");
        check_index(index.get<std::uint64_t>(), "nodes", place("scene", shown));
        const json& node = array("nodes")[index.get<std::size_t>()];
        if (is_hidden(node)) continue;
        if (node.contains("mesh")) used[node["mesh"].get<std::size_t>()] = true;
        if (node.contains("children")) pending.push_back(node["children"]);
      }
    }
    for (std::size_t i = 0; i < used.size(); ++i)
      if (used[i]) facts_.plain_triangles += mesh_triangles_[i];
  }

  // Every node has one parent at most, and no node is below itself.
  void check_nodes() const {
    const json& nodes = array("nodes");
    std::vector<std::size_t> parents(nodes.size(), nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const std::string where = place("node", i);
      if (nodes[i].contains("mesh"))
        check_index(number(nodes[i], "mesh", 0, where), "meshes", where);
      for (const json& child : nodes[i].value("children", json::array())) {
        if (!child.is_number_unsigned()) refuse(where + ": a child is no index");
        check_index(child.get<std::uint64_t>(), "nodes", where);
        std::size_t& parent = parents[child.get<std::size_t>()];
        if (parent != nodes.size())
          refuse("node " + std::to_string(child.get<std::size_t>()) + " has two parents");
        parent = i;
      }
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      int depth = 0;
      for (std::size_t above = parents[i]; above != nodes.size(); above = parents[above])
        if (++depth > max_node_depth)
          refuse(place("node", i) + " is below itself, or nested too deeply");
    }
  }

  json document_;
  std::vector<std::size_t> mesh_triangles_;  // Draco-compressed ones not counted
  GltfFacts facts_;
};

}  // namespace

GltfFacts check_gltf(std::span<const std::byte> file_bytes) { return Checker(file_bytes).check(); }

}  // namespace render
