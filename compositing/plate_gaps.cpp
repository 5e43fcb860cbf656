// Gaps of plates, and the screen in them.
#include "compositing/plate_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "compositing/gap_filler.h"
#include "compositing/key_lanes.h"

namespace compositing {
namespace {

// Of the screen around: less of its excess is none, and so much beside its colour is another one's.
constexpr float hardly_any = 0.2F, another_colour = 0.12F;
// Of a frame's cell: closer, since green clothes are not the screen.
constexpr float same_colour = 0.08F, least_light = 0.5F, most_light = 2;

int cells_along(int side, int step) { return (side + step - 1) / step; }

// The plate's light over 8x8 pixels each, row by row.
std::vector<ScreenLight> means_of(const LitPlate& plate, int rows, int columns, int of) {
  std::vector<ScreenLight> means;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      std::array<float, 3> sum{};
      float count = 0;
      for (int r = row * of; r < std::min(plate.rows, (row + 1) * of); ++r) {
        for (int k = column * of; k < std::min(plate.columns, (column + 1) * of); ++k) {
          for (std::size_t c = 0; c < 3; ++c) sum[c] += plate.cell(r, k)[c];
          count += 1;
        }
      }
      for (float& value : sum) value /= count;
      means.push_back(ordered_light(sum, plate.colour));
    }
  }
  return means;
}

// The screen's colour; that of its median cell.
ScreenLight key_of(const std::vector<ScreenLight>& cells, ScreenColour colour) {
  const auto order = channels_of(colour);
  std::vector<Light3> some;
  for (std::size_t i = 0; i < cells.size(); i += spread_step(cells.size())) {
    Light3 light{};
    light[static_cast<std::size_t>(order[0])] = cells[i].first;
    light[static_cast<std::size_t>(order[1])] = cells[i].second;
    light[static_cast<std::size_t>(order[2])] = cells[i].third;
    some.push_back(light);
  }
  return find_key(some, colour);
}

}  // namespace

PlateGaps::PlateGaps(const LitPlate& bare, std::span<const std::uint8_t> masked)
    : height_(bare.height), width_(bare.width), colour_(bare.colour) {
  if (bare.use != PlateUse::screen) return;
  const int rows = cells_along(height_, cell), columns = cells_along(width_, cell);
  const std::vector<ScreenLight> plate = means_of(bare, rows, columns, cell / bare.step);
  const ScreenLight key = key_of(plate, colour_);
  if (key.excess <= 0) return;
  GapFiller around(rows, columns, 3);
  const auto at = [columns](int row, int column) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  };
  const auto all_about = [&](int row, int column, auto&& is) {
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
      for (int k = std::max(column - 1, 0); k <= std::min(column + 1, columns - 1); ++k) {
        if (!is(at(r, k))) return false;
      }
    }
    return true;
  };
  // What is dark dims the cells at its rim.
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (!all_about(row, column, [&](std::size_t i) { return is_screen(plate[i], key); }))
        continue;
      const ScreenLight& own = plate[at(row, column)];
      float* const to = around.value(row, column);
      to[0] = own.first, to[1] = own.second, to[2] = own.third;
      around.weight(row, column) = 1;
    }
  }
  if (!(around.fill() > 0)) return;
  std::vector<ScreenLight> screen;
  std::vector<std::uint8_t> elsewhere;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float* const light = around.value(row, column);
      screen.push_back(ordered_light({light[0], light[1], light[2]}, colour_));
      const ScreenLight& own = plate[at(row, column)];
      const bool none = own.excess < hardly_any * screen.back().excess ||
                        chroma_off(own, screen.back()) > another_colour;
      elsewhere.push_back(none ? 1 : 0);
    }
  }
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (!masked.empty() && masked[at(row, column)] != 0) continue;
      counted_ += 1;
      if (all_about(row, column, [&](std::size_t i) { return elsewhere[i] != 0; }))
        gaps_.push_back({row, column, screen[at(row, column)]});
    }
  }
}

// By two rows of each cell.
template <class Rows>
float PlateGaps::look(const Rows& frame, float gain) const {
  float shown = 0;
  for (const Gap& gap : gaps_) {
    const int count = std::min(cell, width_ - gap.column * cell);
    std::array<float, 3> sum{};
    for (const int y : {gap.row * cell + 2, gap.row * cell + 5}) {
      std::array<F8, 3> c;
      frame.load(std::min(y, height_ - 1), gap.column * cell, count, c);
      for (std::size_t i = 0; i < 3; ++i) {
        for (int x = 0; x < count; ++x) sum[i] += c[i][x];
      }
    }
    const float over = 0.5F / (static_cast<float>(count) * gain);
    for (float& value : sum) value *= over;
    const ScreenLight seen = ordered_light(sum, colour_);
    const bool lit = seen.excess >= least_light * gap.screen.excess &&
                     seen.excess <= most_light * gap.screen.excess;
    if (lit && chroma_off(seen, gap.screen) < same_colour) shown += 1;
  }
  return counted_ > 0 ? shown / counted_ : 0;
}

template float PlateGaps::look(const LightRows& frame, float gain) const;
template float PlateGaps::look(const CodeRows& frame, float gain) const;

}  // namespace compositing
