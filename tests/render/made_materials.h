// Models of one textured triangle, and what tests read of their materials.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "render/load_mesh.h"
#include "render/standard.h"
#include "tests/made_files.h"

namespace render {

namespace fs = std::filesystem;

// A folder with pictures a.png, b.png and so on.
inline fs::path made_folder(const std::string& pictures = "") {
  fs::path folder = made::make_temporary_directory();
  for (const char name : pictures) {
    fs::copy_file(made::bad_files().parent_path() / "one_texel.png",
                  folder / (std::string(1, name) + ".png"));
  }
  return folder;
}

inline std::string write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
  return path.string();
}

inline StandardParameters parameters_of(const LoadedModel& model, std::size_t material = 0) {
  return standard_parameters(model.scene.materials.at(material), model.scene.textures.size());
}

inline const std::string textured_triangle =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";

inline LoadedModel load_obj(const std::string& library) {
  const fs::path folder = made_folder("ab");
  write(folder / "a.mtl", library);
  return load_model(write(folder / "a.obj", "mtllib a.mtl\n" + textured_triangle));
}

inline auto notes_of(const LoadedModel& model) { return model.report.notes; }

}  // namespace render
