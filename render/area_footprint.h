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

// Footprints that are no wider are one point, and wider ones all of a picture.
inline constexpr float least_footprint = 0.5F, widest_footprint = 1e6F;  // texels

// A footprint in texels, as the rectangle that spreads as far in every direction: its sides, and
// the longer one's direction (unit).
struct FootprintSides {
  float longer = 0, narrower = 0;
  float x = 1, y = 0;
};
inline FootprintSides footprint_sides(const UvFootprint& footprint, int width, int height) {
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float ax = footprint.a[0] * w, ay = footprint.a[1] * h;
  const float bx = footprint.b[0] * w, by = footprint.b[1] * h;
  // The larger and the smaller eigenvalue of a a' + b b'.
  const float xx = ax * ax + bx * bx, yy = ay * ay + by * by, xy = ax * ay + bx * by;
  FootprintSides sides;
  if (!(xx + yy > 0)) return sides;
  if (!(xx + yy < widest_footprint * widest_footprint)) {
    sides.longer = widest_footprint;
    return sides;
  }
  const float middle = 0.5F * (xx + yy), half = 0.5F * (xx - yy);
  const float apart = std::sqrt(half * half + xy * xy);
  sides.longer = std::sqrt(middle + apart);
  sides.narrower = std::sqrt(std::max(middle - apart, 0.0F));
  // Of the two columns of the matrix less the smaller eigenvalue, the longer one.
  const float x = half >= 0 ? half + apart : xy, y = half >= 0 ? xy : apart - half;
  if (const float length = std::sqrt(x * x + y * y); length > 0) {
    sides.x = x / length, sides.y = y / length;
  }
  return sides;
}

// So many look-ups, whose texels are `texel` of the first level's wide. They part when the
// footprint is half a texel wide.
inline void spread(
    FootprintGrid& grid, const FootprintSides& sides, int width, int height, float texel) {
  const auto step_of = [texel](float length, int count) {
    return std::clamp(2 * length / texel - 1, 0.0F, 1.0F) * length / static_cast<float>(count);
  };
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float s = step_of(sides.longer, grid.along), t = step_of(sides.narrower, grid.across);
  grid.step_along = {sides.x * s / w, sides.y * s / h};
  grid.step_across = {-sides.y * t / w, sides.x * t / h};
}

// Of a picture of width x height texels whose last level is `last`, with up to `most_along`
// look-ups along the longer side. What is endless has the last level, what is no number counts as
// nothing.
inline FootprintGrid footprint_grid(
    const UvFootprint& footprint, int width, int height, int last, int most_along) {
  const FootprintSides sides = footprint_sides(footprint, width, height);
  FootprintGrid grid;
  if (!(sides.longer > least_footprint)) return grid;
  if (!(sides.longer < widest_footprint)) {
    grid.fine = last;
    return grid;
  }
  const float step = std::max({sides.narrower / most_across,
                               sides.longer / static_cast<float>(most_along), least_footprint});
  grid.set_level(trilinear_texel * step, last);
  if (grid.fine == last) return grid;
  const auto look_ups = [step](float length, int most) {
    return std::clamp(static_cast<int>(std::ceil(length / step - 0.01F)), std::min(2, most), most);
  };
  grid.along = look_ups(sides.longer, most_along);
  grid.across = look_ups(sides.narrower, most_across);
  spread(grid, sides, width, height, 1);
  return grid;
}

// Look-ups in single levels that lie no further apart than texels do, so that no pattern slips
// between them: in the finest level where so few are enough, and where it would soon be the next
// one's turn, with a share of `share_of_next`, there. Of noise, as a share of such means'
// deviation, and of an edge, as one of its height, these err by .18 and .010 with 19 look-ups,
// where 2x2 trilinear ones do by .42 and .020 with 7; over rectangles by .23 and .006 with 47, and
// .41 and .007 with 27. (Squares 1.5 to 10 texels wide, rectangles four times as long.)
struct DenseGrids {
  FootprintGrid grid, next;
  float share_of_next = 0;
};
inline constexpr int most_dense_along = 18, most_dense_across = 6;
inline DenseGrids dense_grids(const UvFootprint& footprint, int width, int height, int last) {
  constexpr float soon = 0.2F;  // levels
  const FootprintSides sides = footprint_sides(footprint, width, height);
  DenseGrids dense;
  if (!(sides.longer > least_footprint)) return dense;
  if (!(sides.longer < widest_footprint)) {
    dense.grid.fine = last;
    return dense;
  }
  const float level = std::log2(
      std::max({sides.narrower / most_dense_across, sides.longer / most_dense_along, 1e-3F}));
  const auto grid_in = [&](int k) {
    FootprintGrid grid;
    grid.fine = std::min(k, last);
    if (grid.fine == last) return grid;
    const float texel = std::exp2(static_cast<float>(k));
    const auto look_ups = [texel](float length, int most) {
      return std::clamp(static_cast<int>(std::ceil(length / texel - 0.01F)), 2, most);
    };
    grid.along = look_ups(sides.longer, most_dense_along);
    grid.across = look_ups(sides.narrower, most_dense_across);
    spread(grid, sides, width, height, texel);
    return grid;
  };
  const int k = std::max(static_cast<int>(std::ceil(level)), 0);
  dense.grid = grid_in(k);
  dense.share_of_next =
      dense.grid.fine < last ? std::max(1 - (static_cast<float>(k) - level) / soon, 0.0F) : 0;
  if (dense.share_of_next > 0) dense.next = grid_in(k + 1);
  return dense;
}

}  // namespace render
