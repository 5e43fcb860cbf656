// File access of a model, confined to the folder that the model lies in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace render {

// The folder of a model's file and how far its references may reach: into the folder and below it.
class ModelFolder {
 public:
  // Throws std::runtime_error if `model_path` is not a file.
  explicit ModelFolder(const std::string& model_path);

  // The file that a model refers to, or nothing if it is not there. Throws std::runtime_error
  // naming model, reference and reason: a URL, an absolute path elsewhere, a path (or a link) that
  // leads out of the folder. Percent-escapes and backslashes are understood.
  std::optional<std::filesystem::path> find(const std::string& reference) const;
  // The same; also throws if the file is not there.
  std::filesystem::path resolve(const std::string& reference) const;

  // All bytes of a file (of a resolved path). Throws std::runtime_error if it cannot be read or is
  // larger than 2 GB.
  std::vector<std::byte> read(const std::filesystem::path& path) const;

  const std::filesystem::path& model() const { return model_; }

 private:
  std::filesystem::path model_;   // as given
  std::filesystem::path folder_;  // canonical
};

}  // namespace render
