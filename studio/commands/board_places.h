// Where a board is in the frames of a video.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/grey_picture.h"
#include "calibrate/time_offset.h"
#include "capture/camera.h"
#include "capture/image.h"
#include "studio/console.h"

namespace studio {

struct TimedPicture {
  double time_s = 0;
  calibrate::GreyPicture grey;
};

// Codes of a frame, small enough that some hundred of them can wait: by whole numbers of pixels, so
// that the longer side has at most 1000.
calibrate::GreyPicture small_picture(const capture::Image& image);

// Opens pictures that end: a file, a sequence, a recording. Throws std::runtime_error for a camera
// whose pictures come as time goes by, saying to record them first.
std::unique_ptr<capture::Camera> open_recorded(const std::string& source);

struct BoardPlaces {
  std::vector<calibrate::SeenPoint> points;  // of the board's middle; none where it was not found
  std::size_t frames = 0;                    // looked at
  std::string reason;                        // why it was not found in the last one without it
};

// By the fast finder alone, 0.3 s for each frame at most.
BoardPlaces find_board_places(const std::vector<TimedPicture>& pictures,
                              const calibrate::Board& board,
                              const std::string& camera,
                              Console& console);

}  // namespace studio
