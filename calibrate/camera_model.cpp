// mrcal's .cameramodel files: a lens, and where the camera stands.
#include "calibrate/camera_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "calibrate/mrcal_lens.h"
#include "calibrate/rotation_vector.h"
#include "calibrate/text_file.h"

namespace calibrate {
namespace {

// Reads the few literals of Python that .cameramodel files are made of.
class Reader {
 public:
  Reader(const std::string& path, std::string_view text) : path_(path), text_(text) {}

  [[noreturn]] void fail(const std::string& reason) const { fail_at(line_, reason); }
  [[noreturn]] void fail_at(int line, const std::string& reason) const {
    throw std::runtime_error(path_ + ":" + std::to_string(line) + ": " + reason);
  }
  int line() const { return line_; }

  void skip_space() {
    while (!at_end()) {
      if (peek() == '#') {
        while (!at_end() && peek() != '\n') take();
      } else if (std::string_view(" \t\r\n\f").find(peek()) != std::string_view::npos) {
        take();
      } else {
        return;
      }
    }
  }

  bool finished() {
    skip_space();
    return at_end();
  }

  // Takes the character if it comes next.
  bool accept(char wanted) {
    skip_space();
    if (at_end() || peek() != wanted) return false;
    take();
    return true;
  }

  void expect(char wanted, const std::string& where) {
    if (accept(wanted)) return;
    const std::string found = at_end() ? "the file ends" : std::string("found '") + peek() + "'";
    fail(std::string("expected '") + wanted + "' " + where + ", but " + found);
  }

  std::string string() {
    skip_space();
    if (!at_end() && (peek() == 'b' || peek() == 'r')) take();
    if (at_end() || (peek() != '\'' && peek() != '"')) fail("expected a quoted string");
    const int opened = line_;
    const char quote = take();
    std::string result;
    while (true) {
      if (at_end() || peek() == '\n') fail_at(opened, "a string has no closing quote");
      char c = take();
      if (c == quote) return result;
      if (c == '\\' && !at_end()) c = take();
      result += c;
    }
  }

  std::vector<double> numbers(const std::string& key) {
    const int began = line_;
    std::vector<double> result;
    expect_opening("after '" + key + "'");
    while (!accept_closing()) {
      skip_space();
      const std::string_view token = word();
      double value = 0;
      if (!parse_number(token, value) || !std::isfinite(value)) {
        fail(token.empty()
                 ? key + " must be a list of numbers, begun on line " + std::to_string(began)
                 : key + " holds \"" + std::string(token.substr(0, 40)) +
                       "\", which is no finite number");
      }
      result.push_back(value);
      if (!accept(',')) {
        if (accept_closing()) break;
        fail("expected ',' or ']' in " + key);
      }
    }
    return result;
  }

  double number(const std::string& key) {
    skip_space();
    const std::string_view token = word();
    double value = 0;
    if (!parse_number(token, value) || !std::isfinite(value)) fail(key + " must be a number");
    return value;
  }

  // Passes over any value: string, number, name, or nested lists of them.
  void skip_value() {
    int depth = 0;
    do {
      skip_space();
      if (at_end()) fail("the file ends inside a value");
      const char c = peek();
      if (c == '[' || c == '(' || c == '{') {
        take();
        ++depth;
      } else if (c == ']' || c == ')' || c == '}') {
        if (depth == 0) fail("a value is missing");
        take();
        --depth;
      } else if (depth > 0 && (c == ',' || c == ':')) {
        take();
      } else if (c == '\'' || c == '"' || is_prefixed_string()) {
        string();
      } else if (word().empty()) {
        fail(std::string("unexpected '") + c + "'");
      }
    } while (depth > 0);
  }

 private:
  bool at_end() const { return at_ == text_.size(); }
  char peek() const { return text_[at_]; }
  char take() {
    const char c = text_[at_++];
    if (c == '\n') ++line_;
    return c;
  }
  bool is_prefixed_string() const {
    return (peek() == 'b' || peek() == 'r') && at_ + 1 < text_.size() &&
           (text_[at_ + 1] == '\'' || text_[at_ + 1] == '"');
  }
  void expect_opening(const std::string& where) {
    if (!accept('(')) expect('[', where);
  }
  bool accept_closing() { return accept(']') || accept(')'); }
  std::string_view word() {
    const std::size_t begin = at_;
    while (!at_end() &&
           std::string_view(",:]})[({#'\" \t\r\n").find(peek()) == std::string_view::npos) {
      take();
    }
    return text_.substr(begin, at_ - begin);
  }

  const std::string& path_;
  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

// Ours: mrcal passes over it.
constexpr const char* error_key = "platelight_error_px";

// A value and the line that it began on, for later complaints.
template <class T>
struct Found {
  T value{};
  int line = 0;
};

struct Contents {
  std::optional<Found<std::string>> lens_model;
  std::optional<Found<std::vector<double>>> intrinsics, extrinsics, imager_size;
  std::optional<Found<double>> error_px;
};

template <class T>
void set_once(Reader& reader,
              std::optional<Found<T>>& place,
              const std::string& key,
              Found<T> found) {
  if (place) reader.fail_at(found.line, "'" + key + "' stands here for the second time");
  place = std::move(found);
}

Contents read_contents(Reader& reader) {
  Contents contents;
  reader.expect('{', "at the beginning");
  while (!reader.accept('}')) {
    const std::string key = reader.string();
    reader.expect(':', "after '" + key + "'");
    reader.skip_space();
    const int line = reader.line();
    if (key == "lensmodel") {
      set_once(reader, contents.lens_model, key, {reader.string(), line});
    } else if (key == "intrinsics") {
      set_once(reader, contents.intrinsics, key, {reader.numbers(key), line});
    } else if (key == "extrinsics") {
      set_once(reader, contents.extrinsics, key, {reader.numbers(key), line});
    } else if (key == "imagersize") {
      set_once(reader, contents.imager_size, key, {reader.numbers(key), line});
    } else if (key == error_key) {
      set_once(reader, contents.error_px, key, {reader.number(key), line});
    } else {
      reader.skip_value();
    }
    if (!reader.accept(',')) {
      reader.expect('}', "or ',' after the value of '" + key + "'");
      break;
    }
  }
  if (!reader.finished()) reader.fail("something follows the closing '}'");
  return contents;
}

bool is_picture_size(double x) { return x >= 1 && x <= 65536 && x == std::floor(x); }

std::string list(const std::vector<double>& values) {
  std::string text = "[ ";
  for (const double value : values) text += to_text(value) + ", ";
  return text + "]";
}

}  // namespace

CameraModel read_camera_model(const std::string& path) {
  const std::string text = read_text_file(path);
  Reader reader(path, text);
  const Contents contents = read_contents(reader);
  if (!contents.lens_model) reader.fail("'lensmodel' is missing");
  if (!contents.intrinsics) reader.fail("'intrinsics' is missing");
  if (!contents.imager_size) reader.fail("'imagersize' is missing");
  const Found<std::vector<double>>& size = *contents.imager_size;
  if (size.value.size() != 2 || !std::ranges::all_of(size.value, is_picture_size)) {
    reader.fail_at(size.line, "'imagersize' must be width and height, from 1 to 65536");
  }

  CameraModel model;
  model.lens.model = contents.lens_model->value;
  model.lens.width = static_cast<int>(size.value[0]);
  model.lens.height = static_cast<int>(size.value[1]);
  model.lens.parameters = contents.intrinsics->value;
  if (contents.error_px) {
    model.lens.error_px = contents.error_px->value;
    if (model.lens.error_px < 0) {
      reader.fail_at(contents.error_px->line, std::string(error_key) + " must be 0 or above");
    }
    if (!(model.lens.error_px <= most_error_px(model.lens))) {
      reader.fail_at(contents.error_px->line,
                     std::string(error_key) + " must be at most the picture's diagonal");
    }
  }
  if (!is_mrcal_model(model.lens.model)) {
    reader.fail_at(contents.lens_model->line,
                   "'" + model.lens.model + "' is not the name of a model of mrcal");
  }
  try {
    count_mrcal_parameters(model.lens.model);
  } catch (const std::invalid_argument& error) {
    reader.fail_at(contents.lens_model->line, error.what());
  }
  try {
    check(model.lens);
  } catch (const std::invalid_argument& error) {
    reader.fail_at(contents.intrinsics->line, error.what());
  }
  if (contents.extrinsics) {
    if (contents.extrinsics->value.size() != 6) {
      reader.fail_at(contents.extrinsics->line, "'extrinsics' must be 6 numbers");
    }
    const std::vector<double>& rt = contents.extrinsics->value;
    constexpr double most = 1e9;  // radians and metres; the squares of larger ones overflow
    if (!std::ranges::all_of(rt, [](double x) { return std::abs(x) <= most; })) {
      reader.fail_at(contents.extrinsics->line, "'extrinsics' must be within 1e9 of 0");
    }
    constexpr double full_turn = 2 * std::numbers::pi;
    if (std::hypot(rt[0], rt[1], rt[2]) > 1.001 * full_turn) {
      reader.fail_at(contents.extrinsics->line,
                     "'extrinsics' turn by more than a full turn: are these degrees? They begin "
                     "with a rotation vector in radians");
    }
    model.cam_from_ref = Pose{rotation_of({rt[0], rt[1], rt[2]}), {rt[3], rt[4], rt[5]}};
  }
  return model;
}

void check_fits_camera_model(const Lens& lens) {
  check(lens);
  if ((lens.model != "pinhole" && !is_mrcal_model(lens.model)) ||
      lens.max_angle_rad < Lens{}.max_angle_rad) {
    throw std::invalid_argument("a .cameramodel cannot hold a lens of model " + lens.model +
                                " with its largest angle: write a .toml");
  }
}

void write_camera_model(const std::string& path, const CameraModel& model) {
  check_fits_camera_model(model.lens);
  const bool pinhole = model.lens.model == "pinhole";
  std::vector<double> rt(6);
  if (model.cam_from_ref) {
    const Vec3 r = rotation_vector(model.cam_from_ref->R);
    const Vec3 t = model.cam_from_ref->t;
    rt = {r.x, r.y, r.z, t.x, t.y, t.z};
  }
  const std::string error =
      model.lens.error_px > 0
          ? "    '" + std::string(error_key) + "': " + to_text(model.lens.error_px) + ",\n"
          : "";
  write_text_file(path,
                  "{\n    'lensmodel':  '" + (pinhole ? "LENSMODEL_PINHOLE" : model.lens.model) +
                      "',\n    # fx, fy, cx, cy, then the model's own\n    'intrinsics': " +
                      list(model.lens.parameters) +
                      ",\n    # rotation vector and translation from the reference to the camera\n"
                      "    'extrinsics': " +
                      list(rt) + ",\n" + error + "    'imagersize': [ " +
                      std::to_string(model.lens.width) + ", " + std::to_string(model.lens.height) +
                      " ]\n}\n");
}

}  // namespace calibrate
