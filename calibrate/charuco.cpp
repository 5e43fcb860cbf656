// Layout of ChArUco boards.
#include "calibrate/charuco.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace calibrate {
namespace {

constexpr double max_disagreement = 0.25;  // of a square

// A corner of the board as one marker has it.
struct Guess {
  std::size_t marker = 0;
  Vec2 q;
  double square_px = 0;
};

Vec2 minus(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }

// Where a point of the unit square is in a picture of it: Heckbert, "Fundamentals of Texture
// Mapping and Image Warping", master's thesis, Berkeley 1989, section 2.2.3.
class SquareView {
 public:
  explicit SquareView(const std::array<Vec2, 4>& corners) : origin_(corners[0]) {
    const auto& [p0, p1, p2, p3] = corners;
    const Vec2 sum{p0.x - p1.x + p2.x - p3.x, p0.y - p1.y + p2.y - p3.y};
    const Vec2 d1 = minus(p1, p2);
    const Vec2 d2 = minus(p3, p2);
    const double determinant = d1.x * d2.y - d1.y * d2.x;
    g_ = (sum.x * d2.y - sum.y * d2.x) / determinant;
    h_ = (d1.x * sum.y - d1.y * sum.x) / determinant;
    across_ = {p1.x - p0.x + g_ * p1.x, p1.y - p0.y + g_ * p1.y};
    down_ = {p3.x - p0.x + h_ * p3.x, p3.y - p0.y + h_ * p3.y};
  }
  Vec2 at(double u, double v) const {
    const double w = 1 + g_ * u + h_ * v;
    return {(origin_.x + across_.x * u + down_.x * v) / w,
            (origin_.y + across_.y * u + down_.y * v) / w};
  }

 private:
  Vec2 origin_, across_, down_;
  double g_ = 0, h_ = 0;
};

double mean_side(const std::array<Vec2, 4>& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 side = minus(corners[(i + 1) % 4], corners[i]);
    sum += hypotenuse(side.x, side.y);
  }
  return sum / 4;
}

// Every corner of the board as the markers around it have it.
std::vector<std::vector<Guess>> guesses_of(const Board& board,
                                           std::span<const SeenMarker> markers,
                                           FirstSquare first) {
  const std::vector<Square> squares = marker_squares(board, first);
  const double gap = (board.square_m - board.marker_m) / 2 / board.marker_m;  // of a marker
  std::vector<std::vector<Guess>> guesses(board.corner_count());
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const auto& [id, corners] = markers[i];
    if (id < 0 || static_cast<std::size_t>(id) >= squares.size()) continue;
    const Square square = squares[static_cast<std::size_t>(id)];
    const SquareView view(corners);
    const double square_px = mean_side(corners) * board.square_m / board.marker_m;
    for (int dy = 0; dy <= 1; ++dy) {
      for (int dx = 0; dx <= 1; ++dx) {
        const int column = square.column + dx - 1;
        const int row = square.row + dy - 1;
        if (column < 0 || row < 0 || column >= board.columns || row >= board.rows) continue;
        const Vec2 q = view.at(dx == 0 ? -gap : 1 + gap, dy == 0 ? -gap : 1 + gap);
        if (!std::isfinite(q.x) || !std::isfinite(q.y)) continue;
        guesses[static_cast<std::size_t>(row * board.columns + column)].push_back(
            {i, q, square_px});
      }
    }
  }
  return guesses;
}

bool agree(const Guess& a, const Guess& b) {
  const Vec2 d = minus(a.q, b.q);
  return hypotenuse(d.x, d.y) <= max_disagreement * std::max(a.square_px, b.square_px);
}

// What the markers say if the board has this layout.
struct Reading {
  std::size_t trusted = 0;  // markers that agree with one across a corner
  BoardView view;
};

Reading read_as(const Board& board, std::span<const SeenMarker> markers, FirstSquare first) {
  const auto guesses = guesses_of(board, markers, first);
  std::vector<bool> trusted(markers.size(), false);
  for (const auto& of_corner : guesses) {
    for (const Guess& a : of_corner) {
      for (const Guess& b : of_corner) {
        if (a.marker == b.marker || markers[a.marker].id == markers[b.marker].id) continue;
        if (agree(a, b)) trusted[a.marker] = true;
      }
    }
  }
  Reading reading{static_cast<std::size_t>(std::ranges::count(trusted, true)),
                  {"", std::vector<std::optional<Vec2>>(board.corner_count())}};
  for (std::size_t i = 0; i < guesses.size(); ++i) {
    Vec2 sum{0, 0};
    int count = 0;
    for (const Guess& guess : guesses[i]) {
      if (!trusted[guess.marker]) continue;
      sum = {sum.x + guess.q.x, sum.y + guess.q.y};
      ++count;
    }
    if (count > 0) reading.view.corners[i] = Vec2{sum.x / count, sum.y / count};
  }
  return reading;
}

}  // namespace

std::vector<Square> marker_squares(const Board& board, FirstSquare first) {
  std::vector<Square> squares;
  for (int row = 0; row <= board.rows; ++row) {
    for (int column = 0; column <= board.columns; ++column) {
      const bool like_first = (column + row) % 2 == 0;
      if (like_first == (first == FirstSquare::white)) squares.push_back({column, row});
    }
  }
  return squares;
}

BoardView corners_of_markers(const Board& board, std::span<const SeenMarker> markers) {
  Reading black = read_as(board, markers, FirstSquare::black);
  // With an odd number of columns of squares both layouts differ by a column only, which few
  // markers tell apart.
  Reading white = read_as(board, markers, FirstSquare::white);
  return white.trusted > black.trusted ? white.view : black.view;
}

}  // namespace calibrate
