// Models from files, through assimp: glTF (also Draco-compressed), OBJ, PLY, STL, FBX, X3D.
#include "render/load_mesh.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>

#include "render/gltf_check.h"
#include "render/model_folder.h"
#include "render/model_material.h"
#include "render/model_mesh.h"

namespace render {
namespace {

constexpr std::size_t max_triangles = std::size_t{64} << 20;
constexpr int max_node_depth = 256;

// A file in memory, for assimp.
class MemoryStream : public Assimp::IOStream {
 public:
  explicit MemoryStream(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
  std::size_t Read(void* target, std::size_t size, std::size_t count) override {
    if (size == 0) return 0;
    count = std::min(count, (bytes_.size() - at_) / size);
    if (count > 0) std::memcpy(target, bytes_.data() + at_, size * count);
    at_ += size * count;
    return count;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const std::size_t base = origin == aiOrigin_SET   ? 0
                             : origin == aiOrigin_CUR ? at_
                                                      : bytes_.size();
    const std::size_t target = origin == aiOrigin_END ? base - offset : base + offset;
    if (target > bytes_.size()) return aiReturn_FAILURE;
    at_ = target;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return at_; }
  std::size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;
};

// What a model asked for in vain.
struct FileComplaints {
  std::string refusal;  // the first reference out of the folder
  std::vector<std::string> missing;
};

// Lets assimp see nothing but the model's own folder.
class ConfinedFiles : public Assimp::IOSystem {
 public:
  ConfinedFiles(const ModelFolder& folder, FileComplaints& complaints)
      : folder_(folder), complaints_(complaints) {}
  bool Exists(const char* file) const override {
    try {
      return folder_.find(relative(file)).has_value();
    } catch (const std::runtime_error& error) {
      if (complaints_.refusal.empty()) complaints_.refusal = error.what();
      return false;
    }
  }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (std::strchr(mode, 'w') != nullptr || std::strchr(mode, 'a') != nullptr) return nullptr;
    try {
      if (const auto path = folder_.find(relative(file)))
        return new MemoryStream(folder_.read(*path));
      complaints_.missing.push_back(relative(file));
      return nullptr;
    } catch (const std::runtime_error& error) {
      if (complaints_.refusal.empty()) complaints_.refusal = error.what();
      return nullptr;
    }
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  // assimp puts the model's folder before the names that it finds in the file.
  std::string relative(const std::string& file) const {
    const std::string prefix = folder_.model().parent_path().string();
    if (prefix.empty() || !file.starts_with(prefix)) return file;
    const std::size_t start = file.find_first_not_of("/\\", prefix.size());
    return start == std::string::npos ? file : file.substr(start);
  }

  const ModelFolder& folder_;
  FileComplaints& complaints_;
};

struct Format {
  bool gltf = false;
  bool smooth_normals = true;  // glTF asks for flat faces where normals are missing
  bool y_up = true;
};

Format format_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (extension == ".gltf" || extension == ".glb") return {.gltf = true, .smooth_normals = false};
  if (extension == ".obj" || extension == ".fbx" || extension == ".x3d") return {};
  if (extension == ".ply" || extension == ".stl") return {.y_up = false};
  throw std::runtime_error(
      path + ": models are read from .gltf, .glb, .obj, .ply, .stl, .fbx and " + ".x3d files");
}

// Metres per unit and the up axis that an FBX file states.
double unit_of(const aiScene& scene, Format& format) {
  double centimetres = 100;
  if (scene.mMetaData == nullptr) return 1;
  std::int32_t up = 1;
  if (scene.mMetaData->Get("UpAxis", up)) format.y_up = up != 2;
  float single = 0;
  if (!scene.mMetaData->Get("UnitScaleFactor", centimetres) &&
      scene.mMetaData->Get("UnitScaleFactor", single))
    centimetres = single;
  return std::isfinite(centimetres) && centimetres > 0 ? centimetres / 100 : 1;
}

// Walks the nodes and gathers what is shown.
class ModelBuilder {
 public:
  ModelBuilder(const aiScene& source, const ModelFolder& folder, const LoadOptions& options)
      : source_(source),
        options_(options),
        materials_(source, folder, model_.report.notes),
        meshes_(source.mNumMeshes, -1),
        material_of_(source.mNumMaterials, -1),
        imported_(source.mNumMaterials) {}

  LoadedModel build(const aiMatrix4x4& set_from_root) {
    std::vector<bool> found(options_.hide.size());
    visit(*source_.mRootNode, set_from_root, false, 0, found);
    for (std::size_t i = 0; i < found.size(); ++i)
      if (!found[i]) refuse_hide(options_.hide[i]);
    LoadReport& report = model_.report;
    if (report.triangles == 0) throw std::runtime_error("it shows no triangles");
    if (left_out_ > 0)
      report.notes.push_back(std::to_string(left_out_) +
                             " triangles with positions that are not finite are left out");
    model_.scene.textures = materials_.decode();
    report.materials = model_.scene.materials.size();
    report.textures = model_.scene.textures.size();
    for (const auto& texture : model_.scene.textures)
      report.texture_bytes += texture->texels.size();
    return std::move(model_);
  }

 private:
  void visit(const aiNode& node,
             const aiMatrix4x4& set_from_parent,
             bool hidden,
             int depth,
             std::vector<bool>& found) {
    if (depth > max_node_depth) throw std::runtime_error("its nodes are nested too deeply");
    const std::string name = node.mName.C_Str();
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (options_.hide[i] != name) continue;
      found[i] = true;
      hidden = true;
    }
    const aiMatrix4x4 set_from_node = set_from_parent * node.mTransformation;
    if (node.mNumMeshes > 0) model_.report.nodes.push_back(name);
    for (unsigned i = 0; i < node.mNumMeshes && !hidden; ++i) {
      if (node.mMeshes[i] >= source_.mNumMeshes)
        throw std::runtime_error("node '" + name + "' names a mesh that is not there");
      place(node.mMeshes[i], name, set_from_node);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      visit(*node.mChildren[i], set_from_node, hidden, depth + 1, found);
  }

  void place(unsigned mesh_index, const std::string& name, const aiMatrix4x4& m) {
    for (unsigned r = 0; r < 4; ++r)
      for (unsigned c = 0; c < 4; ++c)
        if (!std::isfinite(m[r][c]))
          throw std::runtime_error("node '" + name + "' has a transform that is not finite");
    const std::int64_t mesh = mesh_of(mesh_index);
    if (mesh < 0) return;
    Instance instance;
    instance.name = name;
    instance.mesh = static_cast<std::uint32_t>(mesh);
    instance.set_from_object = {m.a1, m.a2, m.a3, m.a4, m.b1, m.b2,
                                m.b3, m.b4, m.c1, m.c2, m.c3, m.c4};
    const Mesh& shown = *model_.scene.meshes[instance.mesh];
    LoadReport& report = model_.report;
    if (report.triangles == 0) {
      constexpr float far = std::numeric_limits<float>::max();
      report.lower = {far, far, far};
      report.upper = {-far, -far, -far};
    }
    report.triangles += shown.triangles.size();
    if (report.triangles > max_triangles) throw std::runtime_error("it has over 64 M triangles");
    for (const auto& triangle : shown.triangles) {
      for (const std::uint32_t corner : triangle) {
        const Vec3f p = shown.positions[corner];
        const aiVector3D q = m * aiVector3D(p.x, p.y, p.z);
        report.lower = {std::min(report.lower.x, q.x), std::min(report.lower.y, q.y),
                        std::min(report.lower.z, q.z)};
        report.upper = {std::max(report.upper.x, q.x), std::max(report.upper.y, q.y),
                        std::max(report.upper.z, q.z)};
      }
    }
    model_.scene.instances.push_back(std::move(instance));
  }

  // The mesh's index in the scene, -1 if it has no triangles.
  std::int64_t mesh_of(unsigned index) {
    if (meshes_[index] >= 0) return meshes_[index];
    const aiMesh& source = *source_.mMeshes[index];
    if ((source.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) return -1;
    const std::uint32_t material = material_for(source.mMaterialIndex);
    if (source.HasVertexColors(0)) add_note("vertex colours are left out");
    if (source.HasBones()) add_note("skins are left out: the model stands in its bind pose");
    Mesh mesh = convert_mesh(source, imported_[source.mMaterialIndex], left_out_);
    if (mesh.triangles.empty()) return -1;
    mesh.materials = {material};
    model_.report.vertices += mesh.positions.size();
    model_.scene.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
    meshes_[index] = static_cast<std::int64_t>(model_.scene.meshes.size()) - 1;
    return meshes_[index];
  }

  std::uint32_t material_for(unsigned index) {
    if (index >= source_.mNumMaterials) throw std::runtime_error("a mesh has no material");
    if (material_of_[index] < 0) {
      const aiMaterial& source = *source_.mMaterials[index];
      imported_[index] = materials_.import(source);
      imported_[index].parameters.emission_gain *= options_.emission_gain;
      aiString name;
      source.Get(AI_MATKEY_NAME, name);
      material_of_[index] = static_cast<std::int64_t>(model_.scene.materials.size());
      const ImportedMaterial& imported = imported_[index];
      model_.scene.materials.push_back(
          imported.glass ? make_glass_material(name.C_Str(), *imported.glass)
                         : make_standard_material(name.C_Str(), imported.parameters));
    }
    return static_cast<std::uint32_t>(material_of_[index]);
  }

  void add_note(const std::string& text) {
    auto& notes = model_.report.notes;
    if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(text);
  }

  [[noreturn]] void refuse_hide(const std::string& name) const {
    std::string list;
    for (const std::string& node : model_.report.nodes) list += (list.empty() ? "" : ", ") + node;
    throw std::invalid_argument("cannot hide '" + name + "': the nodes with a mesh are " + list);
  }

  const aiScene& source_;
  const LoadOptions& options_;
  LoadedModel model_;
  MaterialImport materials_;
  std::vector<std::int64_t> meshes_;
  std::vector<std::int64_t> material_of_;
  std::vector<ImportedMaterial> imported_;
  std::size_t left_out_ = 0;
};

// assimp drops faces that name vertices which are not there: then the file is damaged.
void check_faces(const aiScene& scene, const GltfFacts& facts) {
  std::size_t read = 0;
  for (unsigned i = 0; i < scene.mNumMeshes; ++i)
    if ((scene.mMeshes[i]->mPrimitiveTypes & aiPrimitiveType_TRIANGLE) != 0)
      read += scene.mMeshes[i]->mNumFaces;
  if (read < facts.plain_triangles)
    throw std::runtime_error(std::to_string(facts.plain_triangles - read) + " of its " +
                             std::to_string(facts.plain_triangles) +
                             " triangles name vertices that are not there");
}

}  // namespace

LoadedModel load_model(const std::string& path, const LoadOptions& options) {
  if (!(options.scale > 0) || !std::isfinite(options.scale))
    throw std::invalid_argument(path + ": the scale must be above 0");
  if (!(options.emission_gain >= 0) || !std::isfinite(options.emission_gain))
    throw std::invalid_argument(path + ": the emission gain must not be negative");
  Format format = format_of(path);
  const ModelFolder folder(path);
  GltfFacts facts;
  if (format.gltf) facts = check_gltf(folder.read(path), path);
  FileComplaints complaints;
  Assimp::Importer importer;
  importer.SetIOHandler(new ConfinedFiles(folder, complaints));  // the importer deletes it
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  importer.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, 50.0F);
  unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_ValidateDataStructure;
  if (format.smooth_normals) steps |= aiProcess_GenSmoothNormals | aiProcess_JoinIdenticalVertices;
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFile(path, steps);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  if (!complaints.refusal.empty()) throw std::runtime_error(complaints.refusal);
  if (scene == nullptr) {
    std::string why = importer.GetErrorString();
    for (const std::string& name : complaints.missing) why += "; '" + name + "' is not there";
    throw std::runtime_error(path + ": " + why);
  }
  if (scene->mRootNode == nullptr) throw std::runtime_error(path + ": it has no nodes");

  const double unit = unit_of(*scene, format);
  const bool y_up = options.up == UpAxis::by_format ? format.y_up : options.up == UpAxis::y;
  const auto s = static_cast<float>(options.scale * unit);
  const aiMatrix4x4 set_from_root =
      y_up ? aiMatrix4x4(s, 0, 0, 0, 0, 0, -s, 0, 0, s, 0, 0, 0, 0, 0, 1)
           : aiMatrix4x4(s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, 0, 0, 0, 1);
  try {
    if (format.gltf) check_faces(*scene, facts);
    LoadedModel model = ModelBuilder(*scene, folder, options).build(set_from_root);
    model.report.notes.insert(model.report.notes.end(), facts.notes.begin(), facts.notes.end());
    for (const std::string& name : complaints.missing)
      model.report.notes.push_back("'" + name + "' is not there");
    return model;
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    if (what.starts_with(path)) throw;
    throw std::runtime_error(path + ": " + what);
  }
}

}  // namespace render
