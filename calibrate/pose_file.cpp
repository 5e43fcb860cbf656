// A pose in a file of its own.
#include "calibrate/pose_file.h"

#include <array>
#include <span>
#include <stdexcept>

#include <toml++/toml.h>

#include "calibrate/camera_model.h"
#include "calibrate/text_file.h"
#include "capture/toml_reader.h"

namespace calibrate {
namespace {

Pose read_toml_pose(const std::string& path) {
  const capture::TomlReader reader(path, "pose");
  const toml::table root = reader.parse();
  const toml::table* table = root["pose"].as_table();
  if (table == nullptr) {
    throw std::runtime_error(path + ": has no pose = { position = [...], rotation = [...] }");
  }
  reader.refuse_unknown(root, {"pose"});
  reader.refuse_unknown(*table, {"position", "rotation"});
  const auto p = reader.numbers<3>(reader.required(*table, "position"), "position");
  Mat3 rotation;
  rotation.m = reader.numbers<9>(reader.required(*table, "rotation"), "rotation", true);
  try {
    return pose_from_rotation(rotation, {p[0], p[1], p[2]});
  } catch (const std::invalid_argument& error) {
    reader.fail(table->source(), error.what());
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
  if (*model.cam_from_ref == Pose{}) {
    throw std::runtime_error(
        path +
        ": its extrinsics are all zero, as where only a lens was found: name a file of calibrate "
        "pose; a camera that does stand so has a .toml with pose = { position = [0, 0, 0], "
        "rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1] }");
  }
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
