// Straight lines of the scene, and the pixels in which they are seen.
#include "calibrate/line_marks.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <stdexcept>

#include <toml++/toml.h>

#include "calibrate/angles.h"
#include "capture/toml_reader.h"

namespace calibrate {
namespace {

using capture::in_quotes, capture::TomlReader;

constexpr std::size_t most_lines = 1000;
constexpr std::size_t most_pixels = 10000;  // of a line

class MarksReader : public TomlReader {
 public:
  explicit MarksReader(const std::string& path) : TomlReader(path, "table") {}

  int size(const toml::table& root, std::string_view key) const {
    const toml::node& node = required(root, key);
    const auto whole = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
    if (!whole || *whole < 1 || *whole > 65536) {
      fail(node.source(), in_quotes(key) + " must be a whole number from 1 to 65536");
    }
    return static_cast<int>(*whole);
  }

  Vec2 pixel(const toml::node& node, std::string_view key) const {
    const auto q = numbers<2>(node, key);
    return {q[0], q[1]};
  }

  MarkedLine line(const toml::table& table) const {
    refuse_unknown(table, {"name", "parallel", "pixels"});
    MarkedLine line;
    line.name = text(required(table, "name"), "name");
    if (const toml::node* parallel = table.get("parallel")) {
      line.parallel = text(*parallel, "parallel");
    }
    const toml::node& node = required(table, "pixels");
    const toml::array* list = node.as_array();
    if (list == nullptr || list->size() < 3 || list->size() > most_pixels) {
      fail(node.source(), "\"pixels\" must be a list of three or more [x, y]");
    }
    for (const toml::node& element : *list) line.pixels.push_back(pixel(element, "pixels"));
    return line;
  }

  MarkedRectangle rectangle(const toml::table& table, const std::vector<MarkedLine>& lines) const {
    refuse_unknown(table, {"name", "lines", "across"});
    MarkedRectangle rectangle;
    rectangle.name = text(required(table, "name"), "name");
    const toml::node& node = required(table, "lines");
    const toml::array* list = node.as_array();
    if (list == nullptr || list->size() != rectangle.sides.size()) {
      fail(node.source(), "\"lines\" must be the names of four lines, one after the other around");
    }
    for (std::size_t i = 0; i < rectangle.sides.size(); ++i) {
      const std::string name = text(*list->get(i), "lines");
      const auto found = std::ranges::find(lines, name, &MarkedLine::name);
      if (found == lines.end()) {
        fail(list->get(i)->source(), "there is no line " + in_quotes(name));
      }
      rectangle.sides[i] = static_cast<std::size_t>(found - lines.begin());
    }
    if (const toml::node* across = table.get("across")) {
      rectangle.across = text(*across, "across");
      if (std::ranges::find(lines, rectangle.across, &MarkedLine::parallel) == lines.end()) {
        fail(across->source(), "no line is \"parallel\" to " + in_quotes(rectangle.across));
      }
    }
    return rectangle;
  }

  // The tables of a list; none if the key is missing.
  std::vector<const toml::table*> tables(const toml::table& root, std::string_view key) const {
    std::vector<const toml::table*> result;
    const toml::node* node = root.get(key);
    if (node == nullptr) return result;
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() > most_lines) {
      fail(node->source(), "write [[" + std::string(key) + "]], at most a thousand times");
    }
    for (const toml::node& entry : *list) {
      if (entry.as_table() == nullptr) {
        fail(entry.source(), "must be a table: [[" + std::string(key) + "]]");
      }
      result.push_back(entry.as_table());
    }
    return result;
  }
};

bool is_short(const MarkedLine& line) {
  constexpr double least_px = 5;
  const auto farther = [&](Vec2 q) {
    return hypotenuse(q.x - line.pixels[0].x, q.y - line.pixels[0].y) > least_px;
  };
  return std::ranges::none_of(line.pixels, farther);
}

}  // namespace

void check(const LineMarks& marks) {
  if (marks.width < 1 || marks.height < 1) {
    throw std::invalid_argument("a picture's width and height must be above 0");
  }
  if (marks.lines.empty()) throw std::invalid_argument("no straight line is marked");
  for (const MarkedLine& line : marks.lines) {
    if (line.pixels.size() < 3) {
      throw std::invalid_argument("line " + in_quotes(line.name) + " needs three pixels or more");
    }
    const auto wrong = [](Vec2 q) { return !(std::abs(q.x) <= 1e6 && std::abs(q.y) <= 1e6); };
    if (std::ranges::any_of(line.pixels, wrong)) {
      throw std::invalid_argument("line " + in_quotes(line.name) + " has a pixel beyond 1e6");
    }
    if (is_short(line)) {
      throw std::invalid_argument("line " + in_quotes(line.name) + " is shorter than 5 px");
    }
    if (!line.parallel.empty() &&
        std::ranges::count(marks.lines, line.parallel, &MarkedLine::parallel) < 2) {
      throw std::invalid_argument("line " + in_quotes(line.name) + " is the only one that is " +
                                  in_quotes(line.parallel) + ": parallel lines are two or more");
    }
  }
  for (const MarkedRectangle& rectangle : marks.rectangles) {
    if (std::ranges::any_of(rectangle.sides,
                            [&](std::size_t i) { return i >= marks.lines.size(); })) {
      throw std::invalid_argument("rectangle " + in_quotes(rectangle.name) + " has no such line");
    }
  }
}

LineMarks read_line_marks(const std::string& path) {
  const MarksReader reader(path);
  const toml::table root = reader.parse();
  reader.refuse_unknown(root, {"width", "height", "centre", "max_angle", "line", "rectangle"});
  LineMarks marks;
  marks.width = reader.size(root, "width");
  marks.height = reader.size(root, "height");
  if (const toml::node* centre = root.get("centre")) marks.centre = reader.pixel(*centre, "centre");
  if (const toml::node* angle = root.get("max_angle")) {
    const auto value = angle->is_number() ? angle->value<double>() : std::nullopt;
    if (!value || !(*value > 0 && *value <= 180)) {
      reader.fail(angle->source(), "\"max_angle\" must be above 0 and at most 180 degrees");
    }
    marks.max_angle_rad = std::min(*value * degree, std::numbers::pi);
  }
  for (const toml::table* table : reader.tables(root, "line")) {
    marks.lines.push_back(reader.line(*table));
    const std::string& name = marks.lines.back().name;
    if (std::ranges::count(marks.lines, name, &MarkedLine::name) > 1) {
      reader.fail(table->source(), "line " + in_quotes(name) + " is here for the second time");
    }
  }
  for (const toml::table* table : reader.tables(root, "rectangle")) {
    marks.rectangles.push_back(reader.rectangle(*table, marks.lines));
  }
  try {
    check(marks);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  return marks;
}

}  // namespace calibrate
