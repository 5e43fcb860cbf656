// Keys of screens.
#include "compositing/screen_key.h"

#include <algorithm>
#include <functional>
#include <vector>

namespace compositing {
namespace {

constexpr float least_share = 0.6F;  // of the key's excess: what counts as screen in footage
constexpr std::size_t most_saturated_part = 20;  // the twentieth that tells how much is high

}  // namespace

std::vector<Light3> spread_pixels(const capture::Image& image) {
  const std::size_t pixels = image.pixels.size() / 3;
  std::vector<Light3> some;
  for (std::size_t i = 0; i < pixels; i += spread_step(pixels)) {
    some.push_back(clean_light(&image.pixels[3 * i]));
  }
  return some;
}

ScreenLight find_key(std::span<const Light3> pixels, ScreenColour colour) {
  std::vector<ScreenLight> all(pixels.size());
  std::ranges::transform(pixels, all.begin(),
                         [&](const Light3& light) { return screen_light(light, colour); });
  std::ranges::sort(all, std::greater(), &ScreenLight::excess);
  const float high = all[all.size() / most_saturated_part].excess;
  const auto low = std::ranges::find_if(
      all, [&](const ScreenLight& light) { return light.excess < least_share * high; });
  return all[static_cast<std::size_t>(low - all.begin()) / 2];
}

std::optional<ScreenColour> most_saturated(std::span<const Light3> pixels) {
  std::optional<ScreenColour> best;
  float excess = 0;
  for (int i = 0; i <= static_cast<int>(ScreenColour::magenta); ++i) {
    const auto colour = static_cast<ScreenColour>(i);
    const float of_this = find_key(pixels, colour).excess;
    if (of_this > excess) excess = of_this, best = colour;
  }
  return best;
}

}  // namespace compositing
