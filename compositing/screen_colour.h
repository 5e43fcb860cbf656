// Which colour a screen has, and how much of it is in a colour.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "capture/image.h"

namespace compositing {

// One primary stands out, or two do: a screen of green paint, or one of yellow-green light.
enum class ScreenColour : std::uint8_t { red, green, blue, yellow, cyan, magenta };
inline constexpr std::array<std::string_view, 6> screen_colour_names{"red",    "green", "blue",
                                                                     "yellow", "cyan",  "magenta"};

std::string_view name_of(ScreenColour colour);
// Throws std::invalid_argument for a name that is none of them.
ScreenColour screen_colour_from_name(std::string_view name);

// The channels of a colour in the order in which the keyer takes them: the one that stands out
// first; of two, the one that does not last.
constexpr std::array<int, 3> channels_of(ScreenColour colour) {
  switch (colour) {
    case ScreenColour::red:
      return {0, 1, 2};
    case ScreenColour::green:
      return {1, 0, 2};
    case ScreenColour::blue:
      return {2, 0, 1};
    case ScreenColour::yellow:
      return {1, 0, 2};
    case ScreenColour::cyan:
      return {1, 2, 0};
    default:
      return {0, 2, 1};
  }
}
constexpr bool has_two_primaries(ScreenColour colour) { return colour >= ScreenColour::yellow; }

// For numbers and for vectors of them alike.
template <class V>
constexpr V least(V a, V b) {
  return a < b ? a : b;
}
template <class V>
constexpr V most(V a, V b) {
  return a > b ? a : b;
}

// How much of a screen's colour there is in one whose channels are in the keyer's order: what the
// primary has over the mean of the others; of two primaries, the lesser's over the third channel.
// Linear for one primary, and so for a mixture with any colour of two that has as much of both.
// Vlahos, US patent 3,158,477 (colour difference), with the mean instead of the larger of two.
template <bool two_primaries, class V>
constexpr V screen_excess(V first, V second, V third) {
  if constexpr (two_primaries) return least(first, second) - third;
  return first - 0.5F * (second + third);
}

// The screen colour of which a colour (scene-linear) has most.
ScreenColour screen_colour_of(const std::array<float, 3>& light);

}  // namespace compositing
