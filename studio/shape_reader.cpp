// Shapes, read ahead.
#include "studio/shape_reader.h"

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

namespace studio {

ShapeReader::ShapeReader(std::vector<std::string> files,
                         render::LoadOptions options,
                         std::vector<render::DeformingPart> parts,
                         std::vector<ShapedMesh> meshes,
                         bool again)
    : files_(std::move(files)),
      options_(std::move(options)),
      parts_(std::move(parts)),
      meshes_(std::move(meshes)) {
  std::size_t bytes = 1;
  auto first = std::make_shared<ReadShape>();
  for (const ShapedMesh& shaped : meshes_) {
    bytes += render::bytes_of(*shaped.mesh);
    first->meshes.push_back(shaped.mesh);
  }
  shapes_[0] = std::move(first);
  ahead_ = std::clamp<std::size_t>(most_bytes / bytes, 2, most_ahead);
  keeps_all_ = again && files_.size() <= most_bytes / bytes;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void ShapeReader::want(std::vector<std::size_t> files) {
  const std::lock_guard lock(mutex_);
  wanted_ = std::move(files);
  if (!keeps_all_) {
    std::erase_if(shapes_, [&](const auto& shape) {
      return shape.first != 0 && std::ranges::find(wanted_, shape.first) == wanted_.end();
    });
  }
  changed_.notify_all();
}

std::shared_ptr<const ReadShape> ShapeReader::find(std::size_t file) const {
  const std::lock_guard lock(mutex_);
  const auto found = shapes_.find(file);
  return found == shapes_.end() ? nullptr : found->second;
}

std::shared_ptr<const ReadShape> ShapeReader::wait_for(std::size_t file) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return shapes_.contains(file); });
  return shapes_.at(file);
}

std::shared_ptr<const ReadShape> ShapeReader::read(std::size_t file,
                                                   const std::stop_token& stop) const {
  auto result = std::make_shared<ReadShape>();
  try {
    const auto shapes = render::load_shape(files_[file], options_, parts_, stop);
    for (const ShapedMesh& shaped : meshes_) {
      result->meshes.push_back(render::in_shape(*shaped.mesh, shapes[shaped.part]));
    }
  } catch (const std::bad_alloc&) {
    result->why_not = files_[file] + ": not enough memory for it";
  } catch (const std::exception& error) {
    result->why_not = error.what();
  }
  return result;
}

void ShapeReader::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (true) {
    std::size_t file = 0;
    const bool go_on = changed_.wait(lock, stop, [&] {
      const auto next = std::ranges::find_if(
          wanted_, [&](std::size_t wanted) { return !shapes_.contains(wanted); });
      if (next == wanted_.end()) return false;
      file = *next;
      return true;
    });
    if (!go_on || stop.stop_requested()) return;
    lock.unlock();
    auto shape = read(file, stop);
    lock.lock();
    shapes_[file] = std::move(shape);
    changed_.notify_all();
  }
}

}  // namespace studio
