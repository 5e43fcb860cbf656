// What both of a set's cameras tell the light of, for calibrate/light_gain.h.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "calibrate/light_gain.h"
#include "render/match.h"

namespace studio {

// Adds a pair, if both are light: finite, and above 0 in each channel.
void add_light_pair(const calibrate::LightPair& pair, std::vector<calibrate::LightPair>& pairs);

// The pairs of directions that both cameras see, of one frame of the plate.
std::vector<calibrate::LightPair> light_pairs_of(std::span<const render::OverlapTexel> overlap,
                                                 std::size_t frame = 0);

}  // namespace studio
