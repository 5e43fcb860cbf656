// The box about a person's visual hull.
#include "compositing/person_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace compositing {

using calibrate::Vec3;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr float somebody = 0.1F;  // alpha
constexpr int around_px = 2;
constexpr double at_edge_px = 3;  // of the picture: an outline so near goes on
constexpr double least_z = 0.02;  // of a unit direction, that has a place in the camera's plane
constexpr double reach_m = 3, above_floor_m = 1e-3, margin_m = 0.02;
constexpr double limb_m = 0.8;  // that may reach farther aside beyond a picture than within it

// All p with dot(normal, p) <= limit.
struct HalfSpace {
  Vec3 normal;
  double limit = 0;
};

// At which edges of its picture an outline goes on beyond it.
struct Cut {
  bool left, top, right, bottom;
};
Cut cut_of(const OutlinedView& view) {
  const auto [left, top, right, bottom] = view.box;
  return {left <= at_edge_px, top <= at_edge_px, right >= view.lens.width - 1 - at_edge_px,
          bottom >= view.lens.height - 1 - at_edge_px};
}

// The outline's cone: four planes through the camera, without those of the picture's edges. What is
// beyond one edge may be wider than what the picture shows: planes of the edges beside it let as
// much as a limb by, where another view shows it whole (`some_whole`).
void add_cone(const OutlinedView& view, bool some_whole, std::vector<HalfSpace>& spaces) {
  const auto [left, top, right, bottom] = view.box;
  const Cut cut = cut_of(view);
  double x0 = infinity, x1 = -infinity, y0 = infinity, y1 = -infinity;
  constexpr int steps = 16;
  for (int i = 0; i <= steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    const double x = left + s * (right - left), y = top + s * (bottom - top);
    for (const calibrate::Vec2 q : {calibrate::Vec2{x, top}, {x, bottom}, {left, y}, {right, y}}) {
      const auto v = calibrate::unproject(view.lens, q);
      if (!v || !(v->z > least_z * length(*v))) return;  // the cone is wider than that
      x0 = std::min(x0, v->x / v->z), x1 = std::max(x1, v->x / v->z);
      y0 = std::min(y0, v->y / v->z), y1 = std::max(y1, v->y / v->z);
    }
  }
  const calibrate::Pose set_from_cam = inverse(view.cam_from_set);
  const Vec3 camera = calibrate::position_of(view.cam_from_set);
  const auto add = [&](bool at_edge, bool goes_on, Vec3 v_cam) {
    if (at_edge) return;
    const Vec3 normal = set_from_cam.R * normalize(v_cam);
    spaces.push_back({normal, dot(normal, camera) + (some_whole && goes_on ? limb_m : 0)});
  };
  add(cut.left, cut.top || cut.bottom, {-1, 0, x0});
  add(cut.right, cut.top || cut.bottom, {1, 0, -x1});
  add(cut.top, cut.left || cut.right, {0, -1, y0});
  add(cut.bottom, cut.left || cut.right, {0, 1, -y1});
}

// Where three planes meet.
std::optional<Vec3> corner_of(const HalfSpace& a, const HalfSpace& b, const HalfSpace& c) {
  const Vec3 bc = cross(b.normal, c.normal);
  const double volume = dot(a.normal, bc);
  if (!(std::abs(volume) > 1e-9)) return std::nullopt;
  return (a.limit * bc + b.limit * cross(c.normal, a.normal) +
          c.limit * cross(a.normal, b.normal)) *
         (1 / volume);
}

}  // namespace

std::optional<std::array<float, 4>> outline_box(const capture::Image& alpha) {
  if (alpha.channels != 1) throw std::invalid_argument("a matte has one channel");
  int left = alpha.width, top = alpha.height, right = -1, bottom = -1;
  for (int y = 0; y < alpha.height; ++y) {
    for (int x = 0; x < alpha.width; ++x) {
      if (!(alpha.at(y, x) >= somebody)) continue;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
  }
  if (right < left) return std::nullopt;
  const auto edge = [](int at) { return static_cast<float>(at); };
  return std::array{edge(left - around_px), edge(top - around_px), edge(right + around_px),
                    edge(bottom + around_px)};
}

std::optional<PersonBox> person_box(std::span<const OutlinedView> views, Vec3 standing) {
  std::vector<HalfSpace> spaces{
      {{-1, 0, 0}, reach_m - standing.x},        {{1, 0, 0}, reach_m + standing.x},
      {{0, -1, 0}, reach_m - standing.y},        {{0, 1, 0}, reach_m + standing.y},
      {{0, 0, -1}, -above_floor_m - standing.z}, {{0, 0, 1}, reach_m + standing.z}};
  // Where no view shows all of the person, what each shows has to stand for the rest.
  const bool some_whole = std::ranges::any_of(views, [](const OutlinedView& view) {
    const Cut cut = cut_of(view);
    return !cut.left && !cut.top && !cut.right && !cut.bottom;
  });
  for (const OutlinedView& view : views) add_cone(view, some_whole, spaces);
  // Few planes: all their corners are tried.
  PersonBox box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  constexpr double rounding = 1e-6;
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    for (std::size_t j = i + 1; j < spaces.size(); ++j) {
      for (std::size_t k = j + 1; k < spaces.size(); ++k) {
        const auto p = corner_of(spaces[i], spaces[j], spaces[k]);
        if (!p || !std::ranges::all_of(spaces, [&](const HalfSpace& s) {
              return dot(s.normal, *p) <= s.limit + rounding;
            })) {
          continue;
        }
        box.lower = {std::min(box.lower.x, p->x), std::min(box.lower.y, p->y),
                     std::min(box.lower.z, p->z)};
        box.upper = {std::max(box.upper.x, p->x), std::max(box.upper.y, p->y),
                     std::max(box.upper.z, p->z)};
      }
    }
  }
  if (!(box.upper.x >= box.lower.x) || !std::isfinite(length(box.upper - box.lower))) {
    return std::nullopt;
  }
  const Vec3 margin{margin_m, margin_m, margin_m};
  box.lower = box.lower - margin, box.upper = box.upper + margin;
  box.lower.z = std::max(box.lower.z, standing.z + above_floor_m);
  return box.upper.z > box.lower.z ? std::optional(box) : std::nullopt;
}

}  // namespace compositing
