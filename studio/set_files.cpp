// What a set is made from, against what is written while it is shown.
#include "studio/set_files.h"

#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "compositing/output_file.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

struct SetFile {
  std::string what, path;
};

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
      if (camera.key)
        files.push_back({fmt::format("screen of {}", person.name), camera.key->plate});
    }
  }
  for (const ObjectSettings& object : set.objects) {
    files.push_back({fmt::format("model of {}", object.name), object.mesh});
  }
  std::erase_if(files, [](const SetFile& file) { return file.path.empty(); });
  return files;
}

}  // namespace

void spare_sources(const Set& set, const std::string& written) {
  if (written.empty()) return;
  for (const SetFile& file : files_of(set)) {
    if (!compositing::is_one_file(file.path, written)) continue;
    throw std::invalid_argument(fmt::format(
        "{} is the set's {}, and would be lost: write to another place", written, file.what));
  }
}

void spare_sources(const Set& set, const RecordSettings& record) {
  for (const std::string* written : {&record.file, &record.exr, &record.fill, &record.key}) {
    spare_sources(set, *written);
  }
}

}  // namespace studio
