// Which of a sensor's codes are clipped, from blocks of its shots.
#pragma once

#include <span>

#include "capture/shot_blocks.h"

namespace capture {

struct Saturation {
  double code = 0;  // the median of what is saturated
  double from = 0;  // codes from here on may be saturated
  bool seen = false;
};

// The means of blocks that neither end of the range has clipped.
struct WholeRange {
  double above = 0;
  double below = 0;
  double saturated_from = 0;
};

// Up to this share of the range, fits take a sensor for linear: many bend near saturation.
inline constexpr double fitted_share = 0.85;

// Blocks whose shorter exposures foretell far more than the highest code are saturated, if they
// all have about one code; so are blocks that have nothing but the highest code.
Saturation find_saturation(const ColourBlocks& colour,
                           std::span<const ExposureLevel> levels,
                           int last_code);

// Up to fitted_share of the range.
WholeRange whole_range(const ColourBlocks& colour, const Saturation& saturation);
bool is_whole(const SiteBlock& block, const WholeRange& range);

}  // namespace capture
