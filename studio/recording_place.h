// Finds where a recording is at a time, without reading all that comes before.
#pragma once

#include <cstdint>
#include <string>

#include "capture/camera.h"

namespace studio {

struct RecordingPlace {
  std::int64_t frame = 0;  // of the recording, from 0 on: the newest that is not after the time
  capture::Time passed{};  // where it loops: how long the passes before this one took
};

// Opens the recording a few times, as `options` say but for their frame; `time` is of a camera that
// would have played it from its frame 0 on. Of a recording that ends before, its last frame. The
// first one where it does not tell how many frames it has, or cannot begin with any. Throws as
// capture::open_camera.
RecordingPlace find_place(const std::string& uri,
                          const capture::CameraOptions& options,
                          capture::Time time);

}  // namespace studio
