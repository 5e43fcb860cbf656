// How far two lenses are from each other.
#include "calibrate/lens_distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibrate/rotation_fit.h"

namespace calibrate {

std::optional<LensDistance> distance_between(const Lens& a,
                                             const Lens& b,
                                             std::span<const Vec2> pixels) {
  const auto by_a = unproject_all(a, pixels);
  const auto by_b = unproject_all(b, pixels);
  std::vector<Vec2> q;
  std::vector<Vec3> v_a, v_b;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!by_a[i] || !by_b[i]) continue;
    q.push_back(pixels[i]);
    v_a.push_back(*by_a[i]);
    v_b.push_back(*by_b[i]);
  }
  const Mat3 a_from_b = best_rotation(v_b, v_a);
  for (Vec3& v : v_b) v = a_from_b * v;
  const auto seen = project_all(a, v_b);
  LensDistance sum;
  double count = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (!seen[i]) continue;
    const double angle = std::atan2(length(cross(v_a[i], v_b[i])), dot(v_a[i], v_b[i]));
    sum.angle_rad += angle * angle;
    const double off = squared(Vec2{seen[i]->x - q[i].x, seen[i]->y - q[i].y});
    sum.axis_px += off / 2;
    sum.greatest_px = std::max(sum.greatest_px, std::sqrt(off));
    ++count;
  }
  if (count < 3) return std::nullopt;
  return LensDistance{std::sqrt(sum.angle_rad / count), std::sqrt(sum.axis_px / count),
                      sum.greatest_px};
}

}  // namespace calibrate
