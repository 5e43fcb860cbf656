// What a camera sees for some seconds, to compare with another.
#pragma once

#include <string>
#include <vector>

#include "calibrate/time_offset.h"
#include "capture/camera.h"
#include "studio/commands/board_places.h"

namespace studio {

// The light of all frames that came, or pictures to look for a board in; times rise.
struct Watched {
  std::vector<calibrate::SignalSample> brightness;
  std::vector<TimedPicture> pictures;
};

// Frames of `length_s` seconds by their own times, lost ones counted in, or fewer if `camera` ends.
// `exposure_s` is that of frames which do not tell theirs. Throws std::runtime_error with `name`
// and why if frames were lost and hardly any came.
Watched watch(capture::Camera& camera,
              const std::string& name,
              double length_s,
              double exposure_s,
              bool for_board);

}  // namespace studio
