// Views of a board that was held still: what they tell of a lens is not new.
#include "calibrate/view_groups.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace calibrate {
namespace {

constexpr double still = 0.25;  // of a square
constexpr std::size_t least_shared = 6;

// The mean distance of neighbours in a row, pixels; 0 if it shows none.
double square_px(const Board& board, const BoardView& view) {
  const auto columns = static_cast<std::size_t>(board.columns);
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i + 1 < view.corners.size(); ++i) {
    const auto& a = view.corners[i];
    const auto& b = view.corners[i + 1];
    if (i % columns + 1 == columns || !a || !b) continue;
    sum += hypotenuse(a->x - b->x, a->y - b->y);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

bool are_twins(const BoardView& a, const BoardView& b, double within_px) {
  std::size_t shared = 0;
  for (std::size_t i = 0; i < a.corners.size(); ++i) {
    if (!a.corners[i] || !b.corners[i]) continue;
    const Vec2 off{a.corners[i]->x - b.corners[i]->x, a.corners[i]->y - b.corners[i]->y};
    if (!(hypotenuse(off.x, off.y) < within_px)) return false;
    ++shared;
  }
  return shared >= least_shared && 2 * shared >= std::max(count_corners(a), count_corners(b));
}

}  // namespace

std::vector<std::size_t> view_groups(const Board& board, std::span<const BoardView> views) {
  std::vector<std::size_t> groups, firsts;
  for (std::size_t view = 0; view < views.size(); ++view) {
    const double within_px = still * square_px(board, views[view]);
    const auto first = std::ranges::find_if(
        firsts, [&](std::size_t f) { return are_twins(views[f], views[view], within_px); });
    groups.push_back(first == firsts.end() ? view : *first);
    if (first == firsts.end()) firsts.push_back(view);
  }
  return groups;
}

double twin_variance(std::span<const std::size_t> groups,
                     std::size_t corners_of_board,
                     std::span<const SeenCorner> corners,
                     std::span<const std::optional<Vec2>> missed,
                     std::span<const std::uint8_t> used) {
  struct Cluster {
    Vec2 sum;
    double squares = 0;
    double count = 0;
  };
  std::map<std::size_t, Cluster> clusters;  // by group and corner of the board
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (used[i] == 0 || !missed[i]) continue;
    Cluster& c = clusters[groups[corners[i].view] * corners_of_board + corners[i].index];
    c.sum = {c.sum.x + missed[i]->x, c.sum.y + missed[i]->y};
    c.squares += squared(*missed[i]);
    ++c.count;
  }
  double alike = 0, pairs = 0, squares = 0, count = 0;
  for (const auto& [place, c] : clusters) {
    alike += squared(c.sum) - c.squares;
    pairs += c.count * (c.count - 1);
    squares += c.squares;
    count += c.count;
  }
  if (!(pairs > 0 && squares > 0)) return 1;
  const double correlation = std::clamp((alike / pairs) / (squares / count), 0.0, 1.0);
  return 1 + correlation * pairs / count;
}

}  // namespace calibrate
