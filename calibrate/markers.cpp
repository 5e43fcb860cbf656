// Surveyed points of the set, and the pixels in which they are seen.
#include "calibrate/markers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

#include <toml++/toml.h>

#include "calibrate/text_file.h"
#include "capture/toml_reader.h"

namespace calibrate {
namespace {

using capture::in_quotes, capture::TomlReader;

Marker marker_of(const TomlReader& reader, const toml::table& table) {
  reader.refuse_unknown(table, {"name", "position", "pixel", "picture"});
  Marker marker;
  marker.name = reader.text(reader.required(table, "name"), "name");
  const auto p = reader.numbers<3>(reader.required(table, "position"), "position");
  marker.p_set = {p[0], p[1], p[2]};
  const toml::node& pixel = reader.required(table, "pixel");
  const auto q = reader.numbers<2>(pixel, "pixel");
  marker.q = {q[0], q[1]};
  marker.line = static_cast<int>(pixel.source().begin.line);
  if (const toml::node* picture = table.get("picture")) {
    marker.picture = reader.text(*picture, "picture");
  }
  return marker;
}

// Where pixels are counted from the corner of the first, the last one ends at the picture's size.
bool is_in_picture(const Lens& lens, Vec2 q) {
  return q.x >= -1 && q.y >= -1 && q.x <= lens.width && q.y <= lens.height;
}

[[noreturn]] void fail_at(const Marker& marker, const std::string& why) {
  throw std::runtime_error("marker " + in_quotes(marker.name) +
                           (marker.line > 0 ? " of line " + std::to_string(marker.line) : "") +
                           ": " + why);
}

std::string named(const std::string& picture) {
  return picture.empty() ? "no picture" : "picture " + in_quotes(picture);
}

}  // namespace

std::vector<Marker> read_markers(const std::string& path) {
  const TomlReader reader(path, "marker");
  const toml::table root = reader.parse();
  reader.refuse_unknown(root, {"marker"});
  const toml::node* node = root.get("marker");
  const toml::array* tables = node == nullptr ? nullptr : node->as_array();
  if (tables == nullptr || tables->empty()) {
    throw std::runtime_error(path + ": has no [[marker]] with name, position and pixel");
  }
  std::vector<Marker> markers;
  for (const toml::node& entry : *tables) {
    const toml::table* table = entry.as_table();
    if (table == nullptr) reader.fail(entry.source(), "a marker must be a table: [[marker]]");
    const Marker marker = marker_of(reader, *table);
    for (const Marker& other : markers) {
      if (other.name != marker.name) continue;
      if (other.picture == marker.picture) {
        reader.fail(table->source(), "marker " + in_quotes(marker.name) +
                                         " is here for the second " + "time with " +
                                         named(marker.picture));
      }
      if (other.p_set != marker.p_set) {
        reader.fail(table->source(), "marker " + in_quotes(marker.name) + " has another " +
                                         "position than with " + named(other.picture));
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
                               : "no marker is of " + named(picture) + "; they are of " + names);
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
    const std::string pixel = "[" + to_text(marker.q.x) + ", " + to_text(marker.q.y) + "]";
    if (!sight) {
      fail_at(marker, "the lens sees nothing at " + pixel +
                          "; check the pixel, that the lens is this camera's, and that its boards "
                          "reached so far out");
    }
    if (!is_in_picture(lens, marker.q)) {
      fail_at(marker, pixel + " lies outside of the lens's picture, " + std::to_string(lens.width) +
                          "x" + std::to_string(lens.height) +
                          "; check the pixel, and that the lens is for pictures of this size");
    }
    sights.push_back(*sight);
  }
  return sights;
}

}  // namespace calibrate
