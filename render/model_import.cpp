// Models through assimp.
#include "render/model_import.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "render/gltf_check.h"
#include "render/gltf_mend.h"
#include "render/join_vertices.h"
#include "render/model_check.h"
#include "render/model_format.h"
#include "render/model_material.h"
#include "render/model_mesh.h"
#include "render/mtl_mend.h"
#include "render/x3d_mend.h"

namespace render {
namespace {

constexpr int max_depth = 256;
// Metres from the origin: farther out, floats and Embree overflow.
constexpr float farthest = 1e9F;
constexpr float grey_paint = 0.6F;  // of what tells no colour; so does assimp for OBJ
bool is_near(float x) { return std::abs(x) <= farthest; }  // nor what is no number

// A file in memory, for assimp.
class MemoryStream : public Assimp::IOStream {
 public:
  explicit MemoryStream(std::vector<std::byte> bytes) : kept_(std::move(bytes)), bytes_(kept_) {}
  // The bytes must outlive it.
  explicit MemoryStream(std::span<const std::byte> bytes) : bytes_(bytes) {}
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
  std::vector<std::byte> kept_;
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

// Lets assimp see nothing but what it is given.
class GivenFiles : public Assimp::IOSystem {
 public:
  // `mended` stands for the file of that name, where it is; `missing` and `libraries` receive what
  // is not there and what material libraries say.
  GivenFiles(ModelFiles& files,
             const std::string& name,
             const std::optional<MendedGltf>& mended,
             const ModelFormat& format,
             std::vector<std::string>& missing,
             MtlFacts& libraries)
      : files_(files),
        name_(name),
        mended_(mended),
        format_(format),
        missing_(missing),
        libraries_(libraries) {}
  bool Exists(const char* file) const override { return files_.exists(file); }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (std::strchr(mode, 'w') != nullptr || std::strchr(mode, 'a') != nullptr) return nullptr;
    const std::string_view name(file);
    if (mended_ && name == name_) return new MemoryStream(std::span(mended_->file));
    if (mended_ && name.ends_with(mended_vertices))
      return new MemoryStream(std::span(mended_->vertices));
    const bool library = format_.obj && name.ends_with(".mtl");
    auto bytes = files_.read(file);
    if (!bytes && library) bytes = read_each(file);
    if (bytes) return new MemoryStream(in_plainer_words(std::move(*bytes), library));
    miss(file);
    return nullptr;
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::vector<std::byte> in_plainer_words(std::vector<std::byte> bytes, bool library) {
    constexpr std::array byte_order_mark{std::byte{0xEF}, std::byte{0xBB}, std::byte{0xBF}};
    const bool marked = bytes.size() >= byte_order_mark.size() &&
                        std::equal(byte_order_mark.begin(), byte_order_mark.end(), bytes.begin());
    if (marked && (format_.obj || format_.gltf)) {
      bytes.erase(bytes.begin(), bytes.begin() + byte_order_mark.size());
    }
    if (format_.x3d) return mend_x3d(bytes);
    if (library) return mend_mtl(bytes, libraries_);
    std::optional<std::vector<std::byte>> mended;
    if (format_.ply) mended = mend_ply(bytes);
    if (format_.stl) mended = mend_stl(bytes);
    return mended ? std::move(*mended) : std::move(bytes);
  }
  // Of a line that names several libraries, all that are there, one after the other. assimp takes
  // it for one name.
  std::optional<std::vector<std::byte>> read_each(const std::string& line) {
    std::istringstream names(line);
    std::vector<std::string> lost;
    std::optional<std::vector<std::byte>> all;
    for (std::string name; names >> name;) {
      const auto bytes = files_.read(name);
      if (!bytes) {
        lost.push_back(name);
        continue;
      }
      if (!all) all.emplace();
      all->insert(all->end(), bytes->begin(), bytes->end());
      all->push_back(std::byte{'\n'});
    }
    if (all) {
      for (const std::string& name : lost) miss(name);
    }
    return all;
  }
  void miss(const std::string& name) {
    if (std::ranges::find(missing_, name) == missing_.end()) missing_.push_back(name);
  }

  ModelFiles& files_;
  const std::string& name_;
  const std::optional<MendedGltf>& mended_;
  ModelFormat format_;
  std::vector<std::string>& missing_;
  MtlFacts& libraries_;
};

// What assimp drops of material libraries, put where it keeps it of other files.
void apply_libraries(const aiScene& scene, const MtlFacts& libraries) {
  const auto type_of = [](const std::string& keyword) {
    return keyword == "map_kd"                        ? aiTextureType_DIFFUSE
           : keyword == "map_ke"                      ? aiTextureType_EMISSIVE
           : keyword == "map_d"                       ? aiTextureType_OPACITY
           : keyword == "norm" || keyword == "map_kn" ? aiTextureType_NORMALS
                                                      : aiTextureType_NONE;
  };
  // A colour that is not stated does not take a map's.
  const auto whiten = [](aiMaterial& material, const char* key, unsigned type, unsigned slot) {
    const aiColor3D white(1, 1, 1);
    material.AddProperty(&white, 1, key, type, slot);
  };
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
    aiString name;
    if (scene.mMaterials[i]->Get(AI_MATKEY_NAME, name) != aiReturn_SUCCESS) continue;
    const auto only_map = [&](const std::string& colour) {
      return libraries.states(name.C_Str(), "map_" + colour) &&
             !libraries.states(name.C_Str(), colour);
    };
    if (only_map("kd")) whiten(*scene.mMaterials[i], AI_MATKEY_COLOR_DIFFUSE);
    if (only_map("ke")) whiten(*scene.mMaterials[i], AI_MATKEY_COLOR_EMISSIVE);
    for (const MtlMap& map : libraries.maps) {
      const aiTextureType type = type_of(map.keyword);
      if (map.material != name.C_Str() || type == aiTextureType_NONE) continue;
      aiUVTransform transform;
      transform.mScaling = {map.scale[0], map.scale[1]};
      transform.mTranslation = {map.offset[0], map.offset[1]};
      const int mode = map.clamps ? aiTextureMapMode_Clamp : aiTextureMapMode_Wrap;
      scene.mMaterials[i]->AddProperty(&transform, 1, AI_MATKEY_UVTRANSFORM(type, 0));
      scene.mMaterials[i]->AddProperty(&mode, 1, AI_MATKEY_MAPPINGMODE_U(type, 0));
      scene.mMaterials[i]->AddProperty(&mode, 1, AI_MATKEY_MAPPINGMODE_V(type, 0));
    }
  }
}

// What assimp drops of a glTF file's materials, and their names.
void apply_materials(const aiScene& scene, std::span<const MendedMaterial> materials) {
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
    aiMaterial& material = *scene.mMaterials[i];
    aiString name;
    if (material.Get(AI_MATKEY_NAME, name) != aiReturn_SUCCESS) continue;
    const auto found = std::ranges::find(materials, name.C_Str(), &MendedMaterial::mended);
    if (found == materials.end()) continue;
    const aiString own(found->name);
    material.AddProperty(&own, AI_MATKEY_NAME);
    material.AddProperty(&found->dispersion, 1, dispersion_key, 0, 0);
  }
}

// Notes of what an OBJ file's libraries say and do not say of the materials that it shows.
void note_libraries(const MtlFacts& libraries, RawModel& model) {
  std::vector<std::string>& notes = model.report.notes;
  notes.insert(notes.end(), libraries.notes.begin(), libraries.notes.end());
  for (const RawMaterial& material : model.materials) {
    if (material.name != AI_DEFAULT_MATERIAL_NAME && !libraries.stated.contains(material.name))
      notes.push_back("material '" + material.name +
                      "' is in none of its libraries: a grey paint stands in its place");
  }
}

// Metres per unit that an FBX file states.
double unit_of(const aiScene& scene) {
  double centimetres = 100;
  if (scene.mMetaData == nullptr) return 1;
  float single = 0;
  if (!scene.mMetaData->Get("UnitScaleFactor", centimetres) &&
      scene.mMetaData->Get("UnitScaleFactor", single))
    centimetres = single;
  return std::isfinite(centimetres) && centimetres > 0 ? centimetres / 100 : 1;
}

using Axes = std::array<std::array<int, 3>, 3>;  // of the set, x, y and z, in those of the file

constexpr Axes from_y_up{{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}};
constexpr Axes from_z_up{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

int determinant_of(const Axes& rows) {
  int sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    sum += rows[0][k] * (rows[1][(k + 1) % 3] * rows[2][(k + 2) % 3] -
                         rows[1][(k + 2) % 3] * rows[2][(k + 1) % 3]);
  }
  return sum;
}

// The axes that an FBX file states: its right, front and up are the set's x, -y and z. Where they
// are no right-handed three, only the one that is up counts.
Axes stated_axes(const aiScene& scene, const Axes& otherwise) {
  const auto stated = [&](const char* key, std::int32_t fallback) {
    std::int32_t value = fallback;
    return scene.mMetaData != nullptr && scene.mMetaData->Get(key, value) ? value : fallback;
  };
  const std::int32_t up = stated("UpAxis", -1), front = stated("FrontAxis", -1),
                     right = stated("CoordAxis", -1);
  if (up < 0 || up > 2) return otherwise;
  const int up_sign = stated("UpAxisSign", 1) < 0 ? -1 : 1;
  const auto of = [](std::int32_t axis, int sign) {
    std::array<int, 3> row{};
    if (axis >= 0 && axis < 3) row[static_cast<std::size_t>(axis)] = sign;
    return row;
  };
  const Axes all{of(right, stated("CoordAxisSign", 1) < 0 ? -1 : 1),
                 of(front, stated("FrontAxisSign", 1) < 0 ? 1 : -1), of(up, up_sign)};
  if (determinant_of(all) == 1) return all;
  Axes axes = up == 1 ? from_y_up : up == 2 ? from_z_up : Axes{of(1, 1), of(2, 1), of(0, 1)};
  if (up_sign < 0) {  // turned over about the set's x
    for (const std::size_t row : {1U, 2U}) {
      for (int& x : axes[row]) x = -x;
    }
  }
  return axes;
}

// Walks the nodes and gathers what is shown.
class ModelBuilder {
 public:
  // `painted`: the file tells colours of its materials. `takes_colours`: those of vertices count.
  ModelBuilder(const aiScene& source,
               const LoadOptions& options,
               const ModelFormat& format,
               bool painted,
               bool takes_colours)
      : source_(source),
        options_(options),
        format_(format),
        painted_(painted),
        takes_colours_(takes_colours),
        materials_(source, format, model_.report.notes),
        meshes_(source.mNumMeshes, -1),
        material_of_(source.mNumMaterials, -1),
        white_material_of_(source.mNumMaterials, -1),
        imported_(source.mNumMaterials),
        corner_normals_(source.mNumMeshes) {}

  RawModel build(const aiMatrix4x4& set_from_root) {
    std::vector<bool> found(options_.hide.size());
    visit(*source_.mRootNode, set_from_root, false, 0, found);
    for (std::size_t i = 0; i < found.size(); ++i)
      if (!found[i]) refuse_hide(options_.hide[i]);
    LoadReport& report = model_.report;
    if (source_.mNumAnimations > 0) add_note("animations are left out");
    if (left_out_ > 0) {
      const std::string count = std::to_string(left_out_);
      const char* what =
          " triangles with positions that are not finite, or farther away than a "
          "million kilometres";
      if (options_.whole) throw std::runtime_error("it has " + count + what);
      report.notes.push_back(count + what + ", are left out");
    }
    if (report.triangles == 0) throw std::runtime_error("it shows no triangles");
    model_.textures = materials_.take_textures();
    report.materials = model_.materials.size();
    return std::move(model_);
  }

 private:
  void visit(const aiNode& node,
             const aiMatrix4x4& set_from_parent,
             bool hidden,
             int depth,
             std::vector<bool>& found) {
    if (depth > max_depth) throw std::runtime_error("its nodes are nested too deeply");
    const std::string name = node.mName.C_Str();
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (options_.hide[i] != name) continue;
      found[i] = true;
      hidden = true;
    }
    bool shows = true;
    if (format_.fbx && node.mMetaData != nullptr && node.mMetaData->Get("Show", shows) && !shows)
      add_note("node '" + name + "': the file hides it, but it is shown");
    const aiMatrix4x4 set_from_node = set_from_parent * node.mTransformation;
    if (has_triangles(node)) model_.report.nodes.push_back(name);
    if (format_.smooth_normals && node.mNumMeshes > 1 && !hidden) smooth_across(node);
    for (unsigned i = 0; i < node.mNumMeshes && !hidden; ++i) {
      if (node.mMeshes[i] >= source_.mNumMeshes)
        throw std::runtime_error("node '" + name + "' names a mesh that is not there");
      place(node.mMeshes[i], name, set_from_node);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      visit(*node.mChildren[i], set_from_node, hidden, depth + 1, found);
  }

  // The meshes of a node are one surface in several materials: so are the normals that they lack.
  void smooth_across(const aiNode& node) {
    std::vector<unsigned> indices;
    std::vector<Mesh> meshes;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const unsigned index = node.mMeshes[i];
      if (index >= source_.mNumMeshes || meshes_[index] >= 0) continue;
      const aiMesh& source = *source_.mMeshes[index];
      if (source.HasNormals() || (source.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) continue;
      std::size_t left_out = 0;  // counted when it is converted
      indices.push_back(index);
      meshes.push_back(convert_shape(source, left_out));
    }
    if (meshes.size() < 2) return;
    std::vector<std::vector<Vec3f>> normals = normals_across(meshes);
    for (std::size_t i = 0; i < indices.size(); ++i)
      corner_normals_[indices[i]] = std::move(normals[i]);
  }

  bool has_triangles(const aiNode& node) const {
    return std::any_of(node.mMeshes, node.mMeshes + node.mNumMeshes, [&](unsigned mesh) {
      return mesh < source_.mNumMeshes &&
             (source_.mMeshes[mesh]->mPrimitiveTypes & aiPrimitiveType_TRIANGLE) != 0;
    });
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
    const Mesh& shown = model_.meshes[instance.mesh];
    LoadReport& report = model_.report;
    if (report.triangles == 0) {
      constexpr float far = std::numeric_limits<float>::max();
      report.lower = {far, far, far};
      report.upper = {-far, -far, -far};
    }
    report.triangles += shown.triangles.size();
    if (report.triangles > max_model_triangles)
      throw std::runtime_error("it has over 64 M triangles");
    for (const auto& triangle : shown.triangles) {
      for (const std::uint32_t corner : triangle) {
        const Vec3f p = shown.positions[corner];
        const aiVector3D q = m * aiVector3D(p.x, p.y, p.z);
        if (!is_near(q.x) || !is_near(q.y) || !is_near(q.z))
          throw std::runtime_error("node '" + name +
                                   "' lies farther away than a million kilometres");
        report.lower = {std::min(report.lower.x, q.x), std::min(report.lower.y, q.y),
                        std::min(report.lower.z, q.z)};
        report.upper = {std::max(report.upper.x, q.x), std::max(report.upper.y, q.y),
                        std::max(report.upper.z, q.z)};
      }
    }
    model_.instances.push_back(std::move(instance));
  }

  // The mesh's index in the scene, -1 if it has no triangles.
  std::int64_t mesh_of(unsigned index) {
    if (meshes_[index] >= 0) return meshes_[index];
    const aiMesh& source = *source_.mMeshes[index];
    if ((source.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) {
      add_note("points and lines are left out");
      return -1;
    }
    const bool coloured = takes_colours_ && source.HasVertexColors(0);
    if (!takes_colours_) add_note("vertex colours are left out: not all of its vertices have one");
    const std::uint32_t material = material_for(source.mMaterialIndex, coloured);
    const ImportedMaterial& imported = imported_[source.mMaterialIndex];
    if (source.HasBones()) add_note("skins are left out: parts stand as the file stores them");
    if (source.mNumAnimMeshes > 0) add_note("morph targets are left out");
    Mesh mesh = convert_mesh(source, imported, format_, coloured && shows_colours(source, imported),
                             corner_normals_[index], left_out_);
    corner_normals_[index] = {};
    if (mesh.triangles.empty()) return -1;
    mesh.materials = {material};
    model_.report.vertices += mesh.positions.size();
    model_.meshes.push_back(std::move(mesh));
    meshes_[index] = static_cast<std::int64_t>(model_.meshes.size()) - 1;
    return meshes_[index];
  }

  // Notes what of a mesh's colours is not shown.
  bool shows_colours(const aiMesh& source, const ImportedMaterial& material) {
    const StandardParameters& p = material.parameters;
    if (material.glass) add_note("vertex colours of solid glass are left out");
    // A picture takes the place of X3D's.
    if (material.glass || (format_.x3d && p.base_color_texture >= 0)) return false;
    const ColourRange range = colour_range(source);
    if (range.least_alpha < 1 && range.most_alpha > 0 && (p.alpha_blend != 0 || p.alpha_cutoff > 0))
      add_note("alpha of vertex colours is left out");
    if (!(range.brightest > 0)) add_note("vertex colours that are all black are left out");
    return range.brightest > 0;
  }

  // Vertex colours take the place of the grey of what has no material, and of X3D's colours of
  // materials; they tint all others.
  std::uint32_t material_for(unsigned index, bool coloured) {
    if (index >= source_.mNumMaterials) throw std::runtime_error("a mesh has no material");
    const aiMaterial& source = *source_.mMaterials[index];
    aiString name;
    source.Get(AI_MATKEY_NAME, name);
    const bool bare = !painted_ || format_.x3d || name == aiString(AI_DEFAULT_MATERIAL_NAME);
    const bool white = coloured && bare;
    std::int64_t& known = (white ? white_material_of_ : material_of_)[index];
    if (known < 0) {
      imported_[index] = materials_.import(source);
      StandardParameters& parameters = imported_[index].parameters;
      parameters.emission_gain *= options_.emission_gain;
      if (white || !painted_) std::fill_n(parameters.base_color, 3, white ? 1 : grey_paint);
      known = static_cast<std::int64_t>(model_.materials.size());
      model_.materials.push_back({name.C_Str(), parameters, imported_[index].glass});
    }
    return static_cast<std::uint32_t>(known);
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
  const ModelFormat& format_;
  bool painted_, takes_colours_;
  RawModel model_;
  MaterialImport materials_;
  std::vector<std::int64_t> meshes_;
  std::vector<std::int64_t> material_of_, white_material_of_;
  std::vector<ImportedMaterial> imported_;
  std::vector<std::vector<Vec3f>> corner_normals_;  // by mesh; empty where they are its own
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

void check_ending(std::span<const std::byte> bytes, const std::string& file) {
  const bool binary = bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
  const bool named_binary = file.ends_with('b') || file.ends_with('B');
  if (binary && !named_binary) throw std::runtime_error("it is binary glTF: let it end in .glb");
  if (!binary && named_binary) {
    throw std::runtime_error("it is no binary glTF; where it is glTF as text, let it end in .gltf");
  }
}

// What can be told before assimp sees the file. It never ends on a PLY file that ends too soon.
GltfFacts check_first(std::span<const std::byte> bytes,
                      const ModelFormat& format,
                      const std::string& file) {
  if (bytes.empty()) throw std::runtime_error("the file is empty");
  if (format.gltf) check_ending(bytes, file);
  if (format.gltf) return check_gltf(bytes);
  GltfFacts facts;
  if (format.ply) facts.notes = check_ply(bytes);
  if (format.stl) check_stl(bytes);
  if (format.x3d) facts.notes = left_out_of_x3d(bytes);
  if (format.fbx && hides_by_visibility(bytes))
    facts.notes.emplace_back("what the file hides by its Visibility is shown");
  if (format.fbx && fbx_clamps(bytes))
    facts.notes.emplace_back("textures that it clamps at their edges repeat");
  return facts;
}

// What assimp caught: sizes that no memory holds are the file's fault.
void translate(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::length_error&) {
    throw std::runtime_error("it is damaged: it claims more elements than there can be");
  } catch (const std::exception&) {  // told by its text
  }
}

}  // namespace

RawModel import_model(ModelFiles& files, const std::string& file, const LoadOptions& options) {
  const ModelFormat format = model_format(file).value();
  std::optional<MendedGltf> mended;
  bool painted = true, colours_some = false;
  const GltfFacts facts = [&] {
    const std::vector<std::byte> bytes = files.read(file).value_or(std::vector<std::byte>{});
    const GltfFacts checked = check_first(bytes, format, file);
    colours_some = format.obj && obj_colours_some(bytes);
    painted = (!format.ply || ply_has_paint(bytes)) && (!format.stl || stl_has_paint(bytes));
    if (format.gltf)
      mended = mend_gltf(bytes, [&](const std::string& name) { return files.read(name); });
    return checked;
  }();
  std::vector<std::string> missing;
  MtlFacts libraries;
  Assimp::Importer importer;
  importer.SetIOHandler(
      new GivenFiles(files, file, mended, format, missing, libraries));  // the importer deletes it
  const aiScene* scene = importer.ReadFile(
      file, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_ValidateDataStructure);
  if (scene == nullptr) {
    if (const std::exception_ptr error = importer.GetException()) translate(error);
    std::string why = importer.GetErrorString();
    if (why.find("mNumMeshes is 0") != std::string::npos) why = "it holds no meshes";
    if (why.find("contains no faces") != std::string::npos) why = "it has vertices without faces";
    for (const std::string& name : missing) why += "; '" + name + "' is not there";
    throw std::runtime_error(why);
  }
  if (scene->mRootNode == nullptr) throw std::runtime_error("it has no nodes");

  const Axes axes = options.up == UpAxis::y ? from_y_up
                    : options.up == UpAxis::z
                        ? from_z_up
                        : stated_axes(*scene, format.y_up ? from_y_up : from_z_up);
  aiMatrix4x4 set_from_root;
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 3; ++c)
      set_from_root[r][c] = static_cast<float>(options.scale * unit_of(*scene) * axes[r][c]);
  }
  if (format.gltf) check_faces(*scene, facts);
  apply_libraries(*scene, libraries);
  if (mended) apply_materials(*scene, mended->materials);
  RawModel model =
      ModelBuilder(*scene, options, format, painted, !colours_some).build(set_from_root);
  auto& notes = model.report.notes;
  std::vector<std::string> more = facts.notes;
  if (mended) more.insert(more.end(), mended->notes.begin(), mended->notes.end());
  for (std::string& note : more) {
    if (std::find(notes.begin(), notes.end(), note) == notes.end())
      notes.push_back(std::move(note));
  }
  if (format.obj) note_libraries(libraries, model);
  for (const std::string& name : missing)
    model.report.notes.push_back("'" + name + "' is not there");
  return model;
}

}  // namespace render
