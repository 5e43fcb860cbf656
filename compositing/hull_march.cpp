// Rays through a visual hull.
#include "compositing/hull_march.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace compositing {
namespace {

using calibrate::Vec3f;

constexpr float opaque = 0.998F;
constexpr int most_levels = 12;        // of halving a ray
constexpr int stride = 2;              // levels at a time
constexpr int bisections = 4;          // of a step, where the surface is
constexpr float nearest_m = 0.1F;      // depth before a camera at which steps are no finer
constexpr float margin = 1.5F;         // of look-ups, in widths
constexpr float bend = 0.02F;          // of a piece of a ray in a picture
constexpr float nothing = 1.5F / 255;  // alpha that is not looked for

bool is_within(GridPlace p) { return p.u >= 0 && p.u <= 1 && p.v >= 0 && p.v <= 1; }

}  // namespace

std::optional<HullMarch::Place> HullMarch::place_at(const Lines& lines,
                                                    std::size_t view,
                                                    float t) const {
  const auto at = seen_by_camera(block_.view[view].camera, places_of(view),
                                 lines.begin[view] + lines.along[view] * t);
  if (!at || !is_within(at->place)) return std::nullopt;
  return Place{at->place, (lines.width_m + lines.width_per_m * t) * at->uv_per_metre};
}

// Exact where it is more than `least`.
float HullMarch::alpha_at(const Lines& lines, float t, float least) const {
  float alpha = 1;
  bool seen = false;
  for (std::size_t i = 0; i < block_.views; ++i) {
    const auto at = place_at(lines, i, t);
    if (!at) continue;
    seen = true;
    const auto rgba =
        pictures_[block_.view[i].picture]->look_up(at->place.u, at->place.v, at->width_uv);
    alpha = std::min(alpha, rgba[3]);
    if (!(alpha > least)) break;
  }
  return seen ? alpha : 0;
}

// What no alpha on a piece of the ray exceeds in the camera's picture, if the camera sees all of
// it.
float HullMarch::most_between(std::size_t view,
                              const std::optional<Place>& first,
                              const std::optional<Place>& middle,
                              const std::optional<Place>& last) const {
  if (!first || !last || !middle) return 1;
  const auto [u0, u1] = std::minmax({first->place.u, middle->place.u, last->place.u});
  const auto [v0, v1] = std::minmax({first->place.v, middle->place.v, last->place.v});
  // Pictures are rarely twice as high as wide, or as wide as high; lenses bend lines.
  const float width_uv = std::max({first->width_uv, middle->width_uv, last->width_uv});
  const float rim = margin * width_uv + bend * (u1 - u0 + v1 - v0);
  return pictures_[block_.view[view].picture]->most_alpha(u0 - rim, v0 - rim, u1 + rim, v1 + rim);
}

// How often the ray is halved until no picture is crossed by longer steps than asked for.
int HullMarch::levels_of(const Lines& lines, float from, float to, float coarser) const {
  float steps = 1;
  for (std::size_t i = 0; i < block_.views; ++i) {
    const Vec3f a = lines.begin[i], b = lines.along[i];
    const float across = std::hypot(b.x * a.z - b.z * a.x, b.y * a.z - b.z * a.y);
    const float z = std::max(std::min(a.z + b.z * from, a.z + b.z * to), nearest_m);
    const float px = across / (z * z) * (to - from) * block_.view[i].px_per_tangent;
    const float step_px = block_.step_px * coarser;
    if (px > steps * step_px) steps = px / step_px;  // nor where it is no number
  }
  const float most = static_cast<float>(1 << most_levels);
  return std::bit_width(static_cast<unsigned>(std::ceil(std::min(steps, most))) - 1U);
}

HullMarch::Crossing HullMarch::find(const HullRay& ray,
                                    float from_m,
                                    float to_m,
                                    float coarser) const {
  Crossing found;
  found.far_m = to_m;
  if (!(to_m > from_m) || !std::isfinite(to_m)) return found;
  Lines lines;
  lines.width_m = ray.width_m, lines.width_per_m = ray.width_per_m;
  for (std::size_t i = 0; i < block_.views; ++i) {
    const CameraGrid& camera = block_.view[i].camera;
    lines.begin[i] = in_camera(camera, ray.origin);
    lines.along[i] = turned_to_camera(camera, ray.direction);
  }
  const int levels = levels_of(lines, from_m, to_m, coarser);
  const unsigned count = 1U << levels;
  const float step = (to_m - from_m) / static_cast<float>(count);
  const auto begin_of = [&](unsigned i) { return from_m + step * static_cast<float>(i); };
  // The longest piece that begins here and is one that others are made of.
  const auto level_at = [&](unsigned i) {
    const int longest = std::countr_zero(i);
    return longest >= levels
               ? levels
               : std::max(levels - (levels - longest + stride - 1) / stride * stride, 0);
  };
  float half_at = from_m, alpha_there = 0;
  int level = levels;
  std::size_t emptied = 0;  // the camera that saw nothing last
  std::array<std::optional<Place>, most_hull_views> begins;
  std::array<unsigned, most_hull_views> begins_at;
  begins_at.fill(count);
  for (unsigned i = 0; i < count;) {
    const unsigned width = 1U << level;
    bool empty = false;
    for (std::size_t k = 0; k < block_.views && level > 0 && !empty; ++k) {
      const std::size_t view = (emptied + k) % block_.views;
      if (begins_at[view] != i) begins[view] = place_at(lines, view, begin_of(i));
      begins_at[view] = i;
      if (!begins[view]) continue;
      const float from = begin_of(i), to = begin_of(i + width);
      empty = most_between(view, begins[view], place_at(lines, view, 0.5F * (from + to)),
                           place_at(lines, view, to)) <= std::max(found.alpha, nothing);
      if (empty) emptied = view;
    }
    if (level > 0 && !empty) {
      level = std::max(level - stride, 0);
      continue;
    }
    if (level == 0) {
      const float t = from_m + step * (static_cast<float>(i) + 0.5F);
      const float alpha = alpha_at(lines, t, found.alpha);
      if (alpha > found.alpha) {
        found.alpha = alpha;
        if (alpha_there < 0.5F * alpha) half_at = t, alpha_there = alpha;
      }
      if (alpha >= opaque) {
        found.alpha = 1;
        found.far_m = t;
        break;
      }
    }
    i += width;
    if (i < count) level = level_at(i);
  }
  if (!(found.alpha > 0)) return found;
  float before = std::max(half_at - step, from_m), after = half_at;
  for (int i = 0; i < bisections; ++i) {
    const float middle = 0.5F * (before + after);
    const bool reached = alpha_at(lines, middle, 0.5F * found.alpha) >= 0.5F * found.alpha;
    (reached ? after : before) = middle;
  }
  found.at_m = after;
  return found;
}

std::optional<std::array<float, 4>> HullMarch::look(std::size_t view,
                                                    Vec3f p_set,
                                                    float width_m) const {
  const CameraGrid& camera = block_.view[view].camera;
  const auto at = seen_by_camera(camera, places_of(view), in_camera(camera, p_set));
  if (!at || !is_within(at->place)) return std::nullopt;
  return pictures_[block_.view[view].picture]->look_up(at->place.u, at->place.v,
                                                       width_m * at->uv_per_metre);
}

}  // namespace compositing
