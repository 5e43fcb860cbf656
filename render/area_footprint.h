// The area of a picture whose mean a sample sees, and the look-ups that find it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace render {

// Across a sample, in units of u and v from a picture's left to its right and from its top to its
// bottom: both sides of the parallelogram whose mean is wanted. Nothing: one point.
struct UvFootprint {
  std::array<float, 2> a{}, b{};
  friend bool operator==(const UvFootprint&, const UvFootprint&) = default;
};
inline UvFootprint square_footprint(float width_uv) { return {{width_uv, 0}, {0, width_uv}}; }

// A grid of trilinear look-ups that together have the mean of a footprint, each an equal share of
// it. Interpolated texels are a wider filter than boxes: nearest to the mean of a square, of edges
// and of noise alike, is the level whose texels are trilinear_texel as wide.
//
// Against the exact mean over squares 1.5 to 10 texels wide, as a share of the texels' deviation,
// of noise and of edges: one look-up errs by .59 and .11, 2x2 by .38 and .04; over rectangles four
// times as long as wide, one by .89 and .30, 8x2 by .36 and .016.
inline constexpr float trilinear_texel = 0.7F;
inline constexpr int most_across = 2;
struct FootprintGrid {
  int along = 1, across = 1;
  int fine = 0;                                      // the first level
  float fraction = 0;                                // of the next one
  std::array<float, 2> step_along{}, step_across{};  // from look-up to look-up, of u and v

  int count() const { return along * across; }
  // The place of look-up i, as a difference to the footprint's middle.
  std::array<float, 2> offset(int i) const {
    const float x = static_cast<float>(i % along) - 0.5F * static_cast<float>(along - 1);
    const float y = static_cast<float>(i / along) - 0.5F * static_cast<float>(across - 1);
    return {x * step_along[0] + y * step_across[0], x * step_along[1] + y * step_across[1]};
  }
  // Between the levels, up to `last`, whose texels are nearest to that, in texels of the first.
  void set_level(float texel, int last) {
    const float level = texel > 1 ? std::log2(texel) : 0;
    fine = std::min(static_cast<int>(level), last);
    fraction = fine < last ? level - static_cast<float>(fine) : 0;
  }
};

// Of a picture of width x height texels whose last level is `last`, with up to `most_along`
// look-ups along the longer side. A footprint that is no rectangle counts as the one that spreads
// as far in every direction. What is endless has the last level, what is no number counts as
// nothing.
inline FootprintGrid footprint_grid(
    const UvFootprint& footprint, int width, int height, int last, int most_along) {
  constexpr float least = 0.5F, widest = 1e6F;  // texels
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float ax = footprint.a[0] * w, ay = footprint.a[1] * h;
  const float bx = footprint.b[0] * w, by = footprint.b[1] * h;
  // The larger and the smaller eigenvalue of a a' + b b'.
  const float xx = ax * ax + bx * bx, yy = ay * ay + by * by, xy = ax * ay + bx * by;
  FootprintGrid grid;
  if (!(xx + yy > least * least)) return grid;
  if (!(xx + yy < widest * widest)) {
    grid.fine = last;
    return grid;
  }
  const float middle = 0.5F * (xx + yy), half = 0.5F * (xx - yy);
  const float apart = std::sqrt(half * half + xy * xy);
  const float longer = std::sqrt(middle + apart);
  const float narrower = std::sqrt(std::max(middle - apart, 0.0F));
  const float step =
      std::max({narrower / most_across, longer / static_cast<float>(most_along), least});
  grid.set_level(trilinear_texel * step, last);
  if (grid.fine == last) return grid;
  const auto look_ups = [step](float length, int most) {
    return std::clamp(static_cast<int>(std::ceil(length / step - 0.01F)), std::min(2, most), most);
  };
  grid.along = look_ups(longer, most_along);
  grid.across = look_ups(narrower, most_across);
  // The longer axis: of the two columns of the matrix less the smaller eigenvalue, the longer one.
  float x = half >= 0 ? half + apart : xy, y = half >= 0 ? xy : apart - half;
  const float length = std::sqrt(x * x + y * y);
  x = length > 0 ? x / length : 1, y = length > 0 ? y / length : 0;
  // Look-ups part when the footprint is half a texel wide.
  const auto step_of = [](float length_texels, int count) {
    return std::clamp(2 * length_texels - 1, 0.0F, 1.0F) * length_texels /
           static_cast<float>(count);
  };
  const float s = step_of(longer, grid.along), t = step_of(narrower, grid.across);
  grid.step_along = {x * s / w, y * s / h};
  grid.step_across = {-y * t / w, x * t / h};
  return grid;
}

}  // namespace render
