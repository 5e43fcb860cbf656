// The plate, halved again and again.
#include "render/plate_levels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <stdexcept>

#include "capture/parallel_loop.h"

namespace render {
namespace {

void make_as(capture::Image& image, int height, int width, int channels) {
  if (image.height == height && image.width == width && image.channels == channels) return;
  image = capture::make_image(height, width, channels);
}

// Rows in parallel, where they are long enough to be worth it.
template <class F>
void for_each_row(const capture::Image& image, F&& row) {
  constexpr int few_values = 8192;
  const int step = few_values / (image.width * image.channels) + 1;
  const int parts = (image.height + step - 1) / step;
  const auto rows_of = [&](int part) {
    for (int y = part * step; y < std::min((part + 1) * step, image.height); ++y) row(y);
  };
  if (parts > 1) {
    capture::parallel_for(0, parts, rows_of);
  } else {
    rows_of(0);
  }
}

}  // namespace

void PlateLevels::fill(const capture::HalfImage& plate, const calibrate::DirectionTable& lens) {
  const std::size_t pixels = static_cast<std::size_t>(std::max(plate.width, 0)) *
                             static_cast<std::size_t>(std::max(plate.height, 0));
  if (pixels == 0 || plate.channels != 3 || plate.pixels.size() != 3 * pixels ||
      plate.width != lens.width || plate.height != lens.height) {
    throw std::invalid_argument("the plate must have three channels and the lens's size");
  }
  std::size_t count = 1;
  for (int side = std::min(plate.width, plate.height); side > 1; side /= 2) ++count;
  levels_.resize(count);
  capture::Image& whole = levels_.front();
  make_as(whole, plate.height, plate.width, plate.channels);
  const auto values =
      static_cast<std::size_t>(plate.width) * static_cast<std::size_t>(plate.channels);  // of a row
  for_each_row(whole, [&](int y) {
    const std::size_t first = whole.index(y, 0);
    capture::floats_from_halves(std::span(plate.pixels).subspan(first, values),
                                &whole.pixels[first]);
    // What is no number, or endless, is its own pixel's alone.
    for (float& value : std::span(whole.pixels).subspan(first, values)) {
      if (!std::isfinite(value)) value = 0;
    }
    for (int x = 0; !lens.sensitivity.empty() && x < plate.width; ++x) {
      const float by = 1 / sensitivity_of_plate(lens.sensitivity[lens.index(y, x)]);
      for (int c = 0; c < 3; ++c) whole.at(y, x, c) *= by;
    }
  });
  for (std::size_t i = 1; i < count; ++i) {
    const capture::Image& from = levels_[i - 1];
    capture::Image& to = levels_[i];
    make_as(to, from.height / 2, from.width / 2, from.channels);
    for_each_row(to, [&](int y) {
      const float* top = &from.pixels[from.index(2 * y, 0)];
      const float* low = &from.pixels[from.index(2 * y + 1, 0)];
      float* out = &to.pixels[to.index(y, 0)];
      const int n = from.channels;
      for (int x = 0; x < to.width; ++x, top += 2 * n, low += 2 * n, out += n) {
        for (int c = 0; c < n; ++c) {
          out[c] = 0.25F * (top[c] + top[n + c] + low[c] + low[n + c]);
        }
      }
    });
  }
}

}  // namespace render
