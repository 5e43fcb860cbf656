// From the lightprobe's colours to the plate's.
#pragma once

#include <array>

#include "render/environment.h"

namespace render {

// plate = matrix * probe, row by row. A gain per channel is its diagonal.
using ColourMatrix = std::array<float, 9>;

inline constexpr ColourMatrix same_colours{1, 0, 0, 0, 1, 0, 0, 0, 1};

ColourMatrix diagonal(const std::array<float, 3>& gain);
// What each channel of a probe's grey is multiplied by: the sums of the rows.
std::array<float, 3> gain_of_grey(const ColourMatrix& matrix);
ColourMatrix scaled(const ColourMatrix& matrix, float factor);

// A matrix can take a strong colour below 0, where no light is: that counts as 0.
struct Recoloured {
  std::array<float, 3> radiance{};
  bool below_zero = false;
};
// Of a radiance that is finite. A diagonal gives the same bits as its gains alone.
inline Recoloured recolour(const ColourMatrix& m, const std::array<float, 3>& probe) {
  Recoloured result;
  for (std::size_t c = 0; c < 3; ++c) {
    const float value = m[3 * c] * probe[0] + m[3 * c + 1] * probe[1] + m[3 * c + 2] * probe[2];
    result.below_zero = result.below_zero || value < 0;
    result.radiance[c] = value > 0 ? value : 0.0F;
  }
  return result;
}

// Recolours all of an environment's radiance, which it counts first. Returns how many texels were
// below 0.
int recolour(const ColourMatrix& matrix, Environment& env);

}  // namespace render
