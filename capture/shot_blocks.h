// Means and variances over small blocks of a sensor's sites.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "capture/photon_transfer.h"

namespace capture {

// Shots of one exposure time.
struct ExposureLevel {
  double exposure_s = 0;
  std::vector<std::size_t> shots;  // indices
};

// Dark shots first, and then the longer ones after the shorter ones.
std::vector<ExposureLevel> exposure_levels(std::span<const SensorShot> shots);

// 8 x 8 sites of one colour at one exposure, codes.
struct SiteBlock {
  double mean = 0;
  double variance = -1;  // between the shots, the block's change as a whole left out; -1 = one shot
  int lowest = 0;
  int highest = 0;
};
inline constexpr int block_side = 8;
inline constexpr int block_sites = block_side * block_side;

// All blocks of one colour.
struct ColourBlocks {
  std::size_t levels = 0;
  std::vector<SiteBlock> blocks;  // (block, level)

  std::size_t count() const { return levels == 0 ? 0 : blocks.size() / levels; }
  const SiteBlock& at(std::size_t block, std::size_t level) const {
    return blocks[block * levels + level];
  }
};

// One for grey, or red, green and blue. Sites beyond the last whole block are left out.
std::vector<ColourBlocks> colour_blocks(std::span<const SensorShot> shots,
                                        std::span<const ExposureLevel> levels);

}  // namespace capture
