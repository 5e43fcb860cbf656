// Reading our TOML files, with complaints that name the place. For the .cpp files of readers only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "capture/files.h"

namespace capture {

inline std::string in_quotes(std::string_view text) { return "\"" + std::string(text) + "\""; }

// One file. Every fault is a std::runtime_error with path, line and column.
class TomlReader {
 public:
  // `what` a table of it is: "marker". Both must outlive the reader.
  TomlReader(const std::string& path, std::string_view what) : path_(path), what_(what) {}

  const std::string& path() const { return path_; }

  // Of a file that is no larger.
  toml::table parse(std::size_t most_bytes = std::size_t{64} << 20) const {
    const std::vector<std::byte> bytes = read_file(path_, most_bytes);
    return parse_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  // Of a text that path() stands for in complaints.
  toml::table parse_text(std::string_view text) const {
    try {
      return toml::parse(text);
    } catch (const toml::parse_error& error) {
      fail(error.source(), std::string(error.description()));
    }
  }

  [[noreturn]] void fail(const toml::source_region& at, const std::string& why) const {
    throw std::runtime_error(path_ + ":" + std::to_string(at.begin.line) + ":" +
                             std::to_string(at.begin.column) + ": " + why);
  }

  void refuse_unknown(const toml::table& table,
                      std::initializer_list<std::string_view> known) const {
    for (const auto& [key, node] : table) {
      if (std::ranges::find(known, key.str()) != known.end()) continue;
      std::string names;
      for (const std::string_view name : known) {
        names += (names.empty() ? "" : ", ") + std::string(name);
      }
      fail(key.source(), "unknown key " + in_quotes(key.str()) + "; there are " + names);
    }
  }

  const toml::node& required(const toml::table& table, std::string_view key) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      fail(table.source(), "this " + std::string(what_) + " has no " + in_quotes(key));
    }
    return *node;
  }

  std::string text(const toml::node& node, std::string_view key) const {
    const auto value = node.value_exact<std::string>();
    if (!value || value->empty()) {
      fail(node.source(), in_quotes(key) + " must be a text that is not empty");
    }
    return *value;
  }

  // Numbers beyond this are mistakes, unless `any`, if finite, will do.
  static constexpr double farthest = 1e6;

  double number(const toml::node& node, std::string_view key, bool any = false) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value) || (!any && std::abs(*value) > farthest)) {
      fail(node.source(), in_quotes(key) + (any ? " must be finite numbers"
                                                : " must hold numbers of at most 1e6"));
    }
    return *value;
  }

  template <std::size_t count>
  std::array<double, count> numbers(const toml::node& node,
                                    std::string_view key,
                                    bool any = false) const {
    const toml::array* list = node.as_array();
    if (list == nullptr || list->size() != count) {
      fail(node.source(),
           in_quotes(key) + " must be a list of " + std::to_string(count) + " numbers");
    }
    std::array<double, count> result{};
    for (std::size_t i = 0; i < count; ++i) result[i] = number(*list->get(i), key, any);
    return result;
  }

 private:
  const std::string& path_;
  std::string_view what_;
};

}  // namespace capture
