// Materials and textures of an imported model.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/glass.h"
#include "render/mesh.h"
#include "render/model_folder.h"
#include "render/standard.h"

struct aiMaterial;
struct aiScene;

namespace render {

// How a material wants its mesh's texture coordinates: u' = scale u + offset, v down.
struct UvTransform {
  std::array<float, 2> scale{1, 1};
  std::array<float, 2> offset{0, 0};
  unsigned channel = 0;
  friend bool operator==(const UvTransform&, const UvTransform&) = default;
};

struct ImportedMaterial {
  StandardParameters parameters;
  std::optional<GlassParameters> glass;  // a volume that light passes: this, in place of those
  UvTransform uv;
};

// Collects the textures that materials ask for, and decodes them in one go.
class MaterialImport {
 public:
  // All must outlive this. `notes` receives what is not understood.
  MaterialImport(const aiScene& scene, const ModelFolder& folder, std::vector<std::string>& notes)
      : scene_(scene), folder_(folder), notes_(notes) {}

  // Throws std::runtime_error if the material refers to a texture outside the model's folder.
  ImportedMaterial import(const aiMaterial& material);

  // Every texture asked for so far, in the order of their indices, decoded in parallel. Throws
  // std::runtime_error naming the file and reason.
  std::vector<std::shared_ptr<const Texture>> decode() const;

 private:
  struct Source {
    std::string name;  // path, or "*n" for the n-th embedded one
    bool srgb = false;
    friend auto operator<=>(const Source&, const Source&) = default;
  };
  std::int32_t texture(const aiMaterial& material,
                       unsigned type,
                       unsigned slot,
                       bool srgb,
                       ImportedMaterial& result,
                       bool& uv_known);
  void note_unhandled(const aiMaterial& material, const std::string& name);
  void note(const std::string& text);
  Texture decode(const Source& source) const;

  const aiScene& scene_;
  const ModelFolder& folder_;
  std::vector<std::string>& notes_;
  std::map<Source, std::int32_t> indices_;
  std::vector<Source> sources_;
};

}  // namespace render
