// Means of cells, each row of the picture read once.
#include "capture/thumbnail.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

// The first pixel of a cell.
int edge(int i, int count, int size) { return static_cast<int>(std::int64_t{i} * size / count); }

// The same of rows: the first and the last have one of the picture each.
int row_edge(int i, int count, int size) {
  if (count < 3 || i == 0) return edge(i, count, size);
  return i == count ? size : 1 + edge(i - 1, count - 2, size - 2);
}

// Independent values in so many pixels: interpolated colours of neighbours are not, so four of them
// count as one.
double independent_of(double pixels) { return std::max(1.0, pixels / 4); }

// Sums and extremes of a few rows, by column: each row is read once, all columns side by side.
class Columns {
 public:
  explicit Columns(std::size_t size) : sum_(size), least_(size), most_(size) {}

  void set(const Image& image, int first, int end) {
    std::ranges::fill(sum_, 0.0F);
    std::ranges::fill(least_, infinite);
    std::ranges::fill(most_, -infinite);
    int y = first;
    for (; y + 1 < end; y += 2) add(&image.pixels[image.index(y, 0)], sum_.size());
    if (y < end) add(&image.pixels[image.index(y, 0)], 0);
  }

  // The rows' sum, as the mean over every `step`th column; NaN if some reach the limit, but not
  // all.
  float mean(std::size_t first, std::size_t end, std::size_t step, float limit) const {
    double sum = 0;
    float least = infinite;
    float most = -infinite;
    int count = 0;
    for (std::size_t i = first; i < end; i += step, ++count) {
      sum += sum_[i];
      least = std::min(least, least_[i]);
      most = std::max(most, most_[i]);
    }
    return most >= limit && least < limit ? std::numeric_limits<float>::quiet_NaN()
                                          : static_cast<float>(sum / count);
  }

 private:
  // Adds a row, and the one that is so many values later.
  void add(const float* row, std::size_t later) {
    float* sum = sum_.data();
    float* least = least_.data();
    float* most = most_.data();
    const std::size_t size = sum_.size();
    for (std::size_t i = 0; i < size; ++i) {
      const float a = row[i];
      const float b = row[i + later];
      sum[i] += later > 0 ? a + b : a;
      const float low = a < b ? a : b;
      const float high = a > b ? a : b;
      least[i] = low < least[i] ? low : least[i];
      most[i] = high > most[i] ? high : most[i];
    }
  }

  std::vector<float> sum_, least_, most_;
};

}  // namespace

Thumbnail thumbnail_of(const Image& image, int rows, int columns, double saturation) {
  if (image.empty() || rows < 1 || columns < 1) {
    throw std::invalid_argument("a thumbnail needs a picture, rows and columns");
  }
  Thumbnail thumbnail{
      std::min(rows, image.height), std::min(columns, image.width), image.channels, {}};
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto limit = static_cast<float>(saturation);
  const double width = static_cast<double>(image.width) / thumbnail.columns;
  thumbnail.edge_variance = static_cast<float>(
      independent_of(width * image.height / thumbnail.rows) / independent_of(width));
  thumbnail.values.reserve(static_cast<std::size_t>(thumbnail.rows) * thumbnail.row_size());
  Columns of_rows(image.index(1, 0));
  for (int row = 0; row < thumbnail.rows; ++row) {
    const int first = row_edge(row, thumbnail.rows, image.height);
    const int end = row_edge(row + 1, thumbnail.rows, image.height);
    of_rows.set(image, first, end);
    for (int column = 0; column < thumbnail.columns; ++column) {
      const int left = edge(column, thumbnail.columns, image.width);
      const int right = edge(column + 1, thumbnail.columns, image.width);
      for (std::size_t c = 0; c < channels; ++c) {
        thumbnail.values.push_back(
            of_rows.mean(image.index(0, left) + c, image.index(0, right) + c, channels, limit) /
            static_cast<float>(end - first));
      }
    }
  }
  return thumbnail;
}

NoiseModel noise_of_thumbnail(
    const NoiseModel& noise, int width, int height, int rows, int columns) {
  const double cells = static_cast<double>(std::min(rows, height)) * std::min(columns, width);
  const double independent = independent_of(static_cast<double>(width) * height / cells);
  NoiseModel of_means = noise;
  of_means.read /= independent;
  of_means.shot /= independent;
  return of_means;
}

}  // namespace capture
