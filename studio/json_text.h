// Figures as text for files.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace studio {

// Indented. Names of files and devices may hold any bytes: what is no UTF-8 becomes U+FFFD.
inline std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace studio
