// TOML through toml++.
#include "studio/toml.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include <toml++/toml.h>

namespace studio {
namespace {

constexpr std::uintmax_t largest_file_bytes = 16 << 20;

Place place_of(const toml::source_region& region) {
  return {static_cast<int>(region.begin.line), static_cast<int>(region.begin.column)};
}

TomlValue convert(const toml::node& node) {
  using Kind = TomlValue::Kind;
  TomlValue value;
  value.place = place_of(node.source());
  if (const auto* table = node.as_table()) {
    value.kind = Kind::table;
    for (const auto& [key, item] : *table) {
      value.entries.push_back({std::string(key.str()), place_of(key.source()), convert(item)});
    }
    std::ranges::stable_sort(value.entries, [](const TomlEntry& a, const TomlEntry& b) {
      return std::pair(a.place.line, a.place.column) < std::pair(b.place.line, b.place.column);
    });
  } else if (const auto* array = node.as_array()) {
    value.kind = Kind::array;
    for (const auto& item : *array) value.items.push_back(convert(item));
  } else if (const auto* text = node.as_string()) {
    value.kind = Kind::text;
    value.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    value.kind = Kind::integer;
    value.integer = integer->get();
    value.number = static_cast<double>(value.integer);
  } else if (const auto* number = node.as_floating_point()) {
    value.kind = Kind::number;
    value.number = number->get();
  } else if (const auto* boolean = node.as_boolean()) {
    value.kind = Kind::boolean;
    value.boolean = boolean->get();
  } else {
    value.kind = Kind::date;
  }
  return value;
}

}  // namespace

std::string_view name_of(TomlValue::Kind kind) {
  switch (kind) {
    case TomlValue::Kind::boolean:
      return "true or false";
    case TomlValue::Kind::integer:
      return "a whole number";
    case TomlValue::Kind::number:
      return "a number";
    case TomlValue::Kind::text:
      return "a string";
    case TomlValue::Kind::date:
      return "a date or time";
    case TomlValue::Kind::array:
      return "a list";
    case TomlValue::Kind::table:
      return "a table";
  }
  return "something else";
}

TomlValue read_toml(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw TomlError({}, error ? error.message() : std::string("not a file"));
  }
  if (std::filesystem::file_size(path, error) > largest_file_bytes || error) {
    throw TomlError({}, "larger than 16 MB: not a file of settings");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw TomlError({}, "cannot be opened: check its permissions");
  const std::string content{std::istreambuf_iterator<char>(file), {}};
  try {
    return convert(toml::parse(content, path));
  } catch (const toml::parse_error& fault) {
    throw TomlError(place_of(fault.source()), std::string(fault.description()));
  }
}

}  // namespace studio
