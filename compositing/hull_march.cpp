// Rays through a visual hull.
#include "compositing/hull_march.h"

#include <algorithm>
#include <cmath>

namespace compositing {
namespace {

using calibrate::Vec3f;

constexpr float opaque = 0.998F;
constexpr float most_steps = 4096;
constexpr int bisections = 4;          // of a step, where the surface is
constexpr float nearest_m = 0.1F;      // depth before a camera at which steps are no finer
constexpr float step_of_width = 0.5F;  // of a look-up, that is no step

}  // namespace

HullMarch::Lines HullMarch::lines_of(const HullRay& ray) const {
  Lines lines;
  lines.width_m = ray.width_m, lines.width_per_m = ray.width_per_m;
  for (std::size_t i = 0; i < block_.views; ++i) {
    const CameraGrid& camera = block_.view[i].camera;
    const HullCells::Straight& straight = cells_.straight(i);
    const auto in_steps = [&](Vec3f p) {
      const float x = (p.x - camera.first[0] * p.z) * camera.steps_a_unit[0];
      const float y = (p.y - camera.first[1] * p.z) * camera.steps_a_unit[1];
      if (!straight.is) return Vec3f{x, y, p.z};
      const GridPlace first = straight.first, by_x = straight.by_x, by_y = straight.by_y;
      return Vec3f{first.u * p.z + by_x.u * x + by_y.u * y, first.v * p.z + by_x.v * x + by_y.v * y,
                   p.z};
    };
    lines.begin[i] = in_steps(in_camera(camera, ray.origin));
    lines.along[i] = in_steps(turned_to_camera(camera, ray.direction));
  }
  return lines;
}

std::optional<HullMarch::Place> HullMarch::place_at(const Lines& lines,
                                                    std::size_t view,
                                                    float t) const {
  const Vec3f p = lines.begin[view] + lines.along[view] * t;
  if (!(p.z > 1e-4F)) return std::nullopt;
  const CameraGrid& camera = block_.view[view].camera;
  const float by_z = 1 / p.z;
  const float x = p.x * by_z, y = p.y * by_z;
  const auto place = cells_.straight(view).is ? std::optional(GridPlace{x, y})
                                              : place_in_grid(camera, places_of(view), x, y);
  if (!place || !is_in_picture(*place)) return std::nullopt;
  return Place{*place, (lines.width_m + lines.width_per_m * t) * camera.uv_per_tangent * by_z};
}

// Right where it is more than `least`.
float HullMarch::quick_alpha_at(Lines& lines, float t, float least) const {
  float alpha = 1;
  bool seen = false;
  for (std::size_t k = 0, i = lines.first; k < block_.views; ++k, ++i) {
    if (i == block_.views) i = 0;
    const auto at = place_at(lines, i, t);
    if (!at) continue;
    seen = true;
    const float own =
        pictures_[block_.view[i].picture]->quick_alpha(at->place.u, at->place.v, at->width_uv);
    alpha = std::min(alpha, own);
    if (!(alpha > least)) {
      lines.first = i;
      break;
    }
  }
  return seen ? alpha : 0;
}

float HullMarch::alpha_at(const Lines& lines, float t) const {
  float alpha = 1;
  bool seen = false;
  for (std::size_t i = 0; i < block_.views; ++i) {
    const auto at = place_at(lines, i, t);
    if (!at) continue;
    seen = true;
    alpha = std::min(alpha, pictures_[block_.view[i].picture]->look_up(at->place.u, at->place.v,
                                                                       at->width_uv)[3]);
  }
  return seen ? alpha : 0;
}

float HullMarch::step_of(const HullRay& ray, float from, float to, float coarser) const {
  float steps = 1;
  for (std::size_t i = 0; i < block_.views; ++i) {
    const CameraGrid& camera = block_.view[i].camera;
    const Vec3f a = in_camera(camera, ray.origin), b = turned_to_camera(camera, ray.direction);
    const float x = b.x * a.z - b.z * a.x, y = b.y * a.z - b.z * a.y;
    const float z = std::max(std::min(a.z + b.z * from, a.z + b.z * to), nearest_m);
    const float px =
        std::sqrt(x * x + y * y) / (z * z) * (to - from) * block_.view[i].px_per_tangent;
    const float step_px = block_.step_px * coarser;
    if (px > steps * step_px) steps = px / step_px;  // nor where it is no number
  }
  const float width_m =
      std::min(ray.width_m + ray.width_per_m * from, ray.width_m + ray.width_per_m * to);
  const float step_m = (to - from) / std::ceil(std::min(steps, most_steps));
  return std::max(step_m, std::min(step_of_width * width_m, to - from));
}

HullMarch::Crossing HullMarch::find(const HullRay& ray, float from_m, float to_m) const {
  return search(ray, from_m, to_m, 1, true);
}

float HullMarch::opacity(const HullRay& ray, float from_m, float to_m, float coarser) const {
  return search(ray, from_m, to_m, coarser, false).alpha;
}

HullMarch::Crossing HullMarch::search(
    const HullRay& ray, float from_m, float to_m, float coarser, bool where) const {
  Crossing found;
  found.far_m = to_m;
  if (!(to_m > from_m) || !std::isfinite(to_m)) return found;
  const float widest_m =
      std::max(ray.width_m + ray.width_per_m * from_m, ray.width_m + ray.width_per_m * to_m);
  CellWalk walk(cells_, ray.origin, ray.direction, from_m, to_m, widest_m);
  CellWalk::Piece piece;
  if (!walk.next(piece)) return found;
  Lines lines = lines_of(ray);
  const float step = step_of(ray, from_m, to_m, coarser);
  const float by_step = 1 / step;
  const auto middle_of = [&](float i) { return from_m + step * (i + 0.5F); };
  float half_at = from_m, alpha_there = 0, most_at = from_m;
  float i = 0;
  do {
    i = std::max(i, std::ceil((piece.from_m - from_m) * by_step - 0.5F));
    for (float t = middle_of(i); t < piece.to_m; t = middle_of(++i)) {
      const float alpha = quick_alpha_at(lines, t, std::max(found.alpha, no_alpha));
      if (!(alpha > found.alpha && alpha > no_alpha)) continue;
      found.alpha = alpha, most_at = t;
      if (alpha_there < 0.5F * alpha) half_at = t, alpha_there = alpha;
      if (alpha >= opaque) break;
    }
  } while (found.alpha < opaque && walk.next(piece));
  if (!(found.alpha > 0)) return found;
  float before = std::max(half_at - step, from_m), after = half_at;
  for (int k = 0; where && k < bisections; ++k) {
    const float middle = 0.5F * (before + after);
    const bool reached = quick_alpha_at(lines, middle, 0.5F * found.alpha) > 0.5F * found.alpha;
    (reached ? after : before) = middle;
  }
  found.at_m = after;
  if (found.alpha >= opaque) {
    found.alpha = 1, found.far_m = most_at;
  } else {
    found.alpha = alpha_at(lines, most_at);
  }
  return found;
}

std::optional<std::array<float, 4>> HullMarch::look(std::size_t view,
                                                    Vec3f p_set,
                                                    float width_m) const {
  const CameraGrid& camera = block_.view[view].camera;
  const auto at = seen_by_camera(camera, places_of(view), in_camera(camera, p_set));
  if (!at || !is_in_picture(at->place)) return std::nullopt;
  return pictures_[block_.view[view].picture]->look_up(at->place.u, at->place.v,
                                                       width_m * at->uv_per_metre);
}

}  // namespace compositing
