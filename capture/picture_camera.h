// Cameras that show picture files one after the other.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/linearise.h"

namespace capture {

// One frame of such a camera.
struct PictureEntry {
  std::string path;  // "" = lost
  Time time{};
  double exposure_s = 0;  // 0 = unknown
  FrameStatus status = FrameStatus::good;
  std::string note;
};

// Whether the file is one that such a camera shows: OpenEXR, Radiance, a recorded picture
// (coded_file.h), or another still (still.h).
bool is_picture(const std::string& path);

// The exposure time that the picture's EXIF data tell, snapped (see exif.h); 0 if they tell none.
double exposure_in(const std::string& path);

// Shows `entries`, which are in order of time and at least one. Pictures that are missing, damaged
// or, unlike the first readable one, of another size or with or without alpha, where that is asked
// for, are lost frames.
// `jitter` as of CameraInfo. Throws std::runtime_error if none can be read, or options.frame or
// options.crop lie outside.
std::unique_ptr<Camera> make_picture_camera(const std::string& name,
                                            std::vector<PictureEntry> entries,
                                            Rational rate,
                                            const CameraOptions& options,
                                            const LightCurves& curves,
                                            Time jitter = {});

}  // namespace capture
