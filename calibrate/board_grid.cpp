// Order, evenness, colours and edges of grids of corners.
#include "calibrate/board_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace calibrate {
namespace {

// Between the steps to one side and to the other, by the longer: at the rim of a fish-eye squares
// shrink quickly.
constexpr double max_jump = 0.6;
constexpr double min_alternating = 0.9;  // share of neighbouring squares
// Of the squares beyond a side: how many neighbours alternate, and how much they do.
constexpr double min_going_on = 0.8;
constexpr double min_contrast_beyond = 0.2;

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

// Between neighbouring squares, codes.
double contrast_of(const GreyPicture& picture, const Grid& grid) {
  double sum = 0;
  int pairs = 0;
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int column = 0; column + 2 < grid.columns; ++column) {
      const auto here = square_code(picture, grid, column, row);
      const auto next = square_code(picture, grid, column + 1, row);
      if (!here || !next) continue;
      sum += std::abs(*here - *next);
      ++pairs;
    }
  }
  return pairs == 0 ? 0 : sum / pairs;
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

bool ends_early(const Board& board, const BoardView& view) {
  const Grid grid(board, view);
  const auto is_missing = [&](int column, int row, int dx, int dy, int count) {
    int seen = 0;
    for (int i = 0; i < count; ++i) seen += grid.at(column + i * dx, row + i * dy) ? 1 : 0;
    return 2 * seen < count;
  };
  return is_missing(0, 0, 0, 1, grid.rows) || is_missing(grid.columns - 1, 0, 0, 1, grid.rows) ||
         is_missing(0, 0, 1, 0, grid.columns) || is_missing(0, grid.rows - 1, 1, 0, grid.columns);
}

bool goes_on(const GreyPicture& picture, const Board& board, const BoardView& view) {
  constexpr int rings = 2;  // of corners beyond, by parabolas through the last three
  Board wider = board;
  wider.columns += 2 * rings;
  wider.rows += 2 * rings;
  BoardView ringed{"", std::vector<std::optional<Vec2>>(wider.corner_count())};
  const Grid grid(board, view);
  const auto place = [&](int column, int row) -> std::optional<Vec2>& {
    return ringed.corners[static_cast<std::size_t>((row + rings) * wider.columns + column + rings)];
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      place(column, row) = grid.at(column, row);
    }
  }
  const auto extend = [&](int column, int row, int dx, int dy) {
    const auto& last = grid.at(column, row);
    const auto& second = grid.at(column - dx, row - dy);
    const auto& third = grid.at(column - 2 * dx, row - 2 * dy);
    if (!last || !second || !third) return;
    const auto mix = [&](double a, double b, double c) {
      return Vec2{a * last->x + b * second->x + c * third->x,
                  a * last->y + b * second->y + c * third->y};
    };
    place(column + dx, row + dy) = mix(3, -3, 1);
    place(column + 2 * dx, row + 2 * dy) = mix(6, -8, 3);
  };
  const int right = grid.columns - 1;
  const int bottom = grid.rows - 1;
  for (int row = 0; row < grid.rows; ++row) {
    extend(0, row, -1, 0);
    extend(right, row, 1, 0);
  }
  for (int column = 0; column < grid.columns; ++column) {
    extend(column, 0, 0, -1);
    extend(column, bottom, 0, 1);
  }
  // The squares beyond the last ones of the board.
  const Grid wide(wider, ringed);
  const double sign = first_dark_share(picture, grid) > 0.5 ? 1 : -1;
  const double contrast = contrast_of(picture, grid);
  const auto alternate = [&](int column, int row, int dx, int dy, int count) {
    int pairs = 0;
    int right_way = 0;
    for (int i = 0; i + 1 < count; ++i) {
      const int x = column + i * dx;
      const int y = row + i * dy;
      const auto here = square_code(picture, wide, x, y);
      const auto next = square_code(picture, wide, x + dx, y + dy);
      if (!here || !next) continue;
      const double rise = sign * (*next - *here) * ((x + y) % 2 == 0 ? 1 : -1);
      ++pairs;
      right_way += rise > min_contrast_beyond * contrast ? 1 : 0;
    }
    return 2 * pairs >= count && right_way >= min_going_on * pairs;
  };
  return alternate(0, rings, 0, 1, bottom) || alternate(right + rings + 1, rings, 0, 1, bottom) ||
         alternate(rings, 0, 1, 0, right) || alternate(rings, bottom + rings + 1, 1, 0, right);
}

}  // namespace calibrate
