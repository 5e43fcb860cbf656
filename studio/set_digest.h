// Tells whether a set file is still what something was measured of.
#pragma once

#include <string>

namespace studio {

// 16 hexadecimal digits of what a set file says: the same whatever its comments, spaces and order
// of keys, and whatever [effort] has for the settings that a chart varies (settings_of). What the
// files that it names hold is no part of it. Throws TomlError as read_toml.
std::string set_digest(const std::string& set_path);

}  // namespace studio
