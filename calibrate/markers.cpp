// Surveyed points of the set, and the pixels in which they are seen.
#include "calibrate/markers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

#include <toml++/toml.h>

#include "calibrate/text_file.h"

namespace calibrate {
namespace {

// Positions and pixels beyond this are mistakes.
constexpr double farthest = 1e6;

[[noreturn]] void fail(const std::string& path,
                       const toml::source_region& at,
                       const std::string& why) {
  throw std::runtime_error(path + ":" + std::to_string(at.begin.line) + ":" +
                           std::to_string(at.begin.column) + ": " + why);
}

std::string quoted(std::string_view key) { return "\"" + std::string(key) + "\""; }

void refuse_unknown(const std::string& path,
                    const toml::table& table,
                    std::initializer_list<std::string_view> known) {
  for (const auto& [key, node] : table) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    std::string names;
    for (const std::string_view name : known) {
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
    fail(path, key.source(), "unknown key " + quoted(key.str()) + "; there are " + names);
  }
}

const toml::node& required(const std::string& path,
                           const toml::table& marker,
                           std::string_view key) {
  const toml::node* node = marker.get(key);
  if (node == nullptr) {
    fail(path, marker.source(), "this marker has no " + quoted(key));
  }
  return *node;
}

std::string text_of(const std::string& path, const toml::node& node, std::string_view key) {
  const auto text = node.value_exact<std::string>();
  if (!text || text->empty()) {
    fail(path, node.source(), quoted(key) + " must be a text that is not empty");
  }
  return *text;
}

template <std::size_t count>
std::array<double, count> numbers_of(const std::string& path,
                                     const toml::node& node,
                                     std::string_view key) {
  const toml::array* list = node.as_array();
  if (list == nullptr || list->size() != count) {
    fail(path, node.source(),
         quoted(key) + " must be a list of " + std::to_string(count) + " numbers");
  }
  std::array<double, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) {
    const toml::node& element = *list->get(i);
    const auto number = element.is_number() ? element.value<double>() : std::nullopt;
    if (!number || !(std::abs(*number) <= farthest)) {
      fail(path, element.source(), quoted(key) + " must hold numbers of at most 1e6");
    }
    numbers[i] = *number;
  }
  return numbers;
}

Marker marker_of(const std::string& path, const toml::table& table) {
  refuse_unknown(path, table, {"name", "position", "pixel", "picture"});
  Marker marker;
  marker.name = text_of(path, required(path, table, "name"), "name");
  const auto p = numbers_of<3>(path, required(path, table, "position"), "position");
  marker.p_set = {p[0], p[1], p[2]};
  const auto q = numbers_of<2>(path, required(path, table, "pixel"), "pixel");
  marker.q = {q[0], q[1]};
  if (const toml::node* picture = table.get("picture")) {
    marker.picture = text_of(path, *picture, "picture");
  }
  return marker;
}

std::string named(const std::string& picture) {
  return picture.empty() ? "no picture's name" : "picture " + quoted(picture);
}

}  // namespace

std::vector<Marker> read_markers(const std::string& path) {
  toml::table root;
  try {
    root = toml::parse(read_text_file(path));
  } catch (const toml::parse_error& error) {
    fail(path, error.source(), std::string(error.description()));
  }
  refuse_unknown(path, root, {"marker"});
  const toml::node* node = root.get("marker");
  const toml::array* tables = node == nullptr ? nullptr : node->as_array();
  if (tables == nullptr || tables->empty()) {
    throw std::runtime_error(path + ": has no [[marker]] with name, position and pixel");
  }
  std::vector<Marker> markers;
  for (const toml::node& entry : *tables) {
    const toml::table* table = entry.as_table();
    if (table == nullptr) fail(path, entry.source(), "a marker must be a table: [[marker]]");
    const Marker marker = marker_of(path, *table);
    for (const Marker& other : markers) {
      if (other.name != marker.name) continue;
      if (other.picture == marker.picture) {
        fail(path, table->source(),
             "marker " + quoted(marker.name) + " is here for the second " + "time with " +
                 named(marker.picture));
      }
      if (other.p_set != marker.p_set) {
        fail(path, table->source(),
             "marker " + quoted(marker.name) + " has another " + "position than with " +
                 named(other.picture));
      }
    }
    markers.push_back(marker);
  }
  return markers;
}

std::vector<Marker> markers_in(std::span<const Marker> markers, const std::string& picture) {
  std::vector<Marker> chosen;
  std::vector<std::string> pictures;
  for (const Marker& marker : markers) {
    if (picture.empty() || marker.picture == picture) chosen.push_back(marker);
    if (std::ranges::find(pictures, marker.picture) == pictures.end()) {
      pictures.push_back(marker.picture);
    }
  }
  if (!chosen.empty() && (!picture.empty() || pictures.size() == 1)) return chosen;
  std::string names;
  for (const std::string& name : pictures) names += (names.empty() ? "" : ", ") + named(name);
  throw std::runtime_error(picture.empty()
                               ? "the markers are of several pictures (" + names + "): choose one"
                               : "no marker is of " + named(picture) + "; there are " + names);
}

std::vector<Marker> markers_of(const Board& board,
                               const BoardView& view,
                               const Pose& set_from_board) {
  check(board);
  if (view.corners.size() != board.corner_count()) {
    throw std::invalid_argument("a view has as many corners as its board");
  }
  std::vector<Marker> markers;
  const auto columns = static_cast<std::size_t>(board.columns);
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    if (!view.corners[i]) continue;
    markers.push_back({std::to_string(i / columns) + "," + std::to_string(i % columns),
                       set_from_board * corner_of(board, i), *view.corners[i], view.name});
  }
  return markers;
}

std::vector<Sight> sights_of(const Lens& lens, std::span<const Marker> markers) {
  std::vector<Sight> sights;
  for (const Marker& marker : markers) {
    const auto sight = sight_of(lens, marker.q, marker.p_set);
    if (!sight) {
      throw std::runtime_error("marker " + quoted(marker.name) + ": the lens sees nothing at [" +
                               to_text(marker.q.x) + ", " + to_text(marker.q.y) +
                               "]; check the pixel, that the lens is this camera's, and that its " +
                               "boards reached so far out");
    }
    sights.push_back(*sight);
  }
  return sights;
}

}  // namespace calibrate
