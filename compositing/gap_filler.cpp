// Pull-push.
#include "compositing/gap_filler.h"

#include <algorithm>
#include <stdexcept>

namespace compositing {

GapFiller::GapFiller(int rows, int columns, int channels) : channels_(channels) {
  if (rows < 1 || columns < 1 || channels < 1) {
    throw std::invalid_argument("a grid has at least one row, column and channel");
  }
  while (true) {
    const std::size_t cells = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    levels_.push_back({rows, columns,
                       std::vector<float>(cells * static_cast<std::size_t>(channels)),
                       std::vector<float>(cells)});
    if (rows == 1 && columns == 1) break;
    rows = (rows + 1) / 2, columns = (columns + 1) / 2;
  }
}

void GapFiller::clear() {
  std::fill(levels_.front().values.begin(), levels_.front().values.end(), 0.0F);
  std::fill(levels_.front().weights.begin(), levels_.front().weights.end(), 0.0F);
}

// Means over 2x2, weighted; a coarse cell is certain as soon as one of its four is.
void GapFiller::pull(const Level& fine, Level& coarse) const {
  const auto channels = static_cast<std::size_t>(channels_);
  for (int row = 0; row < coarse.rows; ++row) {
    int column = 0;
    if (channels == 1 && 2 * row + 1 < fine.rows) {
      const std::size_t from = cell(fine, 2 * row, 0), below = cell(fine, 2 * row + 1, 0);
      const std::size_t to = cell(coarse, row, 0);
      for (; 2 * column + 1 < fine.columns; ++column) {
        const auto i = static_cast<std::size_t>(column);
        const auto sum = [&](const std::vector<float>& of) {
          return of[from + 2 * i] + of[from + 2 * i + 1] + of[below + 2 * i] +
                 of[below + 2 * i + 1];
        };
        const float weight = sum(fine.weights), scale = weight > 1 ? 1 / weight : 1;
        coarse.values[to + i] = sum(fine.values) * scale;
        coarse.weights[to + i] = weight * scale;
      }
    }
    for (; column < coarse.columns; ++column) {
      float* to = &coarse.values[at(coarse, row, column)];
      std::fill_n(to, channels, 0.0F);
      float weight = 0;
      for (int part = 0; part < 4; ++part) {
        const int r = 2 * row + part / 2, c = 2 * column + part % 2;
        if (r >= fine.rows || c >= fine.columns) continue;
        const float* from = &fine.values[at(fine, r, c)];
        for (std::size_t k = 0; k < channels; ++k) to[k] += from[k];
        weight += fine.weights[cell(fine, r, c)];
      }
      const float scale = weight > 1 ? 1 / weight : 1;
      for (std::size_t k = 0; k < channels; ++k) to[k] *= scale;
      coarse.weights[cell(coarse, row, column)] = weight * scale;
    }
  }
}

void GapFiller::push(const Level& coarse, Level& fine) const {
  const auto channels = static_cast<std::size_t>(channels_);
  for (int row = 0; row < fine.rows; ++row) {
    for (int column = 0; column < fine.columns; ++column) {
      float& weight = fine.weights[cell(fine, row, column)];
      if (weight >= 1) continue;
      float* to = &fine.values[at(fine, row, column)];
      // Fine cell centres lie a quarter of a coarse cell off the coarse centres.
      const int r0 = row / 2, c0 = column / 2;
      const int r1 = std::clamp(row % 2 == 0 ? r0 - 1 : r0 + 1, 0, coarse.rows - 1);
      const int c1 = std::clamp(column % 2 == 0 ? c0 - 1 : c0 + 1, 0, coarse.columns - 1);
      const float* a = &coarse.values[at(coarse, r0, c0)];
      const float* b = &coarse.values[at(coarse, r0, c1)];
      const float* c = &coarse.values[at(coarse, r1, c0)];
      const float* d = &coarse.values[at(coarse, r1, c1)];
      for (std::size_t k = 0; k < channels; ++k) {
        const float around = 0.5625F * a[k] + 0.1875F * (b[k] + c[k]) + 0.0625F * d[k];
        to[k] += (1 - weight) * around;
      }
      weight = 1;
    }
  }
}

float GapFiller::fill() {
  float sum = 0;
  for (const float weight : levels_.front().weights) sum += weight;
  if (sum <= 0) return 0;
  for (std::size_t i = 1; i < levels_.size(); ++i) pull(levels_[i - 1], levels_[i]);
  Level& top = levels_.back();
  for (float& value : top.values) value /= top.weights[0];
  top.weights[0] = 1;
  for (std::size_t i = levels_.size() - 1; i > 0; --i) push(levels_[i], levels_[i - 1]);
  return sum;
}

}  // namespace compositing
