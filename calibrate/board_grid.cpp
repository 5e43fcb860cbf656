// Order, evenness, colours and edges of grids of corners.
#include "calibrate/board_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "calibrate/corner_refinement.h"

namespace calibrate {
namespace {

// Between the steps to one side and to the other, by the longer: at the rim of a fish-eye squares
// shrink quickly.
constexpr double max_jump = 0.6;
constexpr double min_alternating = 0.9;  // share of neighbouring squares
constexpr double min_going_on = 0.6;     // share of a side's corners that have one beyond

// Corners by column and row.
class Grid {
 public:
  Grid(const Board& board, const BoardView& view)
      : columns(board.columns), rows(board.rows), corners_(&view.corners) {}

  const std::optional<Vec2>& at(int column, int row) const {
    return (*corners_)[static_cast<std::size_t>(row * columns + column)];
  }

  const int columns;
  const int rows;

 private:
  const std::vector<std::optional<Vec2>>* corners_;
};

Vec2 minus(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
double cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }
double length(Vec2 a) { return hypotenuse(a.x, a.y); }

// Twice the signed area of the corner of a square, positive if not mirrored; nothing if not seen.
std::optional<double> turn_at(const Grid& grid, int column, int row, int dx, int dy) {
  const auto& p = grid.at(column, row);
  const auto& beside = grid.at(column + dx, row);
  const auto& below = grid.at(column, row + dy);
  if (!p || !beside || !below) return std::nullopt;
  return dx * dy * cross(minus(*beside, *p), minus(*below, *p));
}

template <class Visit>
void for_each_turn(const Grid& grid, Visit visit) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      for (const auto& [dx, dy] :
           {std::pair{1, 1}, std::pair{-1, 1}, std::pair{1, -1}, std::pair{-1, -1}}) {
        if (column + dx < 0 || column + dx >= grid.columns) continue;
        if (row + dy < 0 || row + dy >= grid.rows) continue;
        if (const auto turn = turn_at(grid, column, row, dx, dy)) visit(*turn);
      }
    }
  }
}

bool jumps(const std::optional<Vec2>& a,
           const std::optional<Vec2>& b,
           const std::optional<Vec2>& c) {
  if (!a || !b || !c) return false;
  const Vec2 to = minus(*b, *a);
  const Vec2 on = minus(*c, *b);
  return !(length(minus(on, to)) <= max_jump * std::max(length(to), length(on)));
}

bool jumps(const Grid& grid) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const auto& p = grid.at(column, row);
      if (column + 2 < grid.columns &&
          jumps(p, grid.at(column + 1, row), grid.at(column + 2, row))) {
        return true;
      }
      if (row + 2 < grid.rows && jumps(p, grid.at(column, row + 1), grid.at(column, row + 2))) {
        return true;
      }
    }
  }
  return false;
}

// The mean code within the square right of and below a corner, if all its corners were seen.
std::optional<float> square_code(const GreyPicture& picture,
                                 const Grid& grid,
                                 int column,
                                 int row) {
  const std::array corners{grid.at(column, row), grid.at(column + 1, row), grid.at(column, row + 1),
                           grid.at(column + 1, row + 1)};
  Vec2 middle{0, 0};
  for (const auto& q : corners) {
    if (!q) return std::nullopt;
    middle = {middle.x + q->x / 4, middle.y + q->y / 4};
  }
  float sum = value_at(picture, middle);
  for (const auto& q : corners) {
    sum += value_at(picture, {(middle.x + q->x) / 2, (middle.y + q->y) / 2});
  }
  return sum / 5;
}

// By which share of neighbours within the board the first square's kind is the darker.
double first_dark_share(const GreyPicture& picture, const Grid& grid) {
  int pairs = 0;
  int dark = 0;
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int column = 0; column + 1 < grid.columns; ++column) {
      const auto here = square_code(picture, grid, column, row);
      const auto compare = [&](const std::optional<float>& other) {
        if (!here || !other) return;
        // The square right of and below corner (0, 0) is of the first square's colour.
        const bool first_kind = (column + row) % 2 == 0;
        ++pairs;
        dark += (*here < *other) == first_kind && *here != *other ? 1 : 0;
      };
      if (column + 2 < grid.columns) compare(square_code(picture, grid, column + 1, row));
      if (row + 2 < grid.rows) compare(square_code(picture, grid, column, row + 1));
    }
  }
  return pairs == 0 ? 0 : static_cast<double>(dark) / pairs;
}

bool first_is_dark(const GreyPicture& picture, const Board& board, const BoardView& view) {
  return first_dark_share(picture, Grid(board, view)) > 0.5;
}

void turn_half(BoardView& view) { std::ranges::reverse(view.corners); }

// A quarter to the right, of a board with as many rows as columns.
void turn_quarter(const Board& board, BoardView& view) {
  const Grid grid(board, view);
  std::vector<std::optional<Vec2>> turned;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      turned.push_back(grid.at(row, board.rows - 1 - column));
    }
  }
  view.corners = std::move(turned);
}

}  // namespace

void order_corners(const GreyPicture& picture, const Board& board, BoardView& view) {
  double turn = 0;
  for_each_turn(Grid(board, view), [&](double t) { turn += t; });
  if (turn < 0) {
    for (auto row = view.corners.begin(); row != view.corners.end(); row += board.columns) {
      std::reverse(row, row + board.columns);
    }
  }
  if (first_is_dark(picture, board, view)) return;
  if ((board.columns + board.rows) % 2 != 0) {
    turn_half(view);
  } else if (board.columns == board.rows && board.columns % 2 != 0) {
    turn_quarter(board, view);
  }
}

std::string grid_fault(const GreyPicture& picture, const Board& board, const BoardView& view) {
  const Grid grid(board, view);
  int turns = 0;
  int wrong = 0;
  for_each_turn(grid, [&](double turn) {
    ++turns;
    wrong += turn > 0 ? 0 : 1;
  });
  if (turns == 0) return "too few neighbouring corners";
  if (wrong == turns) return "the board is mirrored";
  if (wrong > 0) return "the corners fold over";
  if (jumps(grid)) return "the corners are not even";
  if (board.kind == Board::Kind::chessboard) {
    const double share = first_dark_share(picture, grid);
    if (std::max(share, 1 - share) < min_alternating) return "the squares do not alternate";
  }
  return "";
}

bool goes_on(const GreyPicture& picture, const Board& board, const BoardView& view) {
  const Grid grid(board, view);
  Board wider = board;
  wider.columns += 2;
  wider.rows += 2;
  BoardView ringed{"", std::vector<std::optional<Vec2>>(wider.corner_count())};
  const auto place = [&](int column, int row) -> std::optional<Vec2>& {
    return ringed.corners[static_cast<std::size_t>((row + 1) * wider.columns + column + 1)];
  };
  const auto beyond = [](const std::optional<Vec2>& end, const std::optional<Vec2>& second,
                         const std::optional<Vec2>& third) -> std::optional<Vec2> {
    if (!end || !second || !third) return std::nullopt;
    return Vec2{3 * (end->x - second->x) + third->x, 3 * (end->y - second->y) + third->y};
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      place(column, row) = grid.at(column, row);
    }
  }
  const int right = grid.columns - 1;
  const int bottom = grid.rows - 1;
  for (int row = 0; row < grid.rows; ++row) {
    place(-1, row) = beyond(grid.at(0, row), grid.at(1, row), grid.at(2, row));
    place(right + 1, row) =
        beyond(grid.at(right, row), grid.at(right - 1, row), grid.at(right - 2, row));
  }
  for (int column = 0; column < grid.columns; ++column) {
    place(column, -1) = beyond(grid.at(column, 0), grid.at(column, 1), grid.at(column, 2));
    place(column, bottom + 1) =
        beyond(grid.at(column, bottom), grid.at(column, bottom - 1), grid.at(column, bottom - 2));
  }
  ringed = refine_corners(picture, ringed, wider);
  const auto seen_along = [&](int column, int row, int dx, int dy, int count) {
    int seen = 0;
    for (int i = 0; i < count; ++i) seen += place(column + i * dx, row + i * dy) ? 1 : 0;
    return seen >= min_going_on * count;
  };
  return seen_along(-1, 0, 0, 1, grid.rows) || seen_along(right + 1, 0, 0, 1, grid.rows) ||
         seen_along(0, -1, 1, 0, grid.columns) || seen_along(0, bottom + 1, 1, 0, grid.columns);
}

}  // namespace calibrate
