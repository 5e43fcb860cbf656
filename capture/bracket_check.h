// Whether the shots of a bracket agree with what was merged from them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/hdr.h"
#include "capture/image.h"

namespace capture {

// Of the pixels of a merged bracket, shares.
struct BracketShares {
  double contradicting = 0;  // a shot's code is far from what the merge foretells of it
  double saturated = 0;      // in all shots: a lower bound only
  double black = 0;          // in all shots
};

// Shots of 8-bit codes, each (height, width, 3), whose codes mean what the tables say, and the
// (height, width, 3) radiance that was merged from them. A code is far off where it differs by more
// than 30 from that of the merged light at the shot's exposure: more than noise, a JPEG's
// blocks and an inexact response do, and less than what moved, or a label that is wrong by a stop,
// does wherever it is not hidden by black or saturation. Looks at some 250,000 pixels, evenly
// spread. Throws std::invalid_argument if the sizes do not fit together.
BracketShares check_bracket(std::span<const std::uint8_t* const> shots,
                            std::span<const double> exposures_s,
                            const std::array<CodeTable, 3>& channels,
                            const Image& radiance);

// What of it a user should know, in words.
std::vector<std::string> warnings_of(const BracketShares& shares);

}  // namespace capture
