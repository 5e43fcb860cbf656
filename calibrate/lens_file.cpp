// Lenses in files: .toml, mrcal's .cameramodel, and OpenCV's.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <toml++/toml.h>

#include "calibrate/angles.h"
#include "calibrate/axial_lens.h"
#include "calibrate/camera_model.h"
#include "calibrate/lens.h"
#include "calibrate/mrcal_lens.h"
#include "calibrate/opencv_lens.h"
#include "calibrate/text_file.h"
#include "capture/toml_reader.h"

namespace calibrate {
namespace {

using capture::in_quotes;

// A .toml lens while it is read: whatever is not taken in the end is unknown.
class LensTable : private capture::TomlReader {
 public:
  explicit LensTable(const std::string& path) : TomlReader(path, "lens"), table_(parse()) {}
  // Of a text that `name` stands for.
  LensTable(std::string_view text, const std::string& name)
      : TomlReader(name, "lens"), table_(parse_text(text)) {}

  bool has(std::string_view key) const { return table_.contains(key); }

  std::string string(std::string_view key) { return value<std::string>(key, "a string"); }

  double number(std::string_view key) {
    const toml::node& node = take(key);
    if (!node.is_number()) fail_at(node, key, "must be a number");
    return finite(node, key);
  }

  int whole_number(std::string_view key) {
    const toml::node& node = take(key);
    const auto whole = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
    if (!whole || *whole < 1 || *whole > 65536) {
      fail_at(node, key, "must be a whole number from 1 to 65536");
    }
    return static_cast<int>(*whole);
  }

  std::vector<double> numbers(std::string_view key) {
    const toml::node& node = take(key);
    const toml::array* array = node.as_array();
    if (array == nullptr) fail_at(node, key, "must be a list of numbers");
    std::vector<double> result;
    for (const toml::node& element : *array) {
      if (!element.is_number()) fail_at(element, key, "must hold numbers only");
      result.push_back(finite(element, key));
    }
    return result;
  }

  void refuse_unknown(const std::string& model) const {
    for (const auto& [key, node] : table_) {
      if (std::ranges::find(taken_, key.str()) != taken_.end()) continue;
      fail(key.source(), "unknown key " + in_quotes(key.str()) + " in a lens of model " + model);
    }
  }

  // Complains about the value of a key that was read.
  [[noreturn]] void fail_at_key(std::string_view key, const std::string& why) const {
    fail(table_.get(key)->source(), why);
  }
  [[noreturn]] void fail_whole(const std::string& why) const {
    throw std::runtime_error(path() + ": " + why);
  }

 private:
  const toml::node& take(std::string_view key) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) fail_whole("the key " + in_quotes(key) + " is missing");
    taken_.emplace_back(key);
    return *node;
  }
  template <class T>
  T value(std::string_view key, const std::string& kind) {
    const toml::node& node = take(key);
    const auto result = node.value_exact<T>();
    if (!result) fail_at(node, key, "must be " + kind);
    return *result;
  }
  double finite(const toml::node& node, std::string_view key) const {
    const double result = node.value<double>().value();
    if (!std::isfinite(result)) fail_at(node, key, "must be finite");
    return result;
  }
  [[noreturn]] void fail_at(const toml::node& node,
                            std::string_view key,
                            const std::string& why) const {
    fail(node.source(), in_quotes(key) + " " + why);
  }

  toml::table table_;
  std::vector<std::string> taken_;
};

// The names of a model's parameters, in order; the last `optional` ones may be left out together
// with all that follow.
struct ParameterNames {
  std::vector<std::string_view> names;
  std::size_t optional = 0;
};

ParameterNames names_of(AxialLens::Kind kind) {
  switch (kind) {
    case AxialLens::Kind::pinhole:
      return {{"fx", "fy", "cx", "cy"}};
    case AxialLens::Kind::equisolid:
      return {{"f", "cx", "cy"}};
    case AxialLens::Kind::decentred_kannala_brandt:
      return {{"fx", "fy", "cx", "cy", "p1", "p2", "k1", "k2", "k3", "k4"}, 4};
    case AxialLens::Kind::kannala_brandt:
      break;
  }
  return {{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"}, 4};
}

Lens read_toml_lens(LensTable table) {
  Lens lens;
  lens.model = table.string("model");
  lens.width = table.whole_number("width");
  lens.height = table.whole_number("height");
  if (table.has("max_angle")) {
    const double max_angle_deg = table.number("max_angle");
    if (!(max_angle_deg > 0 && max_angle_deg <= 180)) {
      table.fail_at_key("max_angle", "\"max_angle\" must be above 0 and at most 180 degrees");
    }
    lens.max_angle_rad = std::min(max_angle_deg * degree, std::numbers::pi);
  }
  if (table.has("error_px")) {
    lens.error_px = table.number("error_px");
    if (lens.error_px < 0) table.fail_at_key("error_px", "\"error_px\" must be 0 or above");
    if (lens.error_px > most_error_px(lens)) {
      table.fail_at_key("error_px", "\"error_px\" must be at most the picture's diagonal");
    }
  }
  if (const auto kind = AxialLens::kind_of(lens.model)) {
    const ParameterNames expected = names_of(*kind);
    const std::size_t required = expected.names.size() - expected.optional;
    for (std::size_t i = 0; i < expected.names.size(); ++i) {
      if (i >= required && !table.has(expected.names[i])) break;
      lens.parameters.push_back(table.number(expected.names[i]));
    }
  } else if (is_mrcal_model(lens.model)) {
    lens.parameters = table.numbers("parameters");
  }
  try {
    check(lens);
  } catch (const std::invalid_argument& error) {
    table.fail_at_key("model", error.what());
  }
  table.refuse_unknown(lens.model);
  return lens;
}

std::string toml_of(const Lens& lens) {
  check(lens);
  std::string text = "model = \"" + lens.model + "\"\nwidth = " + std::to_string(lens.width) +
                     "\nheight = " + std::to_string(lens.height) + "\n";
  if (lens.max_angle_rad < Lens{}.max_angle_rad) {
    text += "max_angle = " + to_text(lens.max_angle_rad / degree) + "  # degrees off the axis\n";
  }
  if (lens.error_px > 0) text += "error_px = " + to_text(lens.error_px) + "\n";
  if (const auto kind = AxialLens::kind_of(lens.model)) {
    const ParameterNames expected = names_of(*kind);
    for (std::size_t i = 0; i < lens.parameters.size(); ++i) {
      text += std::string(expected.names[i]) + " = " + to_text(lens.parameters[i]) + "\n";
    }
  } else {
    text += "parameters = [";
    for (const double p : lens.parameters) text += to_text(p) + ", ";
    text += "]\n";
  }
  return text;
}

bool is_opencv_name(const std::string& path) {
  return path.ends_with(".yml") || path.ends_with(".yaml") || path.ends_with(".xml");
}

constexpr const char* known_endings =
    ": a lens file must end in .cameramodel or .toml, or be OpenCV's .yml, .yaml or .xml";

}  // namespace

Lens read_lens(const std::string& path) {
  if (path.ends_with(".cameramodel")) return read_camera_model(path).lens;
  if (path.ends_with(".toml")) return read_toml_lens(LensTable(path));
  if (is_opencv_name(path)) return read_opencv_lens(path);
  throw std::runtime_error(path + known_endings);
}

void write_lens(const std::string& path, const Lens& lens) {
  if (path.ends_with(".cameramodel")) {
    write_camera_model(path, {lens, std::nullopt});
  } else if (path.ends_with(".toml")) {
    write_text_file(path, toml_of(lens));
  } else if (is_opencv_name(path)) {
    write_opencv_lens(path, lens);
  } else {
    throw std::runtime_error(path + known_endings);
  }
}

std::string text_of_lens(const Lens& lens) { return toml_of(lens); }

Lens lens_from_text(std::string_view text, const std::string& name) {
  return read_toml_lens(LensTable(text, name));
}

}  // namespace calibrate
