// Values on a grid where only some are known, made whole from what surrounds the gaps.
#pragma once

#include <cstddef>
#include <vector>

namespace compositing {

// Halves the grid until one cell is left, then gives each cell as much of the coarser level as it
// lacks weight. Keeps its memory.
//
// Gortler et al., "The Lumigraph", SIGGRAPH 1996, section 3.3.2 (pull-push), with a bilinear way
// back.
class GapFiller {
 public:
  // Throws std::invalid_argument unless all are at least 1.
  GapFiller(int rows, int columns, int channels);

  int rows() const { return levels_.front().rows; }
  int columns() const { return levels_.front().columns; }
  int channels() const { return channels_; }

  // (rows, columns, channels): values times weight, to be set before fill(); after it, values.
  float* value(int row, int column) {
    return &levels_.front().values[at(levels_.front(), row, column)];
  }
  const float* value(int row, int column) const {
    return &levels_.front().values[at(levels_.front(), row, column)];
  }
  // 0 unknown to 1 known.
  float& weight(int row, int column) {
    const Level& level = levels_.front();
    return levels_.front().weights[cell(level, row, column)];
  }
  void clear();

  // Returns the sum of weights. With none at all, values stay 0.
  float fill();

 private:
  struct Level {
    int rows = 0;
    int columns = 0;
    std::vector<float> values;
    std::vector<float> weights;
  };
  static std::size_t cell(const Level& level, int row, int column) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(level.columns) +
           static_cast<std::size_t>(column);
  }
  std::size_t at(const Level& level, int row, int column) const {
    return cell(level, row, column) * static_cast<std::size_t>(channels_);
  }
  void pull(const Level& fine, Level& coarse) const;
  void push(const Level& coarse, Level& fine) const;

  std::vector<Level> levels_;
  int channels_;
};

}  // namespace compositing
