// Flat calibration targets, and where their corners were seen.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/vec.h"

namespace calibrate {

// A chessboard, or a ChArUco board (a chessboard with a marker in each white square). Its corners
// are those where four squares meet; they are counted row by row from the top left one, as seen
// from the front. Frame `board`: the first corner at the origin, x along the rows, y down the
// columns, z away from the viewer.
struct Board {
  enum class Kind { chessboard, charuco };
  Kind kind = Kind::chessboard;
  int columns = 0;  // of corners: one less than of squares
  int rows = 0;
  double square_m = 0;
  // ChArUco only.
  double marker_m = 0;                      // side of a marker, below square_m
  std::string dictionary = "DICT_5X5_100";  // OpenCV's name of the set of markers

  std::size_t corner_count() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  friend bool operator==(const Board&, const Board&) = default;
};

// Throws std::invalid_argument: fewer than 3x3 or more than 200x200 corners, a square that is not
// above 0 and below 10 m, a marker that does not fit into it.
void check(const Board& board);

// The least turn, in quarters, after which a picture of the board looks the same, so that corners
// may be counted from elsewhere: 2, of squares of an even number of corners 1; 0 = none.
int quarters_alike(const Board& board);

// A corner in the board's frame, metres, if the board is flat.
Vec3 corner_of(const Board& board, std::size_t index);

// A board in one picture.
struct BoardView {
  std::string name;                          // of the picture, for reports
  std::vector<std::optional<Vec2>> corners;  // pixels; nothing where a corner was not seen
};

// How many corners were seen.
std::size_t count_corners(const BoardView& view);

// Where the middle of all the board's corners lies in the picture, whichever of them were seen: by
// their homography. Nothing unless some were seen on either side of it, along rows and columns.
std::optional<Vec2> middle_of(const Board& board, const BoardView& view);

}  // namespace calibrate
