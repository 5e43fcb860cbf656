// Flat calibration targets, and where their corners were seen.
#include "calibrate/board.h"

#include <algorithm>
#include <stdexcept>

#include "calibrate/homography.h"

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

int quarters_alike(const Board& board) {
  if (board.kind == Board::Kind::charuco || (board.columns + board.rows) % 2 != 0) return 0;
  return board.columns == board.rows && board.columns % 2 == 0 ? 1 : 2;
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

std::optional<Vec2> middle_of(const Board& board, const BoardView& view) {
  const Vec2 middle{(board.columns - 1) * board.square_m / 2,
                    (board.rows - 1) * board.square_m / 2};
  std::vector<Vec2> p_board;  // from the middle on
  std::vector<Vec2> seen;
  Vec2 low, high;
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    if (!view.corners[i]) continue;
    const Vec3 corner = corner_of(board, i);
    const Vec2 p{corner.x - middle.x, corner.y - middle.y};
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    p_board.push_back(p);
    seen.push_back(*view.corners[i]);
  }
  if (!(low.x < 0 && high.x > 0 && low.y < 0 && high.y > 0)) return std::nullopt;
  const auto picture_from_board = find_homography(p_board, seen);
  if (!picture_from_board) return std::nullopt;
  const auto& m = picture_from_board->m;
  return Vec2{m[2] / m[8], m[5] / m[8]};
}

}  // namespace calibrate
