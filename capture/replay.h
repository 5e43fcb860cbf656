// Recorded frames played again: replay:DIR.
#pragma once

#include <memory>
#include <string>

#include "capture/camera.h"
#include "capture/linearise.h"

namespace capture {

// The folder holds `frames.csv` and pictures of any still kind (OpenEXR and Radiance too, and those
// of recording.h, which give the very images that the camera gave):
//
//     file,time_s,exposure_s,status
//     00000.png,0.000000000,0.004,good
//     00001.png,0.040000000,0.001,damaged
//     ,0.080000000,0.004,lost
//
// The first line is this header. Each other line is one frame, in order: its picture, beside the
// .csv (empty if lost); the middle of its exposure on the recording's clock, rising; its exposure
// in seconds (0 = unknown); good, damaged or lost. Times are shifted so that the first frame is at
// 0.
//
// A folder without frames.csv is a bracket of stills: its pictures in the order of their names,
// with the exposures that their EXIF data tell (0 = none), at options.picture_rate.
//
// Throws std::runtime_error with folder, line, reason and what to do.
std::unique_ptr<Camera> open_replay(const std::string& folder,
                                    const CameraOptions& options,
                                    const LightCurves& curves);

}  // namespace capture
