// A screen's own colour, found in pictures, and which pixels have it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "capture/image.h"
#include "compositing/screen_colour.h"

namespace compositing {

// Light of a pixel; what is no number, negative or beyond measure is black.
using Light3 = std::array<float, 3>;
inline float clean(float value) { return value > 0 && value <= 1e9F ? value : 0; }
inline Light3 clean_light(const float* light) {
  return {clean(light[0]), clean(light[1]), clean(light[2])};
}

// Of so many pixels, those that are looked at where some thousands tell enough: every so many.
inline std::size_t spread_step(std::size_t pixels) {
  constexpr std::size_t enough = 50000;
  return std::max<std::size_t>(1, pixels / enough);
}
std::vector<Light3> spread_pixels(const capture::Image& image);

// A colour with its channels in the keyer's order, and how much of the screen's is in it.
struct ScreenLight {
  float first, second, third, excess;
};

// Of channels in that order.
inline ScreenLight ordered_light(const std::array<float, 3>& c, ScreenColour colour) {
  return {c[0], c[1], c[2],
          has_two_primaries(colour) ? screen_excess<true>(c[0], c[1], c[2])
                                    : screen_excess<false>(c[0], c[1], c[2])};
}
// Of light that is clean.
inline ScreenLight screen_light(const Light3& light, ScreenColour colour) {
  const auto order = channels_of(colour);
  const auto at = [&](std::size_t i) { return light[static_cast<std::size_t>(order[i])]; };
  return ordered_light({at(0), at(1), at(2)}, colour);
}

// Of the chromaticity of which most is saturated most, whatever its light: the median of what has
// most of the screen's excess. Without excess, and black, if nothing has any. Of at least one
// pixel, clean.
ScreenLight find_key(std::span<const Light3> pixels, ScreenColour colour);

// The colour of the screen, which may be the lesser part of the picture, but not below a twentieth:
// the one of which most is saturated most. Nothing if none has any.
std::optional<ScreenColour> find_screen_colour(std::span<const Light3> pixels);

// By how much two chromaticities differ: of the other channels as shares of the first, together. Of
// light that is not black.
inline float chroma_off(const ScreenLight& light, const ScreenLight& key) {
  return (std::abs(light.second * key.first - key.second * light.first) +
          std::abs(light.third * key.first - key.third * light.first)) /
         (key.first * light.first);
}

// Whether that is the screen, somewhat brighter or darker.
inline bool is_screen(const ScreenLight& light, const ScreenLight& key) {
  constexpr float darkest = 0.35F, brightest = 3, chroma_tolerance = 0.12F;
  return light.excess >= darkest * key.excess && light.excess <= brightest * key.excess &&
         chroma_off(light, key) < chroma_tolerance;
}

}  // namespace compositing
