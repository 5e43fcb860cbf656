// The formats of models, told apart by a file's ending.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace render {

// Of ASCII; whatever else it is stays.
inline char small_letter(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}
inline std::string in_small_letters(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = small_letter(c);
  return text;
}

struct ModelFormat {
  bool gltf = false, ply = false, stl = false, x3d = false, obj = false, fbx = false;
  bool smooth_normals = true;  // glTF asks for flat faces where normals are missing
  bool y_up = true;
};

// The format of a file of that name, big letters or small; nothing if it is none that is read.
std::optional<ModelFormat> model_format(const std::string& file);

}  // namespace render
