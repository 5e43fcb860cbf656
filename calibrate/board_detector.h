// Boards in pictures, within a time limit.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "calibrate/board.h"
#include "calibrate/grey_picture.h"
#include "calibrate/lens.h"

namespace calibrate {

struct DetectionOptions {
  std::chrono::milliseconds time_limit{5000};
  // A guess of how the camera sees, for boards that are too bent for the finders: parts of the
  // picture are straightened with it. It need not be right, only of the picture's size.
  std::optional<Lens> lens = std::nullopt;
  bool fisheye = false;  // without such a guess, make one: equidistant, 180 degrees across
  bool quick = false;  // the fast finder alone: for frames of a video, of which some may be missed
};

struct BoardDetection {
  std::optional<BoardView> view;  // without a name; corners to a fraction of a pixel
  std::string finder;             // that found it
  double time_ms = 0;
  std::string reason;  // why there is none, in words; empty if there is
};

// Looks for one board: whole chessboards, and ChArUco boards of which at least six corners are
// seen. The finders run in a helper program (platelight-detect), the fast one first, each with a
// share of the time; one that crashes or takes too long is ended and the next one tried. Corners
// are in the order of Board, never mirrored, refined without regard to the lens: refine_corners()
// does better once it is known. What is found but cannot be the board (uneven, a part of a larger
// board) is refused. Thread-safe. Throws std::invalid_argument if picture, board or options cannot
// be, and std::runtime_error if the helper cannot be run.
BoardDetection detect_board(const GreyPicture& picture,
                            const Board& board,
                            const DetectionOptions& options = {});

}  // namespace calibrate
