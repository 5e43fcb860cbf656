// A pose in a file of its own.
#pragma once

#include <string>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace calibrate {

// Reads the extrinsics of a .cameramodel, or the `pose` of a .toml (files.md). Throws
// std::runtime_error with path, line where known, and reason; also for extrinsics of zeros, which
// lenses without a pose are written with.
Pose read_pose(const std::string& path);

// Writes, by the file's ending, a .cameramodel of the lens with the pose as its extrinsics, or a
// .toml with the line that goes into a set's [camera] or [probe]; `comment`, one line, goes into
// the latter. Throws std::invalid_argument for another ending, or a lens that has no place in a
// .cameramodel (camera_model.h); std::runtime_error if the file cannot be written.
void write_pose(const std::string& path,
                const Pose& cam_from_set,
                const Lens& lens,
                const std::string& comment);

}  // namespace calibrate
