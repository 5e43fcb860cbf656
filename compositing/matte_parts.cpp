// Connected parts of a matte, and how far from them its pixels lie.
#include "compositing/matte_parts.h"

#include <algorithm>

namespace compositing {
namespace {

constexpr int side = 3, diagonal = 4;  // thirds of a pixel
constexpr int nowhere_near = 3'000'000;

std::vector<PixelRun> runs_of(const Field& field, float level) {
  std::vector<PixelRun> runs;
  for (int y = 0; y < field.height; ++y) {
    const float* const row = field.of.data() + field.index(y, 0);
    for (int x = 0; x < field.width; ++x) {
      if (!(row[x] >= level)) continue;
      const int left = x;
      while (x + 1 < field.width && row[x + 1] >= level) ++x;
      runs.push_back({y, left, x});
    }
  }
  return runs;
}

// The least distances so far of a row, and of the one before or after it, which is finished: what
// comes to each pixel from there.
void relax_across(const int* beside, int* row, int width) {
  for (int x = 0; x < width; ++x) {
    const int corner = std::min(beside[x - 1], beside[x + 1]) + diagonal;
    row[x] = std::min(row[x], std::min(beside[x] + side, corner));
  }
}

}  // namespace

std::vector<Part> parts_of(const Field& field, float level) {
  const std::vector<PixelRun> runs = runs_of(field, level);
  // Each run's part by the first run of it that is known.
  std::vector<std::size_t> first_of(runs.size());
  const auto first_run = [&](std::size_t i) {
    while (first_of[i] != i) i = first_of[i] = first_of[first_of[i]];
    return i;
  };
  std::size_t above = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    first_of[i] = i;
    const auto [y, left, right] = runs[i];
    while (above < i &&
           (runs[above].y < y - 1 || (runs[above].y == y - 1 && runs[above].right < left - 1))) {
      ++above;
    }
    for (std::size_t j = above; j < i && runs[j].y == y - 1 && runs[j].left <= right + 1; ++j) {
      const std::size_t a = first_run(i), b = first_run(j);
      first_of[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<Part> parts;
  std::vector<std::size_t> part_of(runs.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const PixelRun run = runs[i];
    const std::size_t first = first_run(i);
    if (first == i) {
      part_of[i] = parts.size();
      parts.push_back({run.left, run.y, run.right, run.y, 0, {}});
    }
    Part& part = parts[part_of[first]];
    part.left = std::min(part.left, run.left);
    part.right = std::max(part.right, run.right);
    part.bottom = run.y;
    part.area += static_cast<std::size_t>(run.right - run.left + 1);
    part.runs.push_back(run);
  }
  return parts;
}

const Part* largest(const std::vector<Part>& parts) {
  const auto it = std::ranges::max_element(parts, {}, &Part::area);
  return it == parts.end() ? nullptr : &*it;
}

Field only(const Part& part, int height, int width) {
  Field field{
      height, width,
      std::vector<float>(static_cast<std::size_t>(height) * static_cast<std::size_t>(width))};
  for (const auto& [y, left, right] : part.runs) {
    std::fill_n(&field.at(y, left), right - left + 1, 1.0F);
  }
  return field;
}

Grid<int> thirds_to(const Field& field, float of) {
  const int height = field.height, width = field.width;
  // A column more on either side, from which nothing is near.
  const std::size_t stride = static_cast<std::size_t>(width) + 2;
  std::vector<int> padded(stride * static_cast<std::size_t>(height), nowhere_near);
  const auto row_at = [&](int y) { return &padded[static_cast<std::size_t>(y) * stride + 1]; };
  for (int y = 0; y < height; ++y) {
    const float* const from = field.of.data() + field.index(y, 0);
    int* const row = row_at(y);
    for (int x = 0; x < width; ++x) row[x] = from[x] == of ? 0 : nowhere_near;
    if (y > 0) relax_across(row_at(y - 1), row, width);
    for (int x = 1; x < width; ++x) row[x] = std::min(row[x], row[x - 1] + side);
  }
  Grid<int> thirds{height, width, {}};
  thirds.of.resize(field.of.size());
  for (int y = height - 1; y >= 0; --y) {
    int* const row = row_at(y);
    if (y + 1 < height) relax_across(row_at(y + 1), row, width);
    for (int x = width - 2; x >= 0; --x) row[x] = std::min(row[x], row[x + 1] + side);
    std::copy_n(row, width, thirds.of.data() + thirds.index(y, 0));
  }
  return thirds;
}

}  // namespace compositing
