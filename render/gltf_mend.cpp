// glTF files, mended.
#include "render/gltf_mend.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "render/gltf_pose.h"

namespace render {
namespace {

using nlohmann::json;

constexpr std::size_t most_instances = 100'000;

[[noreturn]] void refuse_gltf(const std::string& why) { throw std::runtime_error(why); }

bool is_vertex_data(const std::string& attribute) {
  return attribute == "POSITION" || attribute == "NORMAL" || attribute == "TANGENT" ||
         attribute == "COLOR_0" || attribute.starts_with("TEXCOORD_");
}

const json& extension(const json& object, const char* name) {
  return gltf_member(gltf_member(object, "extensions"), name);
}
const json& instances_of(const json& node) { return extension(node, "EXT_mesh_gpu_instancing"); }

class Mender {
 public:
  Mender(std::span<const std::byte> bytes, const ReadGltfFile& read) : read_(read) {
    std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    binary_ = text.starts_with("glTF");
    if (binary_) {
      std::uint32_t length = 0;
      std::memcpy(&length, &bytes[12], 4);
      chunks_ = bytes.subspan(20 + length);
      text = text.substr(20, length);
    }
    document_ = json::parse(text);
    values_.emplace(document_, chunks_);
  }

  std::optional<MendedGltf> mend() {
    mend_texture_coordinates();
    mend_emission();
    mend_dispersion();
    hide_nodes();
    if (!is_plain()) {
      if (!values_->read_buffers(read_)) return std::nullopt;
      make_instances();
      pose_meshes();
      make_floats();
      changed_ = true;
    }
    if (!changed_) return std::nullopt;
    return MendedGltf{write(), std::move(vertices_), std::move(materials_), std::move(notes_)};
  }

 private:
  json& array(const char* key) {
    json& found = document_[key];
    if (found.is_null()) found = json::array();
    return found;
  }

  template <class Visit>
  void for_each_primitive(const Visit& visit) {
    for (json& mesh : array("meshes")) {
      if (!mesh.contains("primitives")) continue;
      for (json& primitive : mesh["primitives"]) visit(primitive);
    }
  }

  // Whether nothing has to be read to mend it.
  bool is_plain() {
    bool plain = array("skins").empty();
    for (const json& node : array("nodes")) {
      plain = plain && instances_of(node).is_null();
    }
    for_each_primitive([&](const json& primitive) {
      plain = plain && gltf_member(primitive, "targets").empty();
      for (const auto& [name, accessor] : gltf_member(primitive, "attributes").items()) {
        plain = plain && !(is_vertex_data(name) && needs_floats(gltf_index(accessor)));
      }
    });
    return plain;
  }

  bool needs_floats(std::size_t index) {
    const json& accessor = array("accessors").at(index);
    return accessor.at("componentType") != 5126 || accessor.contains("sparse");
  }

  void mend_texture_coordinates() {
    std::vector<json*> pending{&array("materials")};
    while (!pending.empty()) {
      json& at = *pending.back();
      pending.pop_back();
      for (json& below : at) {
        if (below.is_structured()) pending.push_back(&below);
      }
      const json& transform = extension(at, "KHR_texture_transform");
      const json& set = gltf_member(transform, "texCoord");
      if (!set.is_number_unsigned()) continue;
      at["texCoord"] = set;
      changed_ = true;
    }
  }

  // What glows, times its strength: assimp knows the factor alone.
  void mend_emission() {
    constexpr const char* name = "KHR_materials_emissive_strength";
    for (json& material : array("materials")) {
      const json& strength = gltf_member(extension(material, name), "emissiveStrength");
      if (strength.is_null()) continue;
      const double gain = std::max(strength.get<double>(), 0.0);
      material["extensions"].erase(name);
      changed_ = true;
      if (!material.contains("emissiveFactor")) continue;
      for (json& factor : material["emissiveFactor"]) factor = factor.get<double>() * gain;
    }
  }

  void mend_dispersion() {
    json& materials = array("materials");
    for (std::size_t i = 0; i < materials.size(); ++i) {
      const json& value =
          gltf_member(extension(materials[i], "KHR_materials_dispersion"), "dispersion");
      if (value.is_null() || !(value.get<double>() > 0)) continue;
      constexpr double strongest = 1e6;
      const auto dispersion = static_cast<float>(std::min(value.get<double>(), strongest));
      materials_.push_back({"mended-material-" + std::to_string(i),
                            materials[i].value("name", std::string()), dispersion});
      materials[i]["name"] = materials_.back().mended;
      changed_ = true;
    }
  }

  void hide_nodes() {
    json& nodes = array("nodes");
    std::vector<std::size_t> pending;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const json& visibility = extension(nodes[i], "KHR_node_visibility");
      if (gltf_member(visibility, "visible") == false) pending.push_back(i);
    }
    while (!pending.empty()) {
      json& node = nodes[pending.back()];
      pending.pop_back();
      for (const json& child : gltf_member(node, "children")) pending.push_back(child);
      changed_ = node.erase("mesh") > 0 || changed_;
    }
  }

  // An accessor of floats, of as many components as `like` has.
  json accessor_of(const std::vector<float>& values, const json& like) {
    json& views = array("bufferViews");
    views.push_back({{"buffer", array("buffers").size()},
                     {"byteOffset", vertices_.size()},
                     {"byteLength", 4 * values.size()}});
    const auto bytes = std::as_bytes(std::span(values));
    vertices_.insert(vertices_.end(), bytes.begin(), bytes.end());
    return {{"bufferView", views.size() - 1},
            {"componentType", 5126},
            {"count", like.at("count")},
            {"type", like.at("type")}};
  }

  void make_floats() {
    std::vector<bool> met(array("accessors").size(), false);
    for_each_primitive([&](const json& primitive) {
      for (const auto& [name, index] : gltf_member(primitive, "attributes").items()) {
        const auto i = gltf_index(index);
        if (!is_vertex_data(name) || met.at(i) || !needs_floats(i)) continue;
        met[i] = true;
        json& accessor = array("accessors")[i];
        if (accessor.contains("bufferView") || accessor.contains("sparse")) {
          accessor = accessor_of(values_->floats(i), accessor);
        } else {  // Draco has the values
          accessor["componentType"] = 5126;
          accessor.erase("normalized");
        }
      }
    });
  }

  void make_instances() {
    json& nodes = array("nodes");
    for (std::size_t i = 0, before = nodes.size(); i < before; ++i) {
      const json attributes = gltf_member(instances_of(nodes[i]), "attributes");
      if (!attributes.is_object() || !nodes[i].contains("mesh")) continue;
      const std::string name = nodes[i].value("name", "nodes[" + std::to_string(i) + "]");
      const auto values = [&](const char* key, std::size_t wide) {
        const json& index = gltf_member(attributes, key);
        if (index.is_null()) return std::vector<float>();
        const auto accessor = gltf_index(index);
        std::vector<float> all = values_->floats(accessor);
        if (gltf_components(array("accessors")[accessor]) != wide)
          refuse_gltf("node '" + name + "': the " + key + " of its instances has a wrong type");
        return all;
      };
      const std::vector<float> shifts = values("TRANSLATION", 3), turns = values("ROTATION", 4),
                               scales = values("SCALE", 3);
      const std::size_t count = std::max({shifts.size() / 3, turns.size() / 4, scales.size() / 3});
      if ((!shifts.empty() && shifts.size() != 3 * count) ||
          (!turns.empty() && turns.size() != 4 * count) ||
          (!scales.empty() && scales.size() != 3 * count))
        refuse_gltf("node '" + name + "': the lists of its instances have not one length");
      if (count > most_instances)
        refuse_gltf("node '" + name + "' has " + std::to_string(count) + " instances, over " +
                    std::to_string(most_instances));
      json instance = json::object();
      instance["mesh"] = nodes[i]["mesh"];
      if (nodes[i].contains("weights")) instance["weights"] = nodes[i]["weights"];
      if (nodes[i].contains("skin"))
        notes_.push_back("node '" + name + "': the skin of its instances is left out");
      nodes[i].erase("mesh");
      for (std::size_t k = 0; k < count; ++k) {
        instance["name"] = name + " " + std::to_string(k);
        const auto part = [&](const char* key, const std::vector<float>& all, std::size_t wide) {
          if (all.empty()) return;
          const float* first = all.data() + wide * k;
          instance[key] = std::vector<float>(first, first + wide);
        };
        part("translation", shifts, 3), part("rotation", turns, 4), part("scale", scales, 3);
        nodes[i]["children"].push_back(nodes.size());
        nodes.push_back(instance);
      }
    }
  }

  // Each node's mesh in its default pose.
  void pose_meshes() {
    json& nodes = array("nodes");
    json& meshes = array("meshes");
    std::map<std::size_t, std::map<std::string, std::vector<std::size_t>>> users;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (!nodes[i].contains("mesh")) continue;
      const auto mesh = gltf_index(nodes[i]["mesh"]);
      const json& own = gltf_member(nodes[i], "weights");
      const json weights = own.is_null() ? gltf_member(meshes.at(mesh), "weights") : own;
      std::string pose;
      for (const json& weight : weights) {
        if (weight.get<double>() != 0) pose = weights.dump();
      }
      if (nodes[i].contains("skin")) pose += " node " + std::to_string(i);
      users[mesh][pose].push_back(i);
    }
    for (const auto& [mesh, poses] : users) {
      std::size_t left = poses.size();  // the last takes the mesh itself, unless one is at rest
      for (const auto& [pose, with] : poses) {
        --left;
        if (pose.empty()) continue;
        std::size_t posed = mesh;
        if (left > 0 || poses.begin()->first.empty()) {
          posed = meshes.size();
          meshes.push_back(json(meshes[mesh]));
        }
        const json& node = nodes[with[0]];
        const json& own = gltf_member(node, "weights");
        pose_mesh(meshes[posed], json(own.is_null() ? gltf_member(meshes[mesh], "weights") : own),
                  with[0]);
        for (const std::size_t user : with) nodes[user]["mesh"] = posed;
      }
    }
    for (json& node : nodes) node.erase("weights"), node.erase("skin");
    for (json& mesh : meshes) mesh.erase("weights");
    for_each_primitive([](json& primitive) {
      primitive.erase("targets");
      if (!primitive.contains("attributes")) return;
      json& attributes = primitive["attributes"];
      for (auto at = attributes.begin(); at != attributes.end();) {
        const bool of_skin = at.key().starts_with("JOINTS_") || at.key().starts_with("WEIGHTS_");
        at = of_skin ? attributes.erase(at) : std::next(at);
      }
    });
    document_.erase("skins");
    document_.erase("animations");
  }

  void pose_mesh(json& mesh, const json& weights, std::size_t node) {
    const json& skin = gltf_member(array("nodes")[node], "skin");
    const std::vector<GltfMatrix> joints =
        skin.is_null() ? std::vector<GltfMatrix>() : joint_matrices(skin, node);
    if (!mesh.contains("primitives")) return;
    for (json& primitive : mesh["primitives"]) {
      if (!extension(primitive, "KHR_draco_mesh_compression").is_null()) {
        note("skins and morph targets of compressed meshes are left out");
        continue;
      }
      std::map<std::string, std::vector<float>> values;
      for (const auto& [name, index] : gltf_member(primitive, "attributes").items()) {
        if (!is_vertex_data(name)) continue;
        values[name] = values_->floats(gltf_index(index));
        const std::size_t wide = gltf_components(array("accessors")[gltf_index(index)]);
        const bool sound = name == "TANGENT"   ? wide == 4
                           : name == "COLOR_0" ? wide == 3 || wide == 4
                                               : wide == 3 || name.starts_with("TEXCOORD_");
        if (!sound) refuse_gltf("the attribute " + name + " has a wrong type");
      }
      morph(values, primitive, weights);
      if (!joints.empty()) bend(values, primitive, joints);
      for (const auto& [name, all] : values) {
        json& index = primitive["attributes"][name];
        const json accessor = accessor_of(all, array("accessors")[gltf_index(index)]);
        index = array("accessors").size();
        array("accessors").push_back(accessor);
      }
    }
  }

  void morph(std::map<std::string, std::vector<float>>& values,
             const json& primitive,
             const json& weights) {
    const json& targets = gltf_member(primitive, "targets");
    for (std::size_t t = 0; t < targets.size() && t < weights.size(); ++t) {
      const auto weight = weights[t].get<float>();
      if (weight == 0) continue;
      for (const auto& [name, index] : targets[t].items()) {
        const auto found = values.find(name);
        if (found == values.end()) continue;
        const auto accessor = gltf_index(index);
        const std::vector<float> change = values_->floats(accessor);
        const std::size_t wide = gltf_components(array("accessors")[accessor]);
        const json& own = array("accessors")[gltf_index(primitive["attributes"][name])];
        const std::size_t own_wide = gltf_components(own);
        if (wide > own_wide || change.size() / wide != found->second.size() / own_wide)
          refuse_gltf("the " + name + " of a morph target has another length than its mesh");
        for (std::size_t k = 0; k < change.size(); ++k)
          found->second[k / wide * own_wide + k % wide] += weight * change[k];
      }
    }
  }

  void bend(std::map<std::string, std::vector<float>>& values,
            const json& primitive,
            const std::vector<GltfMatrix>& joints) {
    const std::size_t vertices = values["POSITION"].size() / 3;
    std::vector<float> names, weights;  // (vertices, influences)
    std::vector<std::pair<std::vector<float>, std::vector<float>>> sets;
    for (int k = 0;; ++k) {
      const json& attributes = gltf_member(primitive, "attributes");
      const json& of_joints = gltf_member(attributes, ("JOINTS_" + std::to_string(k)).c_str());
      const json& of_weights = gltf_member(attributes, ("WEIGHTS_" + std::to_string(k)).c_str());
      if (of_joints.is_null() || of_weights.is_null()) break;
      sets.emplace_back(values_->floats(gltf_index(of_joints)),
                        values_->floats(gltf_index(of_weights)));
      if (sets.back().first.size() != 4 * vertices || sets.back().second.size() != 4 * vertices)
        refuse_gltf("the joints of a mesh have no four weights each");
    }
    for (std::size_t i = 0; i < 4 * vertices; i += 4) {
      for (const auto& [joint, weight] : sets) {
        names.insert(names.end(), &joint[i], &joint[i] + 4);
        weights.insert(weights.end(), &weight[i], &weight[i] + 4);
      }
    }
    apply_skin(joints, names, weights, values["POSITION"], values["NORMAL"], values["TANGENT"]);
    std::erase_if(values, [](const auto& value) { return value.second.empty(); });
  }

  // Where each joint takes the vertices of a node's mesh, in that node's own frame.
  std::vector<GltfMatrix> joint_matrices(const json& skin_index, std::size_t node) {
    const auto number = gltf_index(skin_index);
    if (number >= array("skins").size()) refuse_gltf("a node names a skin that is not there");
    const json& skin = array("skins")[number];
    const json& joints = skin.at("joints");
    std::vector<float> bound;  // 4x4 each
    if (skin.contains("inverseBindMatrices")) {
      bound = values_->floats(gltf_index(skin["inverseBindMatrices"]));
      if (bound.size() < 16 * joints.size()) refuse_gltf("a skin has fewer matrices than joints");
    }
    const auto node_from_scene = inverse(scene_from(node));
    if (!node_from_scene) {
      note("skins of nodes that are scaled to nothing are left out");
      return {};
    }
    std::vector<GltfMatrix> matrices;
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const auto joint = gltf_index(joints[k]);
      if (joint >= array("nodes").size()) refuse_gltf("a skin names a joint that is not there");
      GltfMatrix m = *node_from_scene * scene_from(joint);
      if (!bound.empty()) {
        GltfMatrix joint_from_mesh;
        std::copy_n(&bound[16 * k], 16, joint_from_mesh.begin());
        m = m * joint_from_mesh;
      }
      matrices.push_back(m);
    }
    return matrices;
  }

  GltfMatrix scene_from(std::size_t node) {
    const json& nodes = array("nodes");
    if (parents_.empty()) {
      parents_.assign(nodes.size(), nodes.size());
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        for (const json& child : gltf_member(nodes[i], "children")) parents_.at(child) = i;
      }
    }
    GltfMatrix m = own_matrix(nodes[node]);
    for (std::size_t above = parents_[node]; above < nodes.size(); above = parents_[above]) {
      m = own_matrix(nodes[above]) * m;
    }
    return m;
  }

  static GltfMatrix own_matrix(const json& node) {
    if (node.contains("matrix")) return node["matrix"].get<GltfMatrix>();
    return gltf_matrix(node.value("translation", std::array<double, 3>{0, 0, 0}),
                       node.value("rotation", std::array<double, 4>{0, 0, 0, 1}),
                       node.value("scale", std::array<double, 3>{1, 1, 1}));
  }

  std::vector<std::byte> write() {
    if (!vertices_.empty())
      array("buffers").push_back({{"byteLength", vertices_.size()}, {"uri", mended_vertices}});
    for (auto at = document_.begin(); at != document_.end();) {
      at = at->is_array() && at->empty() ? document_.erase(at) : std::next(at);
    }
    std::string text = document_.dump();
    std::string file;
    if (binary_) {
      text.resize((text.size() + 3) / 4 * 4, ' ');
      file = "glTF";
      for (const std::size_t word :
           {std::size_t{2}, 20 + text.size() + chunks_.size(), text.size()}) {
        const auto little = static_cast<std::uint32_t>(word);
        file.append(reinterpret_cast<const char*>(&little), 4);
      }
      file += "JSON";
    }
    file += text;
    std::vector<std::byte> bytes(file.size() + chunks_.size());
    std::memcpy(bytes.data(), file.data(), file.size());
    std::copy(chunks_.begin(), chunks_.end(),
              bytes.begin() + static_cast<std::ptrdiff_t>(file.size()));
    return bytes;
  }

  void note(const std::string& text) {
    if (std::find(notes_.begin(), notes_.end(), text) == notes_.end()) notes_.push_back(text);
  }

  bool binary_ = false;
  std::span<const std::byte> chunks_;  // of a .glb, after its JSON
  const ReadGltfFile& read_;
  json document_;
  bool changed_ = false;
  std::optional<GltfValues> values_;
  std::vector<std::size_t> parents_;  // of nodes; at the roots their number
  std::vector<std::byte> vertices_;
  std::vector<MendedMaterial> materials_;
  std::vector<std::string> notes_;
};

}  // namespace

std::optional<MendedGltf> mend_gltf(std::span<const std::byte> file_bytes,
                                    const ReadGltfFile& read) {
  try {
    return Mender(file_bytes, read).mend();
  } catch (const json::exception& error) {
    throw std::runtime_error(std::string("a value has the wrong type: ") + error.what());
  } catch (const std::out_of_range&) {
    throw std::runtime_error("it names a part that is not there");
  }
}

}  // namespace render
