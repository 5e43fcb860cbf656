// Keys of screens.
#include "compositing/screen_key.h"

#include <algorithm>
#include <functional>
#include <vector>

namespace compositing {
namespace {

constexpr float least_share = 0.6F;  // of the key's excess: what counts as screen in footage
constexpr std::size_t most_saturated_part = 20;  // the twentieth that tells how much is high
constexpr std::size_t least_part = 20;  // of so many pixels one has the screen's colour, at least

constexpr float screens_spread = 0.35F;  // of a screen's chromaticities about the fullest one
constexpr float least_saturation = 0.06F;

// Skin, hair, wood and lamps lean to red and yellow; hardly any screen does.
constexpr float warm_share = 0.5F;

// Darker primaries, of display white and of the picture's bright parts, tell no colour.
constexpr float darkest = 2e-3F, darkest_share = 0.02F;

bool is_warm(ScreenColour colour) {
  return colour == ScreenColour::red || colour == ScreenColour::yellow ||
         colour == ScreenColour::magenta;
}

float saturation(const ScreenLight& light) { return light.excess / light.first; }

// Colours by what their other two channels are of the first, and how much of each there is.
class ChromaGrid {
 public:
  void add(const ScreenLight& light) {
    const float weight = saturation(light) * saturation(light);
    Sums& cell = at(place(light.second / light.first), place(light.third / light.first));
    cell.weight += weight;
    cell.second += weight * light.second / light.first;
    cell.third += weight * light.third / light.first;
  }

  // The mean of the 3x3 cells that hold most; without excess if there are none.
  ScreenLight fullest() const {
    Sums best;
    for (std::size_t row = 1; row + 1 < side; ++row) {
      for (std::size_t column = 1; column + 1 < side; ++column) {
        Sums sum;
        for (std::size_t i = 0; i < 9; ++i) {
          const Sums& cell = cells_[(row + i / 3 - 1) * side + column + i % 3 - 1];
          sum.weight += cell.weight, sum.second += cell.second, sum.third += cell.third;
        }
        if (sum.weight > best.weight) best = sum;
      }
    }
    if (!(best.weight > 0)) return {};
    return {1, static_cast<float>(best.second / best.weight),
            static_cast<float>(best.third / best.weight), 1};
  }

 private:
  struct Sums {
    double weight = 0, second = 0, third = 0;
  };
  static constexpr std::size_t side = 32;  // with one empty cell on each side

  static std::size_t place(float ratio) {
    return 1 + static_cast<std::size_t>(std::min(ratio, 0.999F) * (side - 2));
  }
  Sums& at(std::size_t row, std::size_t column) { return cells_[row * side + column]; }

  std::vector<Sums> cells_{side * side};
};

float brightest_of(const Light3& light) { return std::max({light[0], light[1], light[2]}); }

// Below it a pixel tells no colour.
float dark_of(std::span<const Light3> pixels) {
  std::vector<float> bright(pixels.size());
  std::ranges::transform(pixels, bright.begin(), brightest_of);
  const auto high =
      bright.begin() + static_cast<std::ptrdiff_t>(bright.size() / most_saturated_part);
  std::ranges::nth_element(bright, high, std::greater());
  return std::max(darkest, darkest_share * *high);
}

ScreenLight find_key(std::span<const Light3> pixels, float dark, ScreenColour colour) {
  std::vector<ScreenLight> coloured;
  ChromaGrid grid;
  for (const Light3& light : pixels) {
    const ScreenLight seen = screen_light(light, colour);
    if (!(seen.excess > 0) || seen.first < dark) continue;
    grid.add(seen);
    coloured.push_back(seen);
  }
  const ScreenLight fullest = grid.fullest();
  std::erase_if(coloured, [&](const ScreenLight& light) {
    return !(chroma_off(light, fullest) < screens_spread);
  });
  if (coloured.empty()) return {};
  std::ranges::sort(coloured, std::greater(), &ScreenLight::excess);
  const std::size_t among_high = std::min(pixels.size() / most_saturated_part, coloured.size() / 2);
  const float high = coloured[among_high].excess;
  const auto low = std::ranges::find_if(
      coloured, [&](const ScreenLight& light) { return light.excess < least_share * high; });
  return coloured[static_cast<std::size_t>(low - coloured.begin()) / 2];
}

// How much speaks for a screen of that colour: the share of the picture that has the key's
// chromaticity, by how saturated that is, in squares. Light does not count: a face in a bright
// light has more of its colour than a screen in a dim one.
float evidence(std::span<const Light3> pixels, float dark, ScreenColour colour) {
  const ScreenLight key = find_key(pixels, dark, colour);
  if (!(key.excess > 0) || saturation(key) < least_saturation) return 0;
  const auto alike = static_cast<std::size_t>(std::ranges::count_if(
      pixels, [&](const Light3& light) { return is_screen(screen_light(light, colour), key); }));
  if (alike * least_part < pixels.size()) return 0;
  return static_cast<float>(alike) * saturation(key) * saturation(key) *
         (is_warm(colour) ? warm_share : 1);
}

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
  return find_key(pixels, dark_of(pixels), colour);
}

std::optional<ScreenColour> find_screen_colour(std::span<const Light3> pixels) {
  const float dark = dark_of(pixels);
  std::optional<ScreenColour> best;
  float most = 0;
  for (int i = 0; i <= static_cast<int>(ScreenColour::magenta); ++i) {
    const auto colour = static_cast<ScreenColour>(i);
    const float of_this = evidence(pixels, dark, colour);
    if (of_this > most) most = of_this, best = colour;
  }
  return best;
}

}  // namespace compositing
