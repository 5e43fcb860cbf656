// A TOML file as values that know where they stand.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace studio {

// Where something stands in a file: both count from 1; 0 = the file as a whole.
struct Place {
  int line = 0;
  int column = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

struct TomlEntry;

struct TomlValue {
  enum class Kind { boolean, integer, number, text, date, array, table };

  Kind kind = Kind::table;
  Place place;
  bool boolean = false;
  std::int64_t integer = 0;
  double number = 0;  // of integers too
  std::string text;
  std::vector<TomlValue> items;    // of an array
  std::vector<TomlEntry> entries;  // of a table, in the file's order
};

struct TomlEntry {
  std::string key;
  Place place;  // of the key
  TomlValue value;
};

// "a whole number", "a table": for messages.
std::string_view name_of(TomlValue::Kind kind);

class TomlError : public std::runtime_error {
 public:
  TomlError(Place place, const std::string& reason) : std::runtime_error(reason), place_(place) {}
  Place place() const { return place_; }

 private:
  Place place_;
};

// The root table of a file. Throws TomlError at the first fault of syntax (toml++ stops there), or,
// without a place, if the file cannot be read or is larger than 16 MB.
TomlValue read_toml(const std::string& path);

}  // namespace studio
