// Lenses in OpenCV's files, and in those of ROS and kalibr.
#include "calibrate/opencv_lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "calibrate/angles.h"
#include "calibrate/opencv_storage.h"
#include "calibrate/text_file.h"

namespace calibrate {
namespace {

std::string quoted(std::string_view text) { return "\"" + std::string(text.substr(0, 60)) + "\""; }

using Names = std::initializer_list<std::string_view>;

// The first of a value's names that is there.
const StoredValue* find(const OpencvStorage& file, Names names) {
  for (const std::string_view name : names) {
    if (const StoredValue* value = file.find(name)) return value;
  }
  return nullptr;
}

double number_of(const OpencvStorage& file, const StoredValue& value, std::string_view text) {
  double number = 0;
  if (!parse_number(text, number) || !std::isfinite(number)) {
    file.fail(value.line, quoted(value.key) + " must hold finite numbers, not " + quoted(text));
  }
  return number;
}

double number_of(const OpencvStorage& file, const StoredValue& value) {
  return number_of(file, value, value.text);
}

// A list, divided by blanks or commas.
std::vector<double> numbers_of(const OpencvStorage& file, const StoredValue& value) {
  constexpr std::size_t most = 1000;
  constexpr std::string_view between = " \t\r\n,";
  std::vector<double> numbers;
  std::string_view rest = value.text;
  for (;;) {
    rest.remove_prefix(std::min(rest.find_first_not_of(between), rest.size()));
    if (rest.empty()) return numbers;
    const std::size_t end = std::min(rest.find_first_of(between), rest.size());
    if (numbers.size() == most) file.fail(value.line, quoted(value.key) + " is too long a list");
    numbers.push_back(number_of(file, value, rest.substr(0, end)));
    rest.remove_prefix(end);
  }
}

int size_of(const OpencvStorage& file, const StoredValue& value, double number) {
  if (!(number >= 1 && number <= 65536 && number == std::floor(number))) {
    file.fail(value.line, quoted(value.key) + " must be a whole number from 1 to 65536");
  }
  return static_cast<int>(number);
}

struct Size {
  int width = 0;
  int height = 0;
};

Size picture_size(const OpencvStorage& file) {
  const auto* width = find(file, {"image_width", "image_Width", "image/width"});
  const auto* height = find(file, {"image_height", "image_Height", "image/height"});
  if (width != nullptr && height != nullptr) {
    return {size_of(file, *width, number_of(file, *width)),
            size_of(file, *height, number_of(file, *height))};
  }
  const auto* both = find(file, {"imageSize", "image_size", "img_size", "cam0/resolution"});
  if (both == nullptr) {
    throw std::runtime_error(file.path() +
                             ": the key \"image_width\" or \"image_height\" is missing; " +
                             "add them, in pixels");
  }
  const std::vector<double> numbers = numbers_of(file, *both);
  if (numbers.size() != 2) file.fail(both->line, quoted(both->key) + " must hold two numbers");
  return {size_of(file, *both, numbers[0]), size_of(file, *both, numbers[1])};
}

// An opencv-matrix by its rows, cols and data, or a plain list; nothing if it is not there.
struct Matrix {
  std::vector<double> numbers;
  int line = 0;
  std::string key;
};

std::optional<Matrix> matrix_of(const OpencvStorage& file, Names names) {
  for (const std::string_view name : names) {
    if (const StoredValue* list = file.find(name)) {
      return Matrix{numbers_of(file, *list), list->line, list->key};
    }
    if (!file.has(name)) continue;
    const std::string key(name);
    const StoredValue* data = file.find(key + "/data");
    if (data == nullptr)
      throw std::runtime_error(file.path() + ": " + quoted(key) + " has no data");
    Matrix matrix{numbers_of(file, *data), data->line, key};
    const StoredValue* kind = file.find(key + "/dt");
    if (kind != nullptr && kind->text != "d" && kind->text != "f") {
      file.fail(kind->line, quoted(key) + " must be of type d or f, not " + quoted(kind->text));
    }
    double count = 1;
    for (const char* side : {"/rows", "/cols"}) {
      const StoredValue* length = file.find(key + side);
      if (length == nullptr) {
        file.fail(data->line, quoted(key) + " has no " + quoted(side + 1));
      }
      const double number = number_of(file, *length);
      if (!(number >= 0 && number <= 1000 && number == std::floor(number))) {
        file.fail(length->line, quoted(length->key) + " must be a whole number up to 1000");
      }
      count *= number;
    }
    if (count != static_cast<double>(matrix.numbers.size())) {
      file.fail(data->line, quoted(key) + " holds " + std::to_string(matrix.numbers.size()) +
                                " numbers, not rows times cols");
    }
    return matrix;
  }
  return std::nullopt;
}

// fx, fy, cx, cy of a 3x3 camera matrix.
std::array<double, 4> core_of(const OpencvStorage& file, const Matrix& matrix) {
  const std::vector<double>& m = matrix.numbers;
  if (m.size() != 9) file.fail(matrix.line, quoted(matrix.key) + " must be 3x3");
  if (m[1] != 0) {
    file.fail(matrix.line, quoted(matrix.key) + " has skew, which no lens model here has");
  }
  if (m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1) {
    file.fail(matrix.line, quoted(matrix.key) + " must be [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
  }
  return {m[0], m[4], m[2], m[5]};
}

enum class Family { perspective, fisheye };

// What the file calls its coefficients.
Family family_of(const OpencvStorage& file, const std::string& within = {}) {
  if (const auto* flag = find(file, {"fisheye_model", "fisheye", "Calibrate_UseFisheyeModel"})) {
    if (number_of(file, *flag) != 0) return Family::fisheye;
  }
  const StoredValue* camera = file.find(within + "camera_model");
  if (camera != nullptr && camera->text != "pinhole") {
    file.fail(camera->line, "camera model " + quoted(camera->text) +
                                " has no lens model here; calibrate again, as pinhole with "
                                "equidistant distortion");
  }
  const StoredValue* name = file.find(within + "distortion_model");
  if (name == nullptr) return Family::perspective;
  for (const char* known : {"fisheye", "equidistant", "kannala_brandt", "kannala_brandt4"}) {
    if (name->text == known) return Family::fisheye;
  }
  for (const char* known : {"plumb_bob", "rational_polynomial", "radtan", "thin_prism", "none"}) {
    if (name->text == known) return Family::perspective;
  }
  file.fail(name->line, "distortion model " + quoted(name->text) + " has no lens model here");
}

Lens lens_of(const OpencvStorage& file,
             Family family,
             const std::array<double, 4>& core,
             std::vector<double> coefficients,
             int line) {
  Lens lens;
  const Size size = picture_size(file);
  lens.width = size.width;
  lens.height = size.height;
  lens.parameters.assign(core.begin(), core.end());
  if (family == Family::fisheye) {
    if (coefficients.size() != 4) {
      file.fail(line, "a fish-eye has 4 distortion coefficients, not " +
                          std::to_string(coefficients.size()));
    }
    lens.model = "kannala_brandt";
  } else if (!coefficients.empty()) {
    if (coefficients.size() == 14) {
      if (coefficients[12] != 0 || coefficients[13] != 0) {
        file.fail(line, "distortion coefficients of a tilted sensor have no lens model here");
      }
      coefficients.resize(12);
    }
    const std::size_t count = coefficients.size();
    if (count != 4 && count != 5 && count != 8 && count != 12) {
      file.fail(line, "there are " + std::to_string(count) +
                          " distortion coefficients; OpenCV has 0, 4, 5, 8, 12 or 14");
    }
    lens.model = "LENSMODEL_OPENCV" + std::to_string(count);
  }
  lens.parameters.insert(lens.parameters.end(), coefficients.begin(), coefficients.end());
  if (const StoredValue* angle = file.find("max_angle")) {
    const double angle_deg = number_of(file, *angle);
    if (!(angle_deg > 0 && angle_deg <= 180)) {
      file.fail(angle->line, "\"max_angle\" must be above 0 and at most 180 degrees");
    }
    lens.max_angle_rad = std::min(angle_deg * degree, std::numbers::pi);
  }
  if (const StoredValue* error = file.find("error_px")) {
    lens.error_px = number_of(file, *error);
    if (!(lens.error_px >= 0)) file.fail(error->line, "\"error_px\" must be 0 or above");
    if (lens.error_px > most_error_px(lens)) {
      file.fail(error->line, "\"error_px\" must be at most the picture's diagonal");
    }
  }
  try {
    check(lens);
  } catch (const std::invalid_argument& error) {
    file.fail(line, error.what());
  }
  return lens;
}

// Files of parameters by name: image {width, height} and parameter {fx, fy, cx, cy, k1, ...}.
Lens named_parameters(const OpencvStorage& file) {
  const auto refuse = [&](std::string_view key, const std::string& model) {
    const StoredValue* value = file.find("parameter/" + std::string(key));
    if (value != nullptr) {
      file.fail(value->line, model + " (parameter " + quoted(key) + ") has no lens model here");
    }
  };
  refuse("coefficients/projection", "Scaramuzza's OcamCalib");
  refuse("xi", "the double sphere model");
  refuse("beta", "the extended unified camera model");
  refuse("alpha", "the unified camera model");
  const auto named = [&](std::string_view key) -> std::optional<double> {
    const StoredValue* value = file.find("parameter/" + std::string(key));
    return value == nullptr ? std::nullopt : std::optional(number_of(file, *value));
  };
  std::array<double, 4> core{};
  constexpr std::array<std::string_view, 4> core_names{"fx", "fy", "cx", "cy"};
  for (std::size_t i = 0; i < core.size(); ++i) {
    const auto value = named(core_names[i]);
    if (!value) {
      throw std::runtime_error(file.path() + ": the key \"parameter/" + std::string(core_names[i]) +
                               "\" is missing");
    }
    core[i] = *value;
  }
  const int line = file.find("parameter/fx")->line;
  const bool distorted = file.has("parameter/k1");
  const bool tangential = file.has("parameter/p1") || file.has("parameter/p2");
  // A parameter without a place in the lens would change it unseen.
  for (const StoredValue& value : file.values_below("parameter")) {
    const std::string key = value.key.substr(value.key.find('/') + 1);
    const bool known = std::ranges::find(core_names, key) != core_names.end() ||
                       (distorted && (key == "k1" || key == "k2" || key == "k3" ||
                                      (tangential ? key == "p1" || key == "p2" : key == "k4")));
    double number = 0;
    if (known || (parse_number(value.text, number) && number == 0)) continue;
    file.fail(value.line, "parameter " + quoted(key) +
                              (distorted ? std::string(" has no place in a lens of ") +
                                               (tangential ? "k1 to k3, p1 and p2" : "k1 to k4")
                                         : " has no place in a lens without k1"));
  }
  if (!distorted) return lens_of(file, Family::perspective, core, {}, line);
  const double k1 = *named("k1"), k2 = named("k2").value_or(0), k3 = named("k3").value_or(0);
  if (tangential) {
    return lens_of(file, Family::perspective, core,
                   {k1, k2, named("p1").value_or(0), named("p2").value_or(0), k3}, line);
  }
  return lens_of(file, Family::fisheye, core, {k1, k2, k3, named("k4").value_or(0)}, line);
}

// kalibr's chain of one camera.
Lens chain_of_one(const OpencvStorage& file) {
  for (const std::string& key : file.top_keys()) {
    if (key != "cam0" && key.starts_with("cam")) {
      throw std::runtime_error(file.path() + ": has cam0 and " + quoted(key) +
                               "; keep the one camera whose lens is asked for, as cam0");
    }
  }
  const Family family = family_of(file, "cam0/");
  const auto core = matrix_of(file, {"cam0/intrinsics"});
  const auto coefficients = matrix_of(file, {"cam0/distortion_coeffs"});
  if (!core) throw std::runtime_error(file.path() + ": the key \"cam0/intrinsics\" is missing");
  if (core->numbers.size() != 4) file.fail(core->line, "\"intrinsics\" must be [fx, fy, cx, cy]");
  return lens_of(file, family,
                 {core->numbers[0], core->numbers[1], core->numbers[2], core->numbers[3]},
                 coefficients ? coefficients->numbers : std::vector<double>{},
                 coefficients ? coefficients->line : core->line);
}

std::string matrix_text(
    bool xml, const std::string& name, int rows, int cols, std::span<const double> numbers) {
  std::string list;
  for (const double number : numbers)
    list += (list.empty() ? "" : xml ? " " : ", ") + to_text(number);
  const std::string r = std::to_string(rows), c = std::to_string(cols);
  if (xml) {
    return "<" + name + " type_id=\"opencv-matrix\">\n  <rows>" + r + "</rows>\n  <cols>" + c +
           "</cols>\n  <dt>d</dt>\n  <data>\n    " + list + "</data></" + name + ">\n";
  }
  return name + ": !!opencv-matrix\n   rows: " + r + "\n   cols: " + c + "\n   dt: d\n   data: [ " +
         list + " ]\n";
}

}  // namespace

Lens read_opencv_lens(const std::string& path) {
  const OpencvStorage file(path);
  if (file.has("parameter")) return named_parameters(file);
  if (file.has("cam0")) return chain_of_one(file);
  const auto matrix =
      matrix_of(file, {"camera_matrix", "Camera_Matrix", "cameraMatrix", "intrinsic_matrix", "K"});
  const auto coefficients =
      matrix_of(file, {"distortion_coefficients", "Distortion_Coefficients", "distCoeffs",
                       "dist_coeffs", "distortion_coeffs", "D"});
  const std::vector<double> list = coefficients ? coefficients->numbers : std::vector<double>{};
  if (matrix) {
    return lens_of(file, family_of(file), core_of(file, *matrix), list,
                   coefficients ? coefficients->line : matrix->line);
  }
  std::string keys;
  for (const std::string& key : file.top_keys()) {
    if (keys.size() < 200) keys += (keys.empty() ? "" : ", ") + key;
  }
  throw std::runtime_error(path + ": has no \"camera_matrix\"" + (keys.empty() ? "" : ", only ") +
                           keys);
}

void write_opencv_lens(const std::string& path, const Lens& lens) {
  check(lens);
  const bool fisheye = lens.model == "kannala_brandt";
  const bool pinhole = lens.model == "pinhole" || lens.model == "LENSMODEL_PINHOLE";
  if (!fisheye && !pinhole && !lens.model.starts_with("LENSMODEL_OPENCV")) {
    throw std::invalid_argument(path + ": OpenCV has no model for a lens of " + lens.model +
                                "; write a .toml");
  }
  const bool xml = path.ends_with(".xml");
  const auto value = [&](const std::string& key, const std::string& text) {
    return xml ? "<" + key + ">" + text + "</" + key + ">\n" : key + ": " + text + "\n";
  };
  const std::vector<double>& p = lens.parameters;
  std::vector<double> coefficients(p.begin() + 4, p.end());
  if (fisheye) coefficients.resize(4, 0);
  std::string text = xml ? "<?xml version=\"1.0\"?>\n<opencv_storage>\n" : "%YAML:1.0\n---\n";
  text += value("image_width", std::to_string(lens.width));
  text += value("image_height", std::to_string(lens.height));
  if (fisheye) text += value("fisheye_model", "1");
  if (lens.max_angle_rad < Lens{}.max_angle_rad) {
    text += value("max_angle", to_text(lens.max_angle_rad / degree));
  }
  if (lens.error_px > 0) text += value("error_px", to_text(lens.error_px));
  text += matrix_text(xml, "camera_matrix", 3, 3,
                      std::array{p[0], 0.0, p[2], 0.0, p[1], p[3], 0.0, 0.0, 1.0});
  if (!coefficients.empty()) {
    text += matrix_text(xml, "distortion_coefficients", static_cast<int>(coefficients.size()), 1,
                        coefficients);
  }
  if (xml) text += "</opencv_storage>\n";
  write_text_file(path, text);
}

}  // namespace calibrate
