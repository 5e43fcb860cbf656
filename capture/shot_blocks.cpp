// Two-way analysis of variance, sites by shots, block by block.
#include "capture/shot_blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace capture {
namespace {

// Sites of one colour: every `step`-th of every `step`-th row.
struct Plane {
  int colour = 0;
  int x = 0;
  int y = 0;
  int step = 1;
};

std::vector<Plane> planes_of(const SensorShot& shot) {
  if (shot.channels == 3) return {{0, 0, 0, 1}, {1, 0, 0, 1}, {2, 0, 0, 1}};
  if (shot.pattern == BayerPattern::none) return {{0, 0, 0, 1}};
  std::vector<Plane> planes;
  for (const int y : {0, 1}) {
    for (const int x : {0, 1}) planes.push_back({colour_of_site(shot.pattern, y, x), x, y, 2});
  }
  return planes;
}

using Codes = std::array<int, block_sites>;

void read_block(const SensorShot& shot, const Plane& plane, int left, int top, Codes& codes) {
  const int channel = shot.channels == 3 ? plane.colour : 0;
  std::size_t site = 0;
  for (int i = 0; i < block_side; ++i) {
    const int y = plane.y + (top + i) * plane.step;
    for (int j = 0; j < block_side; ++j, ++site) {
      const int x = plane.x + (left + j) * plane.step;
      codes[site] = shot.codes[(static_cast<std::size_t>(y) * static_cast<std::size_t>(shot.width) +
                                static_cast<std::size_t>(x)) *
                                   static_cast<std::size_t>(shot.channels) +
                               static_cast<std::size_t>(channel)];
    }
  }
}

// Whole numbers throughout, so that nothing is lost in differences of squares.
SiteBlock block_of(std::span<const SensorShot> shots,
                   const ExposureLevel& level,
                   const Plane& plane,
                   int left,
                   int top) {
  Codes codes{};
  std::array<std::int64_t, block_sites> site_sums{};
  std::int64_t squares = 0;
  std::int64_t sum = 0;
  double shot_squares = 0;
  SiteBlock block;
  block.lowest = std::numeric_limits<int>::max();
  for (const std::size_t shot : level.shots) {
    read_block(shots[shot], plane, left, top, codes);
    std::int64_t shot_sum = 0;
    for (std::size_t i = 0; i < codes.size(); ++i) {
      site_sums[i] += codes[i];
      shot_sum += codes[i];
      squares += std::int64_t{codes[i]} * codes[i];
      block.lowest = std::min(block.lowest, codes[i]);
      block.highest = std::max(block.highest, codes[i]);
    }
    sum += shot_sum;
    shot_squares += static_cast<double>(shot_sum) * static_cast<double>(shot_sum);
  }
  const auto count = static_cast<double>(level.shots.size());
  const auto total = static_cast<double>(sum);
  block.mean = total / (count * block_sites);
  if (level.shots.size() < 2) return block;
  double site_squares = 0;
  for (const std::int64_t s : site_sums) site_squares += static_cast<double>(s * s);
  const double residual = static_cast<double>(squares) - site_squares / count -
                          shot_squares / block_sites + total * total / (count * block_sites);
  block.variance = std::max(0.0, residual / ((count - 1) * (block_sites - 1)));
  return block;
}

}  // namespace

std::vector<ExposureLevel> exposure_levels(std::span<const SensorShot> shots) {
  constexpr double same = 1e-3;
  std::vector<std::size_t> order(shots.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return shots[a].exposure_s < shots[b].exposure_s;
  });
  std::vector<ExposureLevel> levels;
  for (const std::size_t shot : order) {
    const double exposure_s = shots[shot].exposure_s;
    if (levels.empty() || exposure_s > levels.back().exposure_s * (1 + same)) {
      levels.push_back({exposure_s, {}});
    }
    levels.back().shots.push_back(shot);
  }
  return levels;
}

std::vector<ColourBlocks> colour_blocks(std::span<const SensorShot> shots,
                                        std::span<const ExposureLevel> levels) {
  const SensorShot& first = shots[0];
  const std::vector<Plane> planes = planes_of(first);
  std::vector<ColourBlocks> colours(planes.size() > 1 ? 3 : 1);
  for (ColourBlocks& colour : colours) colour.levels = levels.size();
  for (const Plane& plane : planes) {
    const int columns = (first.width - plane.x + plane.step - 1) / plane.step;
    const int rows = (first.height - plane.y + plane.step - 1) / plane.step;
    for (int top = 0; top + block_side <= rows; top += block_side) {
      for (int left = 0; left + block_side <= columns; left += block_side) {
        for (const ExposureLevel& level : levels) {
          colours[static_cast<std::size_t>(plane.colour)].blocks.push_back(
              block_of(shots, level, plane, left, top));
        }
      }
    }
  }
  return colours;
}

}  // namespace capture
