// Pictures of boards through any lens, by casting rays, with the truth about their corners.
#pragma once

#include <optional>
#include <random>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"

namespace calibrate {

// What a camera makes of a board before its sensor does anything.
struct MadeBoardView {
  double blur_px = 0.7;  // standard deviation of the optics' blur
  double motion_px = 0;  // length of a smear along motion_rad
  double motion_rad = 0.5;
  double black = 0.04;  // radiance of its squares
  double white = 0.8;
};

// cam_from_board of a board tilted by up to `tilt_rad` about both of its own axes and turned by up
// to `spin_rad` about its normal, whose middle is at this distance in this direction (any length,
// not along y) from the camera.
Pose make_board_pose(const Board& board,
                     Vec3 direction,
                     double distance_m,
                     double tilt_rad,
                     double spin_rad,
                     std::mt19937& random);

// Where the corners really are; nothing where the lens does not show them.
std::vector<std::optional<Vec2>> true_corners(const Board& board,
                                              const Pose& cam_from_board,
                                              const Lens& lens);

// The board, with a white border of one square, before `room`, (height, width, channels), which is
// as the camera sees it: 3x3 rays a pixel, then the board's blur. `directions` are the lens's.
// Throws std::invalid_argument if sizes differ or the board cannot be.
capture::Image photograph_board(const Board& board,
                                const Pose& cam_from_board,
                                const Lens& lens,
                                const DirectionTable& directions,
                                const capture::Image& room,
                                const MadeBoardView& view = {});

}  // namespace calibrate
