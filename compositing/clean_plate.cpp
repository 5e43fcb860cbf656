// What clean plates tell: their screen, their colour.
#include "compositing/clean_plate.h"

#include <algorithm>

#include "compositing/screen_key.h"

namespace compositing {

using capture::Image;

void blur_screen(Image& light) {
  constexpr int reach = 2;
  const auto pass = [&](int count, int lines, auto&& at) {
    std::vector<float> row(static_cast<std::size_t>(count));
    for (int line = 0; line < lines; ++line) {
      for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < count; ++i) row[static_cast<std::size_t>(i)] = at(line, i, c);
        for (int i = 0; i < count; ++i) {
          const int from = std::max(0, i - reach), to = std::min(count - 1, i + reach);
          float sum = 0;
          for (int j = from; j <= to; ++j) sum += row[static_cast<std::size_t>(j)];
          at(line, i, c) = sum / static_cast<float>(to - from + 1);
        }
      }
    }
  };
  pass(light.width, light.height, [&](int y, int x, int c) -> float& { return light.at(y, x, c); });
  pass(light.height, light.width, [&](int x, int y, int c) -> float& { return light.at(y, x, c); });
}

float screen_share(const Image& light, ScreenColour colour, std::span<const std::uint8_t> garbage) {
  const ScreenLight key = find_key(spread_pixels(light), colour);
  if (key.excess <= 0) return 0;
  std::size_t pixels = 0, screen = 0;
  for (std::size_t i = 0; i < light.pixels.size() / 3; ++i) {
    if (!garbage.empty() && garbage[i] == 255) continue;
    ++pixels;
    screen += is_screen(screen_light(clean_light(&light.pixels[3 * i]), colour), key) ? 1 : 0;
  }
  return pixels > 0 ? static_cast<float>(screen) / static_cast<float>(pixels) : 1.0F;
}

ScreenColour mean_colour(const Image& light) {
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < light.pixels.size(); ++i) sum[i % 3] += light.pixels[i];
  std::array<float, 3> mean{};
  for (std::size_t c = 0; c < 3; ++c) {
    mean[c] = static_cast<float>(sum[c] * 3 / static_cast<double>(light.pixels.size()));
  }
  return screen_colour_of(mean);
}

}  // namespace compositing
