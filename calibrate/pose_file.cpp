// A pose in a file of its own.
#include "calibrate/pose_file.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <vector>

#include <toml++/toml.h>

#include "calibrate/camera_model.h"
#include "calibrate/text_file.h"

namespace calibrate {
namespace {

[[noreturn]] void fail(const std::string& path,
                       const toml::source_region& at,
                       const std::string& why) {
  throw std::runtime_error(path + ":" + std::to_string(at.begin.line) + ":" +
                           std::to_string(at.begin.column) + ": " + why);
}

std::vector<double> numbers_of(const std::string& path,
                               const toml::table& table,
                               std::string_view key,
                               std::size_t count) {
  const toml::array* list = table[key].as_array();
  const std::string what =
      "\"" + std::string(key) + "\" must be a list of " + std::to_string(count) + " numbers";
  if (list == nullptr || list->size() != count) fail(path, table.source(), "a pose's " + what);
  std::vector<double> numbers;
  for (const toml::node& element : *list) {
    const auto number = element.is_number() ? element.value<double>() : std::nullopt;
    if (!number || !std::isfinite(*number)) fail(path, element.source(), what);
    numbers.push_back(*number);
  }
  return numbers;
}

Pose read_toml_pose(const std::string& path) {
  toml::table root;
  try {
    root = toml::parse(read_text_file(path));
  } catch (const toml::parse_error& error) {
    fail(path, error.source(), std::string(error.description()));
  }
  const toml::table* table = root["pose"].as_table();
  if (table == nullptr) {
    throw std::runtime_error(path + ": has no pose = { position = [...], rotation = [...] }");
  }
  const auto refuse_others = [&](const toml::table& of,
                                 std::initializer_list<std::string_view> known) {
    for (const auto& [key, node] : of) {
      if (std::ranges::find(known, key.str()) == known.end()) {
        fail(path, key.source(), "unknown key \"" + std::string(key.str()) + "\"");
      }
    }
  };
  refuse_others(root, {"pose"});
  refuse_others(*table, {"position", "rotation"});
  const std::vector<double> p = numbers_of(path, *table, "position", 3);
  const std::vector<double> r = numbers_of(path, *table, "rotation", 9);
  Mat3 rotation;
  std::ranges::copy(r, rotation.m.begin());
  try {
    return pose_from_rotation(rotation, {p[0], p[1], p[2]});
  } catch (const std::invalid_argument& error) {
    fail(path, table->source(), error.what());
  }
}

std::string list_of(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ", ") + to_text(number);
  return "[" + text + "]";
}

}  // namespace

Pose read_pose(const std::string& path) {
  if (path.ends_with(".toml")) return read_toml_pose(path);
  if (!path.ends_with(".cameramodel")) {
    throw std::runtime_error(path + ": a pose's file must end in .cameramodel or .toml");
  }
  const CameraModel model = read_camera_model(path);
  if (!model.cam_from_ref) throw std::runtime_error(path + ": has no extrinsics");
  return *model.cam_from_ref;
}

void write_pose(const std::string& path,
                const Pose& cam_from_set,
                const Lens& lens,
                const std::string& comment) {
  if (path.ends_with(".cameramodel")) return write_camera_model(path, {lens, cam_from_set});
  if (!path.ends_with(".toml")) {
    throw std::invalid_argument(path + ": a pose's file must end in .cameramodel or .toml");
  }
  const Vec3 p = position_of(cam_from_set);
  write_text_file(path, "# " + comment +
                            "\npose = { position = " + list_of(std::array{p.x, p.y, p.z}) +
                            ", rotation = " + list_of(cam_from_set.R.m) + " }\n");
}

}  // namespace calibrate
