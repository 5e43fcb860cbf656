// What benchmarks of several rows end with.
#pragma once

#include <nlohmann/json.hpp>

#include "studio/console.h"

namespace studio {

// The rows, and the machine that they were measured on, as figures.
void give_rows(const nlohmann::ordered_json& rows, Console& console);

}  // namespace studio
