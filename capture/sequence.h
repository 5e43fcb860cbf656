// Numbered picture files as one camera: take/frame.%04d.exr.
#pragma once

#include <memory>
#include <string>

#include "capture/camera.h"
#include "capture/linearise.h"

namespace capture {

// Whether the path's file name has a place for numbers, %d or %04d, and no such file is there.
bool is_sequence(const std::string& path);

// Opens all files in the folder that match the pattern, in the order of their numbers, from the
// lowest; frames count from 0 there, at options.picture_rate. Missing numbers between are lost
// frames. Digits: %d and %0Nd take numbers as printf writes them.
// Throws std::runtime_error with pattern, reason and what to do.
std::unique_ptr<Camera> open_sequence(const std::string& path,
                                      const CameraOptions& options,
                                      const LightCurves& curves);

}  // namespace capture
