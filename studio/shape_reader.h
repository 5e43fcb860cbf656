// Reads the shapes of a model that deforms ahead of the show.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "render/load_shape.h"

namespace studio {

// A file's shape: a mesh for each part, or why there is none.
struct ReadShape {
  std::vector<std::shared_ptr<const render::Mesh>> meshes;
  std::string why_not;  // "" = good
};

// Meshes that take the shape of a part of the model: more than one where videos cover some.
struct ShapedMesh {
  std::size_t part = 0;
  std::shared_ptr<const render::Mesh> mesh;  // in the first shape
};

// Reads on a thread of its own. What is read and not yet shown is at most `most_bytes` (or
// two shapes) and `most_ahead` shapes, besides the one that is being read; where all of them fit
// into that memory and the show comes back to them, all stay.
class ShapeReader {
 public:
  static constexpr std::size_t most_bytes = std::size_t{256} << 20;
  static constexpr std::size_t most_ahead = 8;

  // `files`: at least one, the first of which is never read, for `meshes` have its shape. `parts`:
  // of the model, in its order. `again`: the show will come back to files.
  ShapeReader(std::vector<std::string> files,
              render::LoadOptions options,
              std::vector<render::DeformingPart> parts,
              std::vector<ShapedMesh> meshes,
              bool again);
  // Gives up the file that is being read.
  ~ShapeReader() = default;
  ShapeReader(const ShapeReader&) = delete;
  ShapeReader& operator=(const ShapeReader&) = delete;

  // The files that are shown next, in their order. What was read of others is let go.
  void want(std::vector<std::size_t> files);
  // The shape of a file, or nothing if it has not been read.
  std::shared_ptr<const ReadShape> find(std::size_t file) const;
  // The same; waits for it. It must be the first that is wanted.
  std::shared_ptr<const ReadShape> wait_for(std::size_t file);

  const std::vector<std::string>& files() const { return files_; }
  // How many files are read ahead.
  std::size_t ahead() const { return ahead_; }

 private:
  std::shared_ptr<const ReadShape> read(std::size_t file, const std::stop_token& stop) const;
  void run(const std::stop_token& stop);

  std::vector<std::string> files_;
  render::LoadOptions options_;
  std::vector<render::DeformingPart> parts_;
  std::vector<ShapedMesh> meshes_;
  std::size_t ahead_ = 2;
  bool keeps_all_ = false;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<std::size_t> wanted_;
  std::map<std::size_t, std::shared_ptr<const ReadShape>> shapes_;  // by file
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace studio
