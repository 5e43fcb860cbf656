// Names and choice of screen colours.
#include "compositing/screen_colour.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace compositing {
namespace {

constexpr std::array all{ScreenColour::red,    ScreenColour::green, ScreenColour::blue,
                         ScreenColour::yellow, ScreenColour::cyan,  ScreenColour::magenta};

}  // namespace

std::string_view name_of(ScreenColour colour) {
  return screen_colour_names[static_cast<std::size_t>(colour)];
}

ScreenColour screen_colour_from_name(std::string_view name) {
  const auto found = std::ranges::find(screen_colour_names, name);
  if (found == screen_colour_names.end()) {
    throw std::invalid_argument("no screen's colour is called \"" + std::string(name) + "\"");
  }
  return all[static_cast<std::size_t>(found - screen_colour_names.begin())];
}

ScreenColour screen_colour_of(const std::array<float, 3>& light) {
  ScreenColour best = ScreenColour::green;
  float excess = -std::numeric_limits<float>::infinity();
  for (const ScreenColour colour : all) {
    const auto order = channels_of(colour);
    const auto at = [&](std::size_t i) { return light[static_cast<std::size_t>(order[i])]; };
    const float of_this = has_two_primaries(colour) ? screen_excess<true>(at(0), at(1), at(2))
                                                    : screen_excess<false>(at(0), at(1), at(2));
    if (of_this > excess) excess = of_this, best = colour;
  }
  return best;
}

}  // namespace compositing
