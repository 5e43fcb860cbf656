// Models through assimp. Runs in a confined process of its own: see model_main.cpp.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "render/load_mesh.h"
#include "render/raw_model.h"

namespace render {

// A model's files, handed out by whoever decides what may be read.
class ModelFiles {
 public:
  virtual ~ModelFiles() = default;
  // All bytes of the file that the model names so; nothing if it is not there.
  virtual std::optional<std::vector<std::byte>> read(const std::string& reference) = 0;
  virtual bool exists(const std::string& reference) = 0;
};

// Reads the model `file`, a name without a folder, whose ending tells its format. Throws
// std::runtime_error with the reason if it cannot be read or is damaged, std::invalid_argument if
// `hide` names a node that is not there. Options must be sound (load_model).
RawModel import_model(ModelFiles& files, const std::string& file, const LoadOptions& options);

}  // namespace render
