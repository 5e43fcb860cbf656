// Materials and textures of an imported model.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/glass.h"
#include "render/model_format.h"
#include "render/raw_model.h"
#include "render/standard.h"

struct aiMaterial;
struct aiScene;
struct aiTexture;

namespace render {

// Where an aiMaterial keeps KHR_materials_dispersion (gltf_mend.h), type and slot 0.
inline constexpr const char* dispersion_key = "$mat.dispersion";

struct ImportedMaterial {
  StandardParameters parameters;
  std::optional<GlassParameters> glass;  // a volume that light passes: this, in place of those
  unsigned uv_set = 0;  // of the file's sets of coordinates: that which its mesh has first
  std::optional<unsigned> second_uv_set;
};

// Takes materials, and collects the textures that they ask for.
class MaterialImport {
 public:
  // Scene and notes must outlive this. `notes` receives what is not understood.
  MaterialImport(const aiScene& scene, const ModelFormat& format, std::vector<std::string>& notes)
      : scene_(scene), format_(format), notes_(notes) {}

  ImportedMaterial import(const aiMaterial& material);

  // Every texture asked for so far, in the order of their indices.
  std::vector<RawTexture> take_textures();

 private:
  // What textures are shared by.
  struct TextureKey {
    std::string name;
    bool srgb = false;
    std::array<Wrap, 2> wrap{};
    friend auto operator<=>(const TextureKey&, const TextureKey&) = default;
  };

  // `uv`: where the material looks it up.
  std::int32_t texture(
      const aiMaterial& material, unsigned type, unsigned slot, bool srgb, UvTransform& uv);
  // Notes what of a texture's place is not taken.
  UvTransform transform_of(const aiMaterial& material, unsigned type, unsigned slot);
  Wrap wrap_of(const aiMaterial& material, const char* key, unsigned type, unsigned slot) const;
  int embedded_index(const std::string& path) const;
  void take_base(const aiMaterial& material, StandardParameters& p);
  void take_specular_glossiness(const aiMaterial& material,
                                const std::string& name,
                                StandardParameters& p);
  void take_mirror(const aiMaterial& material, const std::string& name, StandardParameters& p);
  void take_volume(const aiMaterial& material, const std::string& name, ImportedMaterial& result);
  void note_unhandled(const aiMaterial& material, const std::string& name);
  void note(const std::string& text);

  const aiScene& scene_;
  ModelFormat format_;
  std::vector<std::string>& notes_;
  std::vector<std::pair<unsigned, unsigned>> taken_;  // types and slots of the material's maps
  std::optional<unsigned> uv_set_, second_uv_set_;    // of the material's textures
  std::map<TextureKey, std::int32_t> indices_;
  std::vector<RawTexture> textures_;
  std::vector<const aiTexture*> embedded_;  // of each, or null
};

}  // namespace render
