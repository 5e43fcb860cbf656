// Clean plates, filtered.
#include "compositing/filtered_plate.h"

#include <cmath>
#include <cstddef>

#include "capture/half.h"
#include "compositing/screen_colour.h"

namespace compositing {
namespace {

float share_of(int pixels, int cells, int step) {
  return static_cast<float>(pixels) / static_cast<float>(cells * step);
}

}  // namespace

FilteredPlate::FilteredPlate(const LitPlate& bare)
    : across_(share_of(bare.width, bare.columns, bare.step)),
      down_(share_of(bare.height, bare.rows, bare.step)) {
  capture::Image light = capture::make_image(bare.rows, bare.columns, 3);
  for (std::size_t i = 0; 3 * i < light.pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) light.pixels[3 * i + c] = bare.cells[4 * i + c];
  }
  cells_.take(light);
  // Screens are smooth: their cells are means already. Of other backgrounds no two pixels are
  // alike.
  const float side = std::sqrt(static_cast<float>(bare.width) * static_cast<float>(bare.height));
  fine_uv_ = bare.use == PlateUse::screen ? static_cast<float>(bare.step) / side : 0;
}

std::array<float, 4> FilteredPlate::at(
    const LitPlate& lit, const float* nearest, float u, float v, float footprint_uv) const {
  if (footprint_uv < fine_uv_) return {nearest[0], nearest[1], nearest[2], nearest[3]};
  const auto cell = static_cast<std::size_t>(nearest - lit.cells.data());
  const float bare = capture::float_from_half(cells_.level(0).pixels[cell]);
  const float gain = bare > 0 ? nearest[0] / bare : 1;
  const float wide = footprint_uv * std::sqrt(across_ * down_);
  const std::array<float, 4> light = cells_.filtered(u * across_, v * down_, wide);
  std::array<float, 4> filtered{gain * light[0], gain * light[1], gain * light[2], nearest[3]};
  if (lit.use == PlateUse::screen && nearest[3] > 0) {
    const auto& [a, b, c, last] = filtered;
    const float excess = has_two_primaries(lit.colour) ? screen_excess<true>(a, b, c)
                                                       : screen_excess<false>(a, b, c);
    filtered[3] = excess * nearest[3] > 0.25F ? 1 / excess : 0;  // else most of it is no screen
  }
  return filtered;
}

}  // namespace compositing
