// Camera rays from a direction table.
#include "render/pixel_rays.h"

namespace render {

PixelRays::PixelRays(const calibrate::DirectionTable& directions,
                     const calibrate::Pose& cam_from_set)
    : directions_(directions),
      set_from_cam_(cam_from_set.R.transposed()),
      origin_(to_float(calibrate::position_of(cam_from_set))) {}

Vec3f PixelRays::at(int x, int y) const {
  const std::size_t i = directions_.index(y, x);
  return {directions_.x[i], directions_.y[i], directions_.z[i]};
}

std::optional<Vec3f> PixelRays::direction(int x, int y, float dx, float dy) const {
  const Vec3f here = at(x, y);
  if (here == Vec3f{}) return std::nullopt;
  const int x0 = dx < 0 ? x - 1 : x;
  const int y0 = dy < 0 ? y - 1 : y;
  const float fx = dx < 0 ? dx + 1 : dx;
  const float fy = dy < 0 ? dy + 1 : dy;
  const Vec3f a = at(x0, y0), b = at(x0 + 1, y0), c = at(x0, y0 + 1), d = at(x0 + 1, y0 + 1);
  const bool whole = a != Vec3f{} && b != Vec3f{} && c != Vec3f{} && d != Vec3f{};
  const Vec3f v_cam =
      whole ? (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy : here;
  return normalize(to_float(set_from_cam_ * to_double(v_cam)));
}

}  // namespace render
