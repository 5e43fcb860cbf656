// The formats of models, told apart by a file's ending.
#pragma once

#include <optional>
#include <string>

namespace render {

struct ModelFormat {
  bool gltf = false, ply = false, stl = false, x3d = false, obj = false, fbx = false;
  bool smooth_normals = true;  // glTF asks for flat faces where normals are missing
  bool y_up = true;
};

// The format of a file of that name, big letters or small; nothing if it is none that is read.
std::optional<ModelFormat> model_format(const std::string& file);

}  // namespace render
