// Corners to a fraction of a pixel.
#pragma once

#include "calibrate/board.h"
#include "calibrate/grey_picture.h"
#include "calibrate/lens.h"

namespace calibrate {

// Moves every corner of `view` to the saddle of the picture around it. Corners that do not look
// like one (no contrast, squares of fewer than 5 pixels, beyond the picture, a saddle too far away)
// are dropped. Throws std::invalid_argument if the view has not the board's number of corners.
//
// Foerstner and Guelch, "A Fast Operator for Detection and Precise Location of Distinct Points,
// Corners and Centres of Circular Features", ISPRS Intercommission Conference 1987: the point that
// the edges around it meet in. The window is round, fades out, and reaches no further than 0.4 of
// the way to the nearest corner (in a ChArUco board, to the marker's inside). A saddle must look
// the same turned by 180 degrees, and not by 90.
BoardView refine_corners(const GreyPicture& picture, const BoardView& view, const Board& board);

// The same where the lens is known, if roughly: on the plane across each corner's ray, where edges
// are straight also at the rim of a fish-eye, sampled as finely as the picture's finer axis there.
// Throws std::invalid_argument also if the lens is not of the picture's size.
BoardView refine_corners(const GreyPicture& picture,
                         const BoardView& view,
                         const Board& board,
                         const Lens& lens);

}  // namespace calibrate
