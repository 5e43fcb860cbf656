// The errors of groups of pixels.
#include "render/group_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace render {
namespace {

// Sums over the pixels of a group.
struct Sums {
  int pixels = 0;
  std::array<double, 3> x{}, a{}, b{};
  double squares = 0;  // of differences
  double truth = 0;    // a b
};

double relative(double squares, double truth, double least) {
  if (!std::isfinite(squares) || !std::isfinite(truth)) {
    return std::numeric_limits<double>::infinity();
  }
  return std::sqrt(std::max(0.0, squares) / std::max(truth, least));
}

GroupError error_of(const Sums& sums, int x, int y) {
  double squares = 0, truth = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    squares += (sums.x[c] - sums.a[c]) * (sums.x[c] - sums.b[c]);
    truth += sums.a[c] * sums.b[c];
  }
  const double n = sums.pixels;
  const double least = 3 * static_cast<double>(darkest_group) * darkest_group;
  return {x, y, relative(squares / (n * n), truth / (n * n), least),
          relative(sums.squares / n, sums.truth / n, least)};
}

bool is_like(const capture::Image& image, const capture::Image& mask, int channels) {
  return image.width == mask.width && image.height == mask.height && image.channels >= channels;
}

}  // namespace

std::vector<GroupError> group_errors(const capture::Image& x,
                                     const std::array<capture::Image, 2>& references,
                                     const capture::Image& mask,
                                     float clamp) {
  const auto& [a, b] = references;
  if (!is_like(mask, mask, 1) || !is_like(x, mask, 3) || !is_like(a, mask, 3) ||
      !is_like(b, mask, 3)) {
    throw std::invalid_argument("group_errors: pictures and mask must be of one size");
  }
  std::vector<GroupError> errors;
  for (int top = 0; top < mask.height; top += error_group) {
    for (int left = 0; left < mask.width; left += error_group) {
      Sums sums;
      for (int row = top; row < std::min(top + error_group, mask.height); ++row) {
        for (int column = left; column < std::min(left + error_group, mask.width); ++column) {
          if (!(mask.at(row, column) > 0)) continue;
          ++sums.pixels;
          for (int c = 0; c < 3; ++c) {
            const double shown = std::min(x.at(row, column, c), clamp);
            const double truth_a = std::min(a.at(row, column, c), clamp);
            const double truth_b = std::min(b.at(row, column, c), clamp);
            const auto i = static_cast<std::size_t>(c);
            sums.x[i] += shown;
            sums.a[i] += truth_a;
            sums.b[i] += truth_b;
            sums.squares += (shown - truth_a) * (shown - truth_b);
            sums.truth += truth_a * truth_b;
          }
        }
      }
      if (sums.pixels > 0) errors.push_back(error_of(sums, left, top));
    }
  }
  return errors;
}

double share_within(const std::vector<GroupError>& groups, double GroupError::*error, double most) {
  if (groups.empty()) return 1;
  const auto within =
      std::ranges::count_if(groups, [&](const GroupError& g) { return g.*error <= most; });
  return static_cast<double>(within) / static_cast<double>(groups.size());
}

}  // namespace render
