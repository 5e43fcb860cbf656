// mrcal's .cameramodel files: a lens, and where the camera stands.
#pragma once

#include <optional>
#include <string>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace calibrate {

struct CameraModel {
  Lens lens;
  std::optional<Pose> cam_from_ref;  // "extrinsics"; mrcal's reference frame is ours to choose
};

// Reads a .cameramodel: a Python dictionary with the keys lensmodel, intrinsics, imagersize, and
// extrinsics if it has any. Other keys are passed over, as mrcal does. Does not depend on the
// locale. Throws std::runtime_error with path, line and reason.
CameraModel read_camera_model(const std::string& path);

// Throws std::invalid_argument unless the lens fits into the format: pinholes and mrcal's models,
// with no largest angle of their own.
void check_fits_camera_model(const Lens& lens);

// Writes one that mrcal reads, with every digit. Throws as check_fits_camera_model, and
// std::runtime_error if the file cannot be written.
void write_camera_model(const std::string& path, const CameraModel& model);

}  // namespace calibrate
