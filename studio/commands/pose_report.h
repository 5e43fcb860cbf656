// What the commands that find poses read, write and say alike.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "calibrate/lens.h"
#include "calibrate/markers.h"
#include "calibrate/pose.h"
#include "studio/console.h"

namespace studio {

// Throws UsageError unless a pose can be written to a file of that name.
void check_pose_file_name(const std::string& path);

// Throws std::runtime_error unless the file's directory is there: for before the work.
void check_directory_of(const std::string& path);

// Throws std::runtime_error if a pose cannot be written there because of its lens.
void check_pose_file_takes(const std::string& path, const calibrate::Lens& lens);

// As calibrate::write_pose; what the lens does not fit into is a std::runtime_error that says so.
void write_pose_file(const std::string& path,
                     const calibrate::Pose& cam_from_set,
                     const calibrate::Lens& lens,
                     const std::string& comment);

// The markers of one picture of a file, or of its only one. Throws std::runtime_error with the
// path.
std::vector<calibrate::Marker> read_markers_of(const std::string& path, const std::string& picture);

// position_m, rotation, axis and roll_deg.
nlohmann::ordered_json pose_json(const calibrate::Pose& cam_from_set);

// Where the camera is and looks; `sigma_mm` 0 = the position was given.
void say_pose(const calibrate::Pose& cam_from_set,
              double sigma_deg,
              double sigma_mm,
              Console& console);

// Warns where a lens does not tell what it is off by, which no +- can count then.
void warn_of_unknown_error(const calibrate::Lens& lens, const std::string& file, Console& console);

}  // namespace studio
