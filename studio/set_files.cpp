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

#include "compositing/output_file.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

struct SetFile {
  std::string what, path;
};

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

// A file, a folder of a recording, or that of a sequence of EXR frames; a camera has none.
std::string path_of(std::string_view uri) {
  for (const std::string_view scheme : {"file:", "replay:"}) {
    if (!uri.starts_with(scheme)) continue;
    const fs::path path = uri.substr(scheme.size());
    const bool sequence = path.filename().string().find('%') != std::string::npos;
    return sequence && path.extension() == ".exr" ? path.parent_path().string() : path.string();
  }
  return {};
}

std::vector<SetFile> files_of(const Set& set) {
  std::vector<SetFile> files{{"set file", set.path},
                             {"plate", path_of(set.camera.source)},
                             {"camera's response", set.camera.response},
                             {"camera's track", set.camera.pose.track}};
  if (set.probe) {
    files.push_back({"probe", path_of(set.probe->source)});
    files.push_back({"probe's response", set.probe->response});
    for (const std::string& shot : set.probe->shots) files.push_back({"probe's shot", shot});
  }
  for (const VideoSettings& video : set.videos) {
    files.push_back({fmt::format("video {}", video.name), path_of(video.source)});
  }
  for (const PersonSettings& person : set.persons) {
    for (const PersonCamera& camera : person.cameras) {
      files.push_back({fmt::format("video of {}", person.name), path_of(camera.source)});
      if (!camera.key) continue;
      const KeyChoice& key = *camera.key;
      for (const std::string& picture : {key.plate, key.masks.garbage, key.masks.core}) {
        files.push_back({fmt::format("screen of {}", person.name), picture});
      }
    }
  }
  for (const ObjectSettings& object : set.objects) {
    files.push_back({fmt::format("model of {}", object.name), object.mesh});
    if (!object.shapes) continue;
    for (const std::string& shape : object.shapes->files) {
      files.push_back({fmt::format("model of {}", object.name), shape});
    }
  }
  std::erase_if(files, [](const SetFile& file) { return file.path.empty(); });
  return files;
}

}  // namespace

void spare_sources(const Set& set, const std::string& written) {
  if (written.empty()) return;
  for (const SetFile& file : files_of(set)) {
    if (!compositing::is_one_file(file.path, written) && !is_of_sequence(file.path, written)) {
      continue;
    }
    throw std::invalid_argument(fmt::format(
        "{} is the set's {}, and would be lost: write to another place", written, file.what));
  }
  for (const ObjectSettings& object : set.objects) {
    if (object.mesh.empty() || !is_named_by(object.mesh, written)) continue;
    throw std::invalid_argument(
        fmt::format("{} is a part of the set's model of {}, and would be lost: write to another "
                    "place",
                    written, object.name));
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
}

}  // namespace studio
