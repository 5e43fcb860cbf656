// The formats of models.
#include "render/model_format.h"

#include <filesystem>

namespace render {

std::optional<ModelFormat> model_format(const std::string& file) {
  const std::string extension = in_small_letters(std::filesystem::path(file).extension().string());
  if (extension == ".gltf" || extension == ".glb")
    return ModelFormat{.gltf = true, .smooth_normals = false};
  if (extension == ".obj") return ModelFormat{.obj = true};
  if (extension == ".fbx") return ModelFormat{.fbx = true};
  if (extension == ".x3d") return ModelFormat{.x3d = true};
  if (extension == ".ply") return ModelFormat{.ply = true, .y_up = false};
  if (extension == ".stl") return ModelFormat{.stl = true, .y_up = false};
  return std::nullopt;
}

}  // namespace render
