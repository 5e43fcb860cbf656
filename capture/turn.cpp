// Turned pictures.
#include "capture/turn.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace capture {
namespace {

// Copies pixels in tiles, so that what is read and written stays in the cache. The picture's pixel
// for (y, x) of `to` lies `step_y` y + `step_x` x floats behind `first`.
template <int channels>
void copy_turned(const float* first, std::ptrdiff_t step_y, std::ptrdiff_t step_x, Image& to) {
  constexpr int tile = 16;
  for (int top = 0; top < to.height; top += tile) {
    for (int left = 0; left < to.width; left += tile) {
      const int right = std::min(left + tile, to.width);
      for (int y = top; y < std::min(top + tile, to.height); ++y) {
        const float* from = first + step_y * y + step_x * left;
        float* pixel = to.pixels.data() + to.index(y, left);
        for (int x = left; x < right; ++x, from += step_x, pixel += channels) {
          for (int c = 0; c < channels; ++c) pixel[c] = from[c];
        }
      }
    }
  }
}

}  // namespace

std::optional<Turn> turn_of_matrix(std::span<const std::int32_t, 9> matrix) {
  const double a = matrix[0], b = matrix[1], c = matrix[3], d = matrix[4];
  constexpr double slope = 0.0175;  // of a degree
  const auto is_small = [](double one, double other) {
    return std::abs(one) <= slope * std::abs(other);
  };
  if (is_small(b, a) && is_small(c, d)) return Turn{false, a < 0, d < 0};
  if (is_small(a, b) && is_small(d, c)) return Turn{true, c < 0, b < 0};
  return std::nullopt;
}

std::string describe(const Turn& turn) {
  if (!turn.any()) return "not turned";
  if (turn == Turn{true, true, false}) return "turned by 90 degrees clockwise";
  if (turn == Turn{true, false, true}) return "turned by 90 degrees counter-clockwise";
  if (turn == Turn{false, true, true}) return "turned by 180 degrees";
  if (turn == Turn{false, true, false}) return "mirrored";
  if (turn == Turn{false, false, true}) return "turned by 180 degrees and mirrored";
  return turn.mirrored ? "turned by 90 degrees counter-clockwise and mirrored"
                       : "turned by 90 degrees clockwise and mirrored";
}

std::array<int, 2> turned_size(const Turn& turn, int width, int height) {
  if (turn.transposed) std::swap(width, height);
  return {width, height};
}

Crop crop_before(const Turn& turn, const Crop& part, int width, int height) {
  const auto [turned_width, turned_height] = turned_size(turn, width, height);
  Crop before = part;
  if (turn.upended) before.y = turned_height - part.y - part.height;
  if (turn.mirrored) before.x = turned_width - part.x - part.width;
  if (turn.transposed) {
    std::swap(before.x, before.y);
    std::swap(before.width, before.height);
  }
  return before;
}

void turn_image(const Turn& turn, const Image& from, Image& to) {
  const auto [width, height] = turned_size(turn, from.width, from.height);
  to.width = width;
  to.height = height;
  to.channels = from.channels;
  to.pixels.resize(from.pixels.size());
  // Steps of the picture along the turned one's columns and rows.
  const std::ptrdiff_t pixel = from.channels;
  const std::ptrdiff_t row = pixel * from.width;
  std::ptrdiff_t step_y = turn.transposed ? pixel : row;
  std::ptrdiff_t step_x = turn.transposed ? row : pixel;
  const float* first = from.pixels.data();
  if (turn.upended) {
    first += step_y * (height - 1);
    step_y = -step_y;
  }
  if (turn.mirrored) {
    first += step_x * (width - 1);
    step_x = -step_x;
  }
  if (from.channels == 4) {
    copy_turned<4>(first, step_y, step_x, to);
  } else if (from.channels == 1) {
    copy_turned<1>(first, step_y, step_x, to);
  } else {
    copy_turned<3>(first, step_y, step_x, to);
  }
}

}  // namespace capture
