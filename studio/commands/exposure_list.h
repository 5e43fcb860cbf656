// Exposure times as command lines state them.
#pragma once

#include <string_view>
#include <vector>

namespace studio {

// "1/80,0.5,13": seconds of each shot; 0 = a dark one. Empty gives none. Throws UsageError, which
// names --exposures and the word, for what is no time of 0 s or more.
std::vector<double> exposures_in(std::string_view list);

}  // namespace studio
