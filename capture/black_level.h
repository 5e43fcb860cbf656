// Black level and true exposures of a linear sensor, from means of blocks.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "capture/photon_transfer.h"

namespace capture {

// One block's mean at one exposure.
struct BlockMean {
  std::size_t level = 0;
  double code = 0;
  double sigma = 0;
};

struct BlackFit {
  Estimate black;
  std::vector<double> log_exposures;  // solved; of dark levels meaningless
};

// Solves  code = black + light(block) * exposure(level)  for black and exposures, each block's
// light eliminated (variable projection; Golub and Pereyra, SIAM Journal on Numerical Analysis
// 10(2), 1973), Cauchy's loss on blocks so that what moved hardly pulls. Exposures keep near the
// claimed ones, to `exposure_error` each; 0 claims dark. Each block: its unclipped levels, two or
// more, or a dark one.
BlackFit fit_black_level(const std::vector<std::vector<BlockMean>>& blocks,
                         std::span<const double> claimed_s,
                         double exposure_error);

}  // namespace capture
