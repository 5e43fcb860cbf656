// Which marker of a ChArUco board is where, and where its corners are by the markers seen.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "calibrate/board.h"

namespace calibrate {

// A square of a board: of (columns + 1, rows + 1), from the top left one.
struct Square {
  int column = 0;
  int row = 0;
  friend bool operator==(const Square&, const Square&) = default;
};

// Whose colour the board's first square is. Black is how OpenCV draws boards since 4.7, and how we
// do; before, it drew boards with an even number of rows of squares with a white one.
enum class FirstSquare { black, white };

// The white squares row by row: where the markers 0, 1, 2... are.
std::vector<Square> marker_squares(const Board& board, FirstSquare first = FirstSquare::black);

// A marker in a picture.
struct SeenMarker {
  int id = 0;
  std::array<Vec2, 4> corners;  // pixels, clockwise from the marker's own top left
};

// The corners next to markers, in either kind of board, to about a pixel: refine them. A marker
// counts only if it agrees with one across a corner, so that what only looks like a marker does no
// harm. No corners if there are none such.
BoardView corners_of_markers(const Board& board, std::span<const SeenMarker> markers);

}  // namespace calibrate
