// What a set is made from, against what is written while it is shown.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "studio/set.h"

namespace studio {

// A file, folder, or sequence of pictures that is read, and what it is: "the clip".
struct ReadFile {
  std::string what, path;
};

// What a camera's URI reads: of a sequence of EXR pictures its folder too, for takes are such
// folders; of a device nothing.
std::vector<ReadFile> files_of(std::string_view uri, const std::string& what);

// Throws std::invalid_argument with path and what it is if a file or folder that is to be written
// is one of these.
void spare_files(std::span<const ReadFile> files, const std::string& written);

// The same if one of these is among the EXR frames that a take, or a key, would write to a folder.
void spare_from_frames(std::span<const ReadFile> files, const std::string& folder);

// As spare_files, of a set that was not read yet, or cannot be: of its own file.
void spare_set_file(const std::string& path, const std::string& written);
// The same of all that a set reads: its own file, what its keys name, models' textures and
// materials.
void spare_sources(const Set& set, const std::string& written);
// Throws std::invalid_argument if a file that is to be written would replace one of a recording.
void spare_take(const RecordSettings& record, const std::string& written);
// As the first one, of all files of a recording.
void spare_sources(const Set& set, const RecordSettings& record);

}  // namespace studio
