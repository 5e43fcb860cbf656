// Saturation and black clipping of blocks.
#include "capture/code_range.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "capture/median.h"

namespace capture {
namespace {

// By the means at which noise reaches code 0, not block by block: those that chance spares are no
// fair sample.
double clipped_black_end(const ColourBlocks& colour) {
  constexpr std::ptrdiff_t together = 32;
  constexpr double reach_squared = 64;  // a dark spot in a bright block is no noise
  std::vector<std::pair<double, bool>> blocks;
  for (const SiteBlock& block : colour.blocks) {
    const bool noise =
        block.variance < 0 || block.mean * block.mean < reach_squared * block.variance;
    blocks.emplace_back(block.mean, block.lowest == 0 && noise);
  }
  std::sort(blocks.begin(), blocks.end());
  double end = 0;
  for (auto first = blocks.begin(); first != blocks.end();) {
    const auto last = first + std::min(together, blocks.end() - first);
    if (std::none_of(first, last, [](const auto& block) { return block.second; })) break;
    end = std::prev(last)->first;
    first = last;
  }
  return end;
}

}  // namespace

Saturation find_saturation(const ColourBlocks& colour,
                           std::span<const ExposureLevel> levels,
                           int last_code) {
  Saturation saturation;
  int highest = 0;
  double lowest = last_code;
  for (const SiteBlock& block : colour.blocks) {
    highest = std::max(highest, block.highest);
    lowest = std::min(lowest, block.mean);
  }
  std::vector<double> means;
  std::vector<double> lows;
  constexpr double surely = 1.5;
  for (std::size_t b = 0; b < colour.count(); ++b) {
    for (std::size_t k = 1; k < levels.size(); ++k) {
      const SiteBlock& block = colour.at(b, k);
      bool saturated = block.lowest == highest;
      for (std::size_t j = 0; j < k && !saturated; ++j) {
        const SiteBlock& shorter = colour.at(b, j);
        const double light = shorter.mean - lowest;
        if (!(levels[j].exposure_s > 0) || light < 0.02 * (highest - lowest)) continue;
        saturated =
            light * levels[k].exposure_s / levels[j].exposure_s > surely * (highest - lowest);
      }
      if (!saturated) continue;
      means.push_back(block.mean);
      lows.push_back(block.lowest);
    }
  }
  saturation.code = last_code;
  saturation.from = last_code;
  constexpr std::size_t least_blocks = 3;
  if (means.size() < least_blocks) {
    // A single level still shows saturation by blocks of nothing but the last code.
    std::size_t full = 0;
    for (const SiteBlock& block : colour.blocks) full += block.lowest == last_code ? 1 : 0;
    saturation.seen = full >= least_blocks;
    return saturation;
  }
  const double code = quantile_in_place(means, 0.5);
  const double spread = quantile_in_place(means, 0.75) - quantile_in_place(means, 0.25);
  constexpr double narrow = 0.03;
  if (spread > narrow * (highest - lowest) || code - lowest < 0.5 * (highest - lowest)) {
    return saturation;
  }
  saturation.code = code;
  saturation.from = std::min(code, quantile_in_place(lows, 0.25));
  saturation.seen = true;
  return saturation;
}

WholeRange whole_range(const ColourBlocks& colour, const Saturation& saturation) {
  double lowest = saturation.from;
  for (const SiteBlock& block : colour.blocks) lowest = std::min(lowest, block.mean);
  return {clipped_black_end(colour), lowest + fitted_share * (saturation.from - lowest),
          saturation.from};
}

bool is_whole(const SiteBlock& block, const WholeRange& range) {
  return block.lowest > 0 && block.mean > range.above && block.mean < range.below &&
         block.highest < range.saturated_from;
}

}  // namespace capture
