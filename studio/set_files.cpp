// What a set is made from, against what is written while it is shown.
#include "studio/set_files.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "compositing/exr_sequence.h"
#include "compositing/output_file.h"

namespace studio {
namespace {

constexpr const char* set_file = "the set file";

namespace fs = std::filesystem;

// Whether a path is that of one of a sequence's pictures, there or not: "plate_%04d.png".
bool is_of_sequence(const std::string& pattern, const std::string& path) {
  const fs::path of(pattern), is(path);
  const std::string name = of.filename().string(), one = is.filename().string();
  const std::size_t begin = name.find('%'), end = name.find('d', begin);
  if (begin == std::string::npos || end == std::string::npos) return false;
  const std::string before = name.substr(0, begin), after = name.substr(end + 1);
  if (one.size() <= before.size() + after.size()) return false;
  if (!one.starts_with(before) || !one.ends_with(after)) return false;
  const std::string_view number =
      std::string_view(one).substr(before.size(), one.size() - before.size() - after.size());
  return number.find_first_not_of("0123456789") == std::string_view::npos &&
         compositing::is_one_file(of.parent_path().string(), is.parent_path().string());
}

// Whether a file is there that a model's own text, or that of its materials, names: a texture or
// buffer.
bool is_named_by(const std::string& model, const std::string& path) {
  constexpr std::uintmax_t largest_text = 64 << 20;
  const fs::path file(path), folder = fs::path(model).parent_path();
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return false;
  const fs::path within =
      fs::weakly_canonical(file, error)
          .lexically_relative(fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, error));
  if (within.empty() || *within.begin() == "..") return false;
  const auto names_it = [&](const fs::path& text) {
    if (fs::file_size(text, error) > largest_text || error) return false;
    std::ifstream in(text, std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(in), {}};
    return content.find(file.filename().string()) != std::string::npos;
  };
  if (names_it(model)) return true;
  for (const auto& beside : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    if (beside.path().extension() == ".mtl" && names_it(beside.path())) return true;
  }
  return false;
}

std::string name_or(const std::string& name, const char* kind) {
  return name.empty() ? kind : name;
}

// All but what a model names itself.
std::vector<ReadFile> read_by(const Set& set) {
  std::vector<ReadFile> files{{set_file, set.path}};
  const auto add = [&](std::string_view uri, const std::string& what) {
    for (ReadFile& file : files_of(uri, what)) files.push_back(std::move(file));
  };
  add(set.camera.source, "the set's plate");
  if (set.probe) {
    add(set.probe->source, "the set's probe");
    for (const std::string& shot : set.probe->shots) files.push_back({"the probe's shot", shot});
  }
  for (const VideoSettings& video : set.videos) {
    add(video.source, fmt::format("the set's video {}", video.name));
  }
  for (const PersonSettings& person : set.persons) {
    for (const PersonCamera& camera : person.cameras) {
      add(camera.source, "the set's video of " + name_or(person.name, "a person"));
    }
  }
  for (const ObjectSettings& object : set.objects) {
    const std::string what = "the set's model of " + name_or(object.name, "an object");
    files.push_back({what, object.mesh});
    if (!object.shapes) continue;
    for (const std::string& shape : object.shapes->files) files.push_back({what, shape});
  }
  for (const NamedFile& file : set.files) {
    files.push_back({fmt::format("the set's {}", file.key), file.path});
  }
  std::erase_if(files, [](const ReadFile& file) { return file.path.empty(); });
  return files;
}

// A set's file, by its name and tables.
bool is_set(const std::string& path) {
  if (std::filesystem::path(path).extension() != ".toml") return false;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("[show]") || line.starts_with("[camera]")) return true;
  }
  return false;
}

}  // namespace

std::vector<ReadFile> files_of(std::string_view uri, const std::string& what) {
  for (const std::string_view scheme : {"file:", "replay:"}) {
    if (!uri.starts_with(scheme)) continue;
    const fs::path path = uri.substr(scheme.size());
    const bool sequence = path.filename().string().find('%') != std::string::npos;
    std::vector<ReadFile> files{{what, path.string()}};
    if (sequence && path.extension() == ".exr") {
      const fs::path folder = path.parent_path();
      files.push_back({what, folder.empty() ? "." : folder.string()});
    }
    return files;
  }
  return {};
}

void spare_files(std::span<const ReadFile> files, const std::string& written) {
  if (is_set(written)) {
    throw std::runtime_error(written + ": is a set, and would be lost: write to another file");
  }
  if (written.empty()) return;
  for (const ReadFile& file : files) {
    if (!compositing::is_one_file(file.path, written) && !is_of_sequence(file.path, written)) {
      continue;
    }
    throw std::invalid_argument(
        fmt::format("{} is {}, and would be lost: write to another place", written, file.what));
  }
}

void spare_from_frames(std::span<const ReadFile> files, const std::string& folder) {
  if (folder.empty()) return;
  const std::string frames = compositing::ExrSequence::pattern_in(folder);
  for (const ReadFile& file : files) {
    if (!is_of_sequence(frames, file.path)) continue;
    throw std::invalid_argument(
        fmt::format("{} is {}, and would be lost to a frame of its name: write to another folder",
                    file.path, file.what));
  }
}

void spare_set_file(const std::string& path, const std::string& written) {
  const ReadFile file{set_file, path};
  spare_files(std::span(&file, 1), written);
}

void spare_sources(const Set& set, const std::string& written) {
  if (written.empty()) return;
  spare_files(read_by(set), written);
  for (const ObjectSettings& object : set.objects) {
    if (object.mesh.empty() || !is_named_by(object.mesh, written)) continue;
    throw std::invalid_argument(
        fmt::format("{} is a part of the set's model of {}, and would be lost: write to another "
                    "place",
                    written, name_or(object.name, "an object")));
  }
}

void spare_take(const RecordSettings& record, const std::string& written) {
  if (written.empty()) return;
  for (const std::string& file : {record.file, record.fill, record.key}) {
    if (file.empty() || !compositing::is_one_file(file, written)) continue;
    throw std::invalid_argument(fmt::format(
        "{} is what is recorded to, and would be lost: write to another place", written));
  }
}

void spare_sources(const Set& set, const RecordSettings& record) {
  for (const std::string* written : {&record.file, &record.exr, &record.fill, &record.key}) {
    spare_sources(set, *written);
  }
  spare_from_frames(read_by(set), record.exr);
}

}  // namespace studio
