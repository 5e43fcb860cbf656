// Lights of a scene that are smaller than pixels: which pixels look for them.
#include <algorithm>
#include <cmath>

#include "render/cell_baker.h"
#include "render/cones.h"

namespace render {
namespace {

// Of a small light's place in a pixel: the part that a square covers whose corners lie on a circle
// of radius 1. Four samples for each such part of the pixel, and their pattern has one in it.
constexpr float square_in_cone = 2;

}  // namespace

// Light between the rays of pixels' centres shows in none of them: pixels that it may shine in take
// further rays, so many that some meet it.
void CellBaker::mark_small_lights() {
  least_samples_.fill(0);
  if (frame_->small_lights.empty()) return;
  const auto& table = *frame_->inputs.directions;
  const auto at = [&](int x, int y) {
    const std::size_t t = table.index(std::min(y, table.height - 1), std::min(x, table.width - 1));
    return Vec3f{table.x[t], table.y[t], table.z[t]};
  };
  const Vec3f middle = at(x0_ + cell_size / 2, y0_ + cell_size / 2);
  float reach = 0;
  for (const int y : {y0_ - 1, y0_ + cell_size}) {
    for (const int x : {x0_ - 1, x0_ + cell_size})
      reach = std::max(reach, length(at(x, y) - middle));
  }
  constexpr float bent = 1.3F;  // by lenses: more than lies between corners and middle
  // Less than this, and further samples would not matter either.
  const float least = first_tolerance * effort_.aa_tolerance;
  // Where the lens does not see all of a cell, lights may be anywhere.
  const float near = middle != Vec3f{} && reach < 0.5F ? bent * reach + frame_->pixel_angle : 2;
  // A cell's pixels are alike: none reaches as far as a quarter of that from its middle.
  const float far = near < 2 ? reach / 4 + 2 * frame_->pixel_angle : 1;
  auto first = std::ranges::lower_bound(frame_->small_lights, middle.x - near, {},
                                        [](const SmallLight& light) { return light.direction.x; });
  for (; first != frame_->small_lights.end() && first->direction.x <= middle.x + near; ++first) {
    const SmallLight& light = *first;
    if (length(light.direction - middle) > near) continue;
    for (int k = 0; k < static_cast<int>(cell_pixels); ++k) {
      const auto own = static_cast<std::size_t>(k);
      const int x = k % cell_size, y = k / cell_size;
      if (!is_inside(own)) continue;
      const Vec3f off = light.direction - at(x0_ + x, y0_ + y);
      if (!(dot(off, off) < far * far)) continue;
      const auto sides = pixel_sides(*frame_->inputs.directions, x0_ + x, y0_ + y);
      const bool crosses = std::ranges::all_of(sides, [&](Vec3f side) {
        const float width = length(side);
        return std::abs(dot(off, side)) < (0.5F * width + light.half_rad) * width;
      });
      if (!crosses) continue;
      const float pixel = std::sqrt(length(sides[0]) * length(sides[1]));
      const float part = light.half_rad / pixel;
      const float share = std::min(square_in_cone * part * part, 1.0F);
      if (!(std::min(light.radiance, sample_limit) * share > least)) continue;
      edge_[own] = Edge::surface;
      least_samples_[own] =
          std::max(least_samples_[own],
                   static_cast<int>(std::min(4 / share, static_cast<float>(samples_max))));
    }
  }
}

}  // namespace render
