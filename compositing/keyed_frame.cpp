// Keyed frames.
#include "compositing/keyed_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "capture/half.h"

namespace compositing {

void KeyedFrame::resize(int height, int width) {
  const auto rows = static_cast<std::size_t>(height), across = static_cast<std::size_t>(width);
  const std::size_t halves = 4 * rows * across;
  const std::size_t bytes = (rows + run - 1) / run * run * ((across + run - 1) / run);
  const bool fits = image_.height == height && image_.width == width &&
                    image_.pixels.size() == halves && written_.size() == bytes;
  if (fits) return;  // one that was moved from does not
  image_ = {height, width, {}, 4};
  image_.pixels.assign(halves, 0);
  written_.assign(bytes, 0);
}

bool KeyedFrame::has_any_in_block(int row, int column) const {
  std::uint64_t rows;
  static_assert(sizeof rows == run);
  std::memcpy(&rows, &written_[byte_at(row * run, column * run)], sizeof rows);
  return rows != 0;
}

void KeyedFrame::set(const capture::Image& picture) {
  resize(picture.height, picture.width);
  const auto count =
      static_cast<std::size_t>(picture.height) * static_cast<std::size_t>(picture.width);
  const auto channels = static_cast<std::size_t>(picture.channels);
  const auto shown = [](float value) {
    const float bounded = std::clamp(value, -capture::half_max, capture::half_max);
    return std::abs(value) <= std::numeric_limits<float>::max() ? bounded : 0.0F;
  };
  constexpr std::size_t block = 64;  // pixels, for they are converted together
  std::array<float, 4 * block> rgba;
  rgba.fill(1);
  for (std::size_t first = 0; first < count; first += block) {
    const std::size_t n = std::min(block, count - first);
    const float* from = &picture.pixels[first * channels];
    if (channels == 4) {
      for (std::size_t i = 0; i < 4 * n; ++i) rgba[i] = shown(from[i]);
    } else {
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t c = 0; c < 3; ++c) rgba[4 * i + c] = shown(from[3 * i + c]);
      }
    }
    capture::halves_from_floats(std::span(rgba).first(4 * n), &image_.pixels[4 * first]);
  }
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; x += run) {
      const auto halves =
          std::span(image_.pixels)
              .subspan(image_.index(y, x),
                       4 * static_cast<std::size_t>(std::min(run, picture.width - x)));
      written_[byte_at(y, x)] = std::ranges::any_of(halves, [](auto half) { return half != 0; });
    }
  }
}

}  // namespace compositing
