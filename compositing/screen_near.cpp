// Distances to the screen, and what lies between cells.
#include "compositing/screen_near.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace compositing {
namespace {

// A place between cells' centres.
struct Place {
  int before, after;
  float share;  // of the one after
};
Place place_of(int pixel, int cells) {
  const float at = std::clamp((static_cast<float>(pixel) + 0.5F) / ScreenNear::cell - 0.5F, 0.0F,
                              static_cast<float>(cells - 1));
  const int before = static_cast<int>(at);
  return {before, std::min(before + 1, cells - 1), at - static_cast<float>(before)};
}

// Which cells are as all that are around them.
void find_even(ScreenNear& near) {
  const auto width = static_cast<std::size_t>(near.columns);
  near.even.assign(near.cells.size(), 0);
  for (int row = 0; row < near.rows; ++row) {
    const auto at = [&](int r) {
      return near.cells.data() + static_cast<std::size_t>(std::clamp(r, 0, near.rows - 1)) * width;
    };
    const float *above = at(row - 1), *here = at(row), *below = at(row + 1);
    std::uint8_t* even = near.even.data() + static_cast<std::size_t>(row) * width;
    const auto alike = [&](std::size_t a, std::size_t b) {
      return static_cast<std::uint8_t>((above[a] == here[b]) & (here[a] == here[b]) &
                                       (below[a] == here[b]));
    };
    for (std::size_t i = 1; i + 1 < width; ++i)
      even[i] = alike(i - 1, i) & alike(i, i) & alike(i + 1, i);
  }
}

}  // namespace

float ScreenNear::at(int y, int x) const {
  if (cells.empty()) return 1;
  const Place row = place_of(y, rows), column = place_of(x, columns);
  const auto across = [&](int r) {
    const float* from = cells.data() + r * static_cast<std::ptrdiff_t>(columns);
    return between(from[column.before], from[column.after], column.share);
  };
  return between(across(row.before), across(row.after), row.share);
}

// Straight distances: first those within a column, by two passes; then of every cell's neighbours
// in its row, as far as it matters, the least sum of squares (Meijster et al., "A general algorithm
// for computing distance transforms in linear time", 2000, with a bound in place of its envelope).
void find_near(std::span<const float> shows, float near, float deep, ScreenNear& found) {
  const int rows = found.rows, columns = found.columns;
  const auto width = static_cast<std::ptrdiff_t>(columns);
  const int reach = static_cast<int>(std::ceil(deep));
  const float far = deep + 1;
  float* const cells = found.cells.data();
  for (std::size_t i = 0; i < shows.size(); ++i) cells[i] = shows[i] > 0 ? 0 : far;
  const auto follow = [&](float* row, const float* before) {
    for (int i = 0; i < columns; ++i) row[i] = std::min(row[i], before[i] + 1);
  };
  for (int row = 1; row < rows; ++row) follow(cells + row * width, cells + (row - 1) * width);
  for (int row = rows - 1; row-- > 0;) follow(cells + row * width, cells + (row + 1) * width);
  std::vector<float>& squares = found.squares;
  squares.assign(static_cast<std::size_t>(columns + 2 * reach), far * far);
  const float over = 1 / (deep - near);
  for (int row = 0; row < rows; ++row) {
    float* const here = cells + row * width;
    float* const middle = squares.data() + reach;
    for (int i = 0; i < columns; ++i) middle[i] = here[i] * here[i], here[i] = middle[i];
    for (int aside = 1; aside <= reach; ++aside) {
      const float* const left = middle - aside;
      const float* const right = middle + aside;
      const auto more = static_cast<float>(aside * aside);
      for (int i = 0; i < columns; ++i)
        here[i] = std::min(here[i], std::min(left[i], right[i]) + more);
    }
    for (int i = 0; i < columns; ++i)
      here[i] = std::clamp((deep - std::sqrt(here[i])) * over, 0.0F, 1.0F);
  }
  find_even(found);
}

NearRow::NearRow(const ScreenNear& near, int y) : last_(near.columns - 1) {
  const Place place = place_of(y, near.rows);
  const auto width = static_cast<std::ptrdiff_t>(near.columns);
  above_ = near.cells.data() + place.before * width;
  below_ = near.cells.data() + place.after * width;
  down_ = place.share;
  const auto row = std::min(y / ScreenNear::cell, near.rows - 1) * width;
  even_ = near.even.data() + row, nearest_ = near.cells.data() + row;
}

}  // namespace compositing
