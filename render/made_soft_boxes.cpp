// Soft boxes, texel by texel.
#include "render/made_soft_boxes.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "render/environment.h"
#include "render/made_noise.h"

namespace render {

capture::Image make_soft_box_map(
    int height, Vec3f above, Vec3f level, Vec3f below, std::span<const SoftBox> boxes) {
  capture::Image map = capture::make_image(height, 2 * height, 3);
  const float texel_rad = std::numbers::pi_v<float> / static_cast<float>(height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      const Vec3f d =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), 2 * height, height);
      const float slope = std::abs(d.z);
      Vec3f radiance = level + ((d.z > 0 ? above : below) - level) * (slope * slope);
      for (const SoftBox& box : boxes) {
        const Vec3f forward = normalize(box.direction);
        const float ahead = dot(d, forward);
        if (ahead <= 0) continue;
        const Vec3f side = normalize(cross(Vec3f{0, 0, 1}, forward));
        const float along = std::abs(std::atan2(dot(d, side), ahead));
        const float up = std::abs(std::atan2(dot(d, cross(forward, side)), ahead));
        const float over = std::max(along - box.width_rad / 2, up - box.height_rad / 2);
        const float share = 1 - smooth_step(-texel_rad, texel_rad, over);
        radiance = radiance + (box.radiance - radiance) * share;
      }
      map.at(y, x, 0) = radiance.x;
      map.at(y, x, 1) = radiance.y;
      map.at(y, x, 2) = radiance.z;
    }
  }
  return map;
}

}  // namespace render
