// What a set is made from, against what is written while it is shown.
#pragma once

#include <string>

#include "studio/set.h"

namespace studio {

// Throws std::invalid_argument with the path, and with what the set takes from there, if a file or
// folder that is to be written would replace any of it.
void spare_sources(const Set& set, const std::string& written);
// Throws std::invalid_argument if a file that is to be written would replace one of a recording.
void spare_take(const RecordSettings& record, const std::string& written);
// The same as spare_sources of all files of a recording.
void spare_sources(const Set& set, const RecordSettings& record);

}  // namespace studio
