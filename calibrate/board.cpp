// Flat calibration targets, and where their corners were seen.
#include "calibrate/board.h"

#include <algorithm>
#include <stdexcept>

namespace calibrate {
namespace {

constexpr int min_corners = 3;
constexpr int max_corners = 200;
constexpr double max_square_m = 10;

}  // namespace

void check(const Board& board) {
  if (std::min(board.columns, board.rows) < min_corners ||
      std::max(board.columns, board.rows) > max_corners) {
    throw std::invalid_argument("a board must have from 3x3 to 200x200 inner corners, not " +
                                std::to_string(board.columns) + "x" + std::to_string(board.rows));
  }
  if (!(board.square_m > 0 && board.square_m < max_square_m)) {
    throw std::invalid_argument("a board's square must be above 0 and below 10 m");
  }
  if (board.kind == Board::Kind::charuco &&
      !(board.marker_m > 0 && board.marker_m < board.square_m)) {
    throw std::invalid_argument("a ChArUco board's marker must be above 0 and below its square");
  }
}

Vec3 corner_of(const Board& board, std::size_t index) {
  const auto columns = static_cast<std::size_t>(board.columns);
  return {static_cast<double>(index % columns) * board.square_m,
          static_cast<double>(index / columns) * board.square_m, 0};
}

std::size_t count_corners(const BoardView& view) {
  return static_cast<std::size_t>(
      std::ranges::count_if(view.corners, [](const auto& corner) { return corner.has_value(); }));
}

}  // namespace calibrate
