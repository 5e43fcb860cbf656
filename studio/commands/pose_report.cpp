// What the commands that find poses read, write and say alike.
#include "studio/commands/pose_report.h"

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/angles.h"
#include "calibrate/camera_model.h"
#include "calibrate/pose_file.h"
#include "studio/arguments.h"

namespace studio {
namespace {

using calibrate::degree;

calibrate::Vec3 row(const calibrate::Mat3& m, std::size_t i) {
  return {m.m[3 * i], m.m[3 * i + 1], m.m[3 * i + 2]};
}

// As sets count it: clockwise, from where the set's z is up.
double roll_of(const calibrate::Pose& cam_from_set) {
  const calibrate::Mat3 level = calibrate::pose_from_axis({}, row(cam_from_set.R, 2), 0).R;
  const calibrate::Vec3 right = row(cam_from_set.R, 0);
  return std::atan2(dot(right, row(level, 1)), dot(right, row(level, 0)));
}

}  // namespace

void check_pose_file_name(const std::string& path) {
  if (!path.ends_with(".toml") && !path.ends_with(".cameramodel")) {
    throw UsageError("-o must name a .toml or a .cameramodel file");
  }
}

void check_directory_of(const std::string& path) {
  const std::filesystem::path directory = std::filesystem::path(path).parent_path();
  if (directory.empty() || std::filesystem::is_directory(directory)) return;
  throw std::runtime_error(fmt::format("{}: there is no such directory", directory.string()));
}

void check_pose_file_takes(const std::string& path, const calibrate::Lens& lens) {
  if (!path.ends_with(".cameramodel")) return;
  try {
    calibrate::check_fits_camera_model(lens);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(
        fmt::format("{}: {}; a .toml file takes the pose of any lens", path, error.what()));
  }
}

void write_pose_file(const std::string& path,
                     const calibrate::Pose& cam_from_set,
                     const calibrate::Lens& lens,
                     const std::string& comment) {
  check_pose_file_takes(path, lens);
  calibrate::write_pose(path, cam_from_set, lens, comment);
}

std::vector<calibrate::Marker> read_markers_of(const std::string& path,
                                               const std::string& picture) {
  const std::vector<calibrate::Marker> all = calibrate::read_markers(path);
  try {
    return calibrate::markers_in(all, picture);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(
        fmt::format("{}: {}{}", path, error.what(), picture.empty() ? " by --picture" : ""));
  }
}

nlohmann::ordered_json pose_json(const calibrate::Pose& cam_from_set) {
  const calibrate::Vec3 p = position_of(cam_from_set);
  const calibrate::Vec3 axis = row(cam_from_set.R, 2);
  return {{"position_m", {p.x, p.y, p.z}},
          {"rotation", cam_from_set.R.m},
          {"axis", {axis.x, axis.y, axis.z}},
          {"roll_deg", roll_of(cam_from_set) / degree}};
}

void say_pose(const calibrate::Pose& cam_from_set,
              double sigma_deg,
              double sigma_mm,
              Console& console) {
  const calibrate::Vec3 p = position_of(cam_from_set);
  const calibrate::Vec3 axis = row(cam_from_set.R, 2);
  console.say(fmt::format("position [{:.4f}, {:.4f}, {:.4f}] m{}", p.x, p.y, p.z,
                          sigma_mm > 0 ? fmt::format(", +- {:.2g} mm", sigma_mm) : ", as given"));
  // Of what looks straight up or down, the roll turns with the least tilt.
  constexpr double nearly_vertical = 0.999;
  const calibrate::Vec3 top = -row(cam_from_set.R, 1);
  const std::string turned =
      std::abs(axis.z) > nearly_vertical
          ? fmt::format("the top of its picture towards [{:.4f}, {:.4f}, {:.4f}]", top.x, top.y,
                        top.z)
          : fmt::format("rolled {:.3f} degrees", roll_of(cam_from_set) / degree);
  console.say(fmt::format("looks along [{:.5f}, {:.5f}, {:.5f}], {}, +- {:.2g} degrees", axis.x,
                          axis.y, axis.z, turned, sigma_deg));
}

void warn_of_unknown_error(const calibrate::Lens& lens, const std::string& file, Console& console) {
  if (lens.error_px > 0) return;
  console.warn(file + ": does not tell its own error (error_px), which is left out of +-");
}

}  // namespace studio
