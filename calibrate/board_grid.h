// Whether points found in a picture can be a board's corners, and in which order.
#pragma once

#include <string>

#include "calibrate/board.h"
#include "calibrate/grey_picture.h"

namespace calibrate {

// Brings the corners of a chessboard, all found, into the order of a board seen from its front
// (never mirrored), its first square (left of and above the first corner) black. Boards that look
// the same turned keep one of the orders that fit.
void order_corners(const GreyPicture& picture, const Board& board, BoardView& view);

// Why corners in order cannot be the board's, in words: the grid folds, jumps, is mirrored, or (of
// a chessboard) its colours do not alternate. Empty if they can.
std::string grid_fault(const GreyPicture& picture, const Board& board, const BoardView& view);

// Whether most corners of a side of a chessboard are missing: a smaller board was taken for it.
bool ends_early(const Board& board, const BoardView& view);

// Whether a chessboard goes on where it should end: a part of a larger one was found.
bool goes_on(const GreyPicture& picture, const Board& board, const BoardView& view);

}  // namespace calibrate
