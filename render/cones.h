// Cones of samples: of pixels, and of rays that surfaces sent on. Private to the kernel.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "calibrate/lens.h"
#include "render/shader.h"

namespace render {

// By how much directions differ across a pixel of the picture and down it, in the camera's frame:
// half of the way from the one before to the one after, or what there is of it.
inline std::array<Vec3f, 2> pixel_sides(const calibrate::DirectionTable& table, int x, int y) {
  const auto at = [&](std::size_t t) { return Vec3f{table.x[t], table.y[t], table.z[t]}; };
  const std::size_t here = table.index(y, x);
  const auto across = [&](std::size_t before, std::size_t after) {
    const Vec3f a = at(before), b = at(after), middle = at(here);
    const bool has_a = a != Vec3f{}, has_b = b != Vec3f{};
    if (has_a && has_b) return (b - a) * 0.5F;
    return has_b ? b - middle : has_a ? middle - a : Vec3f{};
  };
  const auto row = static_cast<std::size_t>(table.width + 2);
  return {across(here - 1, here + 1), across(here - row, here + row)};
}

// arrive(), of a ray that surfaces sent on from the middle of a lobe, or as one of many all over
// it.
inline void arrive_bounced(ShadePoint& p,
                           const Spread& steps,
                           const Spread& turns,
                           float roughness,
                           bool one_of_many,
                           float distance_m) {
  // Of parts of a lobe, over their width: a ray stands for a part of it, and these overlap.
  constexpr float overlap = 1.05F;
  // The full angle of a disc that holds half of its light as near its middle as a lobe does: half
  // of a lobe lies within 2 alpha of the mirrored direction.
  const float lobe_rad = 2 * 2 / 0.7F * roughness * roughness;
  arrive(p, steps, turns, distance_m);
  p.blur_m = one_of_many ? overlap * std::sqrt(length(cross(p.steps.a, p.steps.b)))
                         : distance_m * lobe_rad;
}

}  // namespace render
