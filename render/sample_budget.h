// How many samples each pixel of a reference picture gets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace render {

// Shares `total` samples among the pixels of a picture, in proportion to the standard deviation of
// one sample of theirs, which makes the sum of the squared errors smallest. `variances` (height *
// width, row by row) are rough, so each pixel takes the mean over 5x5; no pixel gets fewer than
// `least` nor more than `most`. The sum differs from `total` by rounding and by these bounds.
// Throws std::invalid_argument unless 1 <= least <= most and width divides the size.
std::vector<int> share_samples(
    std::span<const float> variances, int width, std::int64_t total, int least, int most);

}  // namespace render
