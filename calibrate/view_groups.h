// Views of a board that was held still: what they tell of a lens is not new.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens_bundle.h"

namespace calibrate {

// For each view the first one in which every corner that both show lies within a quarter of a
// square: frames of a video, or a burst. A view that shows less than half of the other's corners,
// or few, is its own.
std::vector<std::size_t> view_groups(const Board& board, std::span<const BoardView> views);

// How much larger the variance of what views tell is than of independent ones, 1 or more: views of
// one group are off alike, where blur, light or the board itself shift corners, by the correlation
// of their residuals. `missed` and `used` are of the corners, which are sorted by view. Kish,
// "Survey Sampling", 1965, section 5.4: the design effect, with the corner for a cluster.
double twin_variance(std::span<const std::size_t> groups,
                     std::size_t corners_of_board,
                     std::span<const SeenCorner> corners,
                     std::span<const std::optional<Vec2>> missed,
                     std::span<const std::uint8_t> used);

}  // namespace calibrate
