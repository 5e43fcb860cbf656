// When files were last written, to tell what must be read anew.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <system_error>
#include <vector>

namespace studio {

using FileTimes = std::vector<std::filesystem::file_time_type>;

// Of these paths; of what is no file, the earliest time there is.
inline FileTimes file_times(std::initializer_list<std::string> paths) {
  FileTimes times;
  for (const std::string& path : paths) {
    std::error_code none;
    const auto time = std::filesystem::last_write_time(path, none);
    times.push_back(none ? std::filesystem::file_time_type::min() : time);
  }
  return times;
}

}  // namespace studio
