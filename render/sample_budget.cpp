// Samples go where the picture is noisy.
#include "render/sample_budget.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace render {

std::vector<int> share_samples(
    std::span<const float> variances, int width, std::int64_t total, int least, int most) {
  if (width < 1 || variances.size() % static_cast<std::size_t>(width) != 0) {
    throw std::invalid_argument("share_samples: the width does not divide the number of pixels");
  }
  if (least < 1 || most < least) {
    throw std::invalid_argument("share_samples: needs 1 <= least <= most");
  }
  const int height = static_cast<int>(variances.size() / static_cast<std::size_t>(width));
  std::vector<double> deviations(variances.size());
  double sum = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double around = 0;
      int count = 0;
      for (int j = std::max(0, y - 2); j <= std::min(height - 1, y + 2); ++j) {
        for (int i = std::max(0, x - 2); i <= std::min(width - 1, x + 2); ++i, ++count) {
          around += std::max(0.0F, variances[static_cast<std::size_t>(j * width + i)]);
        }
      }
      const double deviation = std::sqrt(around / count);
      deviations[static_cast<std::size_t>(y * width + x)] = deviation;
      sum += deviation;
    }
  }
  // What is left once every pixel has the least is shared.
  const double rest =
      std::max(0.0, static_cast<double>(total) - least * static_cast<double>(variances.size()));
  std::vector<int> counts(variances.size(), least);
  if (!(sum > 0)) return counts;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double wanted = least + rest * deviations[i] / sum;
    counts[i] = static_cast<int>(std::min(std::round(wanted), static_cast<double>(most)));
  }
  return counts;
}

}  // namespace render
