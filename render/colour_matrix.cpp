// From the lightprobe's colours to the plate's.
#include "render/colour_matrix.h"

#include <algorithm>

namespace render {

ColourMatrix diagonal(const std::array<float, 3>& gain) {
  return {gain[0], 0, 0, 0, gain[1], 0, 0, 0, gain[2]};
}

std::array<float, 3> gain_of_grey(const ColourMatrix& m) {
  return {m[0] + m[1] + m[2], m[3] + m[4] + m[5], m[6] + m[7] + m[8]};
}

ColourMatrix scaled(const ColourMatrix& matrix, float factor) {
  ColourMatrix result = matrix;
  for (float& value : result) value *= factor;
  return result;
}

int recolour(const ColourMatrix& matrix, Environment& env) {
  int below_zero = 0;
  std::vector<float>& pixels = env.radiance.pixels;
  for (std::size_t i = 0; i + 2 < pixels.size(); i += 3) {
    const Recoloured texel =
        recolour(matrix, {counted_radiance(pixels[i]), counted_radiance(pixels[i + 1]),
                          counted_radiance(pixels[i + 2])});
    std::ranges::copy(texel.radiance, pixels.begin() + static_cast<std::ptrdiff_t>(i));
    below_zero += texel.below_zero ? 1 : 0;
  }
  return below_zero;
}

}  // namespace render
