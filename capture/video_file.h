// Video files as cameras, through libav.
#pragma once

#include <memory>
#include <string>

#include "capture/camera.h"
#include "capture/linearise.h"

namespace capture {

// Opens a video in any container that libav reads, with its sound.
//
// A frame's time is its time stamp after the file's first frame, and exactly time_of_frame where
// the stamp is that but for the container's rounding. Damage becomes lost and damaged frames; a
// file cut short ends early. Interlaced video is made whole as options.deinterlace says, the number
// and times of its frames unchanged. Pictures that the file says are to be turned are turned
// upright, where that is by multiples of 90 degrees, and mirrored; size and options.crop are those
// of the upright picture. Throws std::runtime_error with path, reason and what to do, if nothing in
// it can be shown, or options.frame or options.crop lie outside.
std::unique_ptr<Camera> open_video_file(const std::string& path,
                                        const CameraOptions& options,
                                        const LightCurves& curves);

}  // namespace capture
