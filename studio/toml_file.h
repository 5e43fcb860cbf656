// Files that operators write, whose faults of syntax are told as a set's are.
#pragma once

#include <string>

#include "studio/section.h"
#include "studio/set.h"
#include "studio/toml.h"

namespace studio {

// Throws SetError if it cannot be read, or is no TOML.
inline TomlValue read_toml_file(const std::string& path) {
  try {
    return read_toml(path);
  } catch (const TomlError& error) {
    Faults faults(path);
    faults.add(error.place(), error.what());
    throw SetError(faults.sorted());
  }
}

}  // namespace studio
