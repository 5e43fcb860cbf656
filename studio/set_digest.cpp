// What a set file says, in a few digits.
#include "studio/set_digest.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "studio/effort_points.h"
#include "studio/toml.h"

namespace studio {
namespace {

// Each value with where it stands: "show.width 640".
void tell_values(const TomlValue& value, const std::string& where, std::vector<std::string>& told) {
  switch (value.kind) {
    case TomlValue::Kind::table:
      for (const TomlEntry& entry : value.entries) {
        tell_values(entry.value, where.empty() ? entry.key : where + "." + entry.key, told);
      }
      break;
    case TomlValue::Kind::array:
      told.push_back(fmt::format("{} holds {}", where, value.items.size()));
      for (std::size_t i = 0; i < value.items.size(); ++i) {
        tell_values(value.items[i], fmt::format("{}[{}]", where, i), told);
      }
      break;
    case TomlValue::Kind::boolean:
      told.push_back(fmt::format("{} {}", where, value.boolean));
      break;
    case TomlValue::Kind::integer:
    case TomlValue::Kind::number:
      told.push_back(fmt::format("{} {:.17g}", where, value.number));
      break;
    case TomlValue::Kind::text:
      told.push_back(fmt::format("{} \"{}\"", where, value.text));
      break;
    case TomlValue::Kind::date:
      told.push_back(where);
      break;
  }
}

// FNV-1a, 64 bits.
std::uint64_t hash_of(const std::vector<std::string>& lines) {
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&](char c) { hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3; };
  for (const std::string& line : lines) {
    std::ranges::for_each(line, add);
    add('\n');
  }
  return hash;
}

}  // namespace

std::string set_digest(const std::string& set_path) {
  std::vector<std::string> told;
  tell_values(read_toml(set_path), "", told);
  // When a plate was taken does not matter.
  std::erase_if(told, [](const std::string& line) {
    return line.substr(0, line.find(' ')).ends_with(".key.take");
  });
  for (const auto& [name, value] : settings_of({})) {
    std::erase_if(told, [start = "effort." + name + " "](const std::string& line) {
      return line.starts_with(start);
    });
  }
  std::ranges::sort(told);
  return fmt::format("{:016x}", hash_of(told));
}

}  // namespace studio
