// A person before any still background, told apart by distance from the plate.
#pragma once

#include <array>

#include "compositing/key_texel.h"

namespace compositing {

// How far from the plate, in units of the noise, a texel is still background and surely person.
inline constexpr float background_to = 4, person_from = 10;
// How dark a shadow, and how bright a gleam, of the plate's own colour still counts as plate.
inline constexpr float darkest_shadow = 0.6F, brightest_gleam = 1.15F;

// The matte of a texel: distance of its colour from the plate's, after the light on the plate has
// been made as strong as fits best within a shadow. `over_noise` is 1 / noise of a pixel, the last
// value of a cell of PlateUse::difference.
//
// Horprasert, Harwood and Davis, "A Statistical Approach for Real-time Robust Background
// Subtraction and Shadow Detection", FRAME-RATE Workshop (ICCV) 1999, section 3: brightness and
// chromaticity distortion; ours is a ramp, so that edges are soft.
template <class V>
TexelMatte<V> difference_matte(const std::array<V, 3>& c,
                               const std::array<V, 3>& p,
                               V over_noise,
                               const KeyDials& dials) {
  const V zero = lanes_like(over_noise, 0), one = lanes_like(over_noise, 1);
  const V along = c[0] * p[0] + c[1] * p[1] + c[2] * p[2];
  const V length = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + 1e-6F;
  const V light = least(most(along / length, lanes_like(zero, darkest_shadow)),
                        lanes_like(zero, brightest_gleam));
  V square = zero;
  for (std::size_t i = 0; i < 3; ++i) {
    const V off = c[i] - light * p[i];
    square = square + off * off;
  }
  // The ramp runs over the square: no root is needed, and noise stays below it.
  const V far = square * over_noise * over_noise;
  constexpr float low = background_to * background_to, high = person_from * person_from;
  V alpha = least(most((far - low) * (1 / (high - low)), zero), one);
  alpha = least(most((alpha - dials.black) * dials.scale, zero), one);
  alpha = alpha + dials.edge * alpha * (one - alpha);
  return {alpha, zero};
}

}  // namespace compositing
