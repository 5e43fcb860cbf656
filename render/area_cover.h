// What a texel of a mip level covers of the level before.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace render {

// Along one side: target texel i of max(1, n / 2) covers two source texels or, of odd sizes, three.
struct AreaCover {
  int first = 0, count = 1;
  std::array<float, 3> weights{1, 0, 0};  // add up to 1

  AreaCover(int i, int n_source, int n_target) {
    if (n_source == n_target) {
      first = i;
      return;
    }
    const double scale = static_cast<double>(n_source) / n_target;
    const double from = i * scale, to = (i + 1) * scale;
    first = static_cast<int>(from);
    count = 0;
    for (int k = first; k < n_source && k < to && count < 3; ++k) {
      const double share = (std::min(to, k + 1.0) - std::max(from, static_cast<double>(k))) / scale;
      weights[static_cast<std::size_t>(count++)] = static_cast<float>(share);
    }
  }
};

}  // namespace render
