// Cells and moving things.
#include "render/cell_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/box_meets.h"

namespace render {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

bool is_empty(const Scene::Bounds& b) { return !(b.lower.x <= b.upper.x); }

Vec3f middle(const Scene::Bounds& b) { return (b.lower + b.upper) * 0.5F; }
Vec3f half_size(const Scene::Bounds& b) { return (b.upper - b.lower) * 0.5F; }

Scene::Bounds grown(const Scene::Bounds& b, Vec3f by) { return {b.lower - by, b.upper + by}; }

bool have_common(const SpaceGrid::Mask& a, const SpaceGrid::Mask& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] & b[i]) return true;
  }
  return false;
}

}  // namespace

SpaceGrid::SpaceGrid(const Scene::Bounds& bounds) {
  if (is_empty(bounds)) return;
  const Vec3f half = half_size(bounds);
  const float least = 1e-3F * std::max({half.x, half.y, half.z, 1e-6F});
  const Vec3f wide{std::max(half.x, least), std::max(half.y, least), std::max(half.z, least)};
  constexpr float beside_outermost = static_cast<float>(side) / static_cast<float>(side - 2);
  const Scene::Bounds all =
      grown({middle(bounds), middle(bounds)}, wide * (1.5F * beside_outermost));
  lower_ = all.lower;
  size_ = (all.upper - all.lower) * (1.0F / side);
  per_size_ = {1 / size_.x, 1 / size_.y, 1 / size_.z};
}

bool SpaceGrid::holds(const Scene::Bounds& bounds) const {
  if (is_empty(bounds)) return true;
  if (!is_laid()) return false;
  const Vec3f lower = lower_ + size_, upper = lower_ + size_ * static_cast<float>(side - 1);
  return bounds.lower.x >= lower.x && bounds.upper.x < upper.x && bounds.lower.y >= lower.y &&
         bounds.upper.y < upper.y && bounds.lower.z >= lower.z && bounds.upper.z < upper.z;
}

int SpaceGrid::box_at(Vec3f p) const {
  if (!is_laid()) return -1;
  const Vec3f at{(p.x - lower_.x) * per_size_.x, (p.y - lower_.y) * per_size_.y,
                 (p.z - lower_.z) * per_size_.z};
  constexpr auto end = static_cast<float>(side);
  const auto in = [](float v) { return v >= 0 && v < end; };
  if (!in(at.x) || !in(at.y) || !in(at.z)) return -1;
  return (static_cast<int>(at.z) * side + static_cast<int>(at.y)) * side + static_cast<int>(at.x);
}

Scene::Bounds SpaceGrid::box(int index) const {
  const Vec3f at{static_cast<float>(index % side), static_cast<float>(index / side % side),
                 static_cast<float>(index / (side * side))};
  const Vec3f corner = lower_ + at * size_;
  return {corner, corner + size_};
}

void SpaceGrid::mark_line(Vec3f from, Vec3f direction, float far_m, Mask& mask) const {
  if (!is_laid()) return;
  constexpr auto end = static_cast<float>(side);
  const Vec3f along = direction * per_size_;
  const Vec3f begin = (from - lower_) * per_size_;
  // Within one box, as most rays in glass are: far from the walls, for these count to either side.
  constexpr float clear = 1e-3F;
  const Vec3f stop = begin + along * far_m;
  const auto in_one = [](float a, float b) {
    const float low = std::min(a, b), high = std::max(a, b), wall = std::floor(low);
    return low >= wall + clear && high <= wall + 1 - clear && low >= 0 && high < end;
  };
  if (in_one(begin.x, stop.x) && in_one(begin.y, stop.y) && in_one(begin.z, stop.z)) {
    const auto i = static_cast<std::size_t>(
        (static_cast<int>(begin.z) * side + static_cast<int>(begin.y)) * side +
        static_cast<int>(begin.x));
    mask[i / 64] |= std::uint64_t{1} << (i % 64);
    return;
  }
  std::array<int, 3> box, step, last;
  std::array<float, 3> next, between;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const float d = part(along, axis), o = part(begin, axis);
    box[a] = static_cast<int>(std::min(std::max(0.0F, o), end - 1));
    step[a] = d < 0 ? -1 : 1;
    last[a] = d < 0 ? 0 : side - 1;
    const auto wall = static_cast<float>(box[a] + (d < 0 ? 0 : 1));
    next[a] = d == 0 || box[a] == last[a] ? infinite : (wall - o) / d;
    between[a] = d == 0 ? infinite : std::abs(1 / d);
  }
  while (true) {
    const auto i = static_cast<std::size_t>((box[2] * side + box[1]) * side + box[0]);
    mask[i / 64] |= std::uint64_t{1} << (i % 64);
    const std::size_t a =
        next[0] < next[1] ? (next[0] < next[2] ? 0U : 2U) : (next[1] < next[2] ? 1U : 2U);
    if (!(next[a] <= far_m) || next[a] == infinite) return;
    box[a] += step[a];
    next[a] = box[a] == last[a] ? infinite : next[a] + between[a];
  }
}

void SpaceGrid::mark_bounds(const Scene::Bounds& bounds, Mask& mask) const {
  if (!is_laid() || is_empty(bounds)) return;
  // A little larger: a line that runs along a wall may be counted to either side.
  const Scene::Bounds all = grown(bounds, size_ * 0.01F);
  std::array<int, 3> first, last;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const auto box_of = [&](Vec3f p) {
      const float at = (part(p, axis) - part(lower_, axis)) * part(per_size_, axis);
      return static_cast<int>(std::min(std::max(0.0F, at), static_cast<float>(side - 1)));
    };
    first[a] = box_of(all.lower), last[a] = box_of(all.upper);
  }
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        const auto i = static_cast<std::size_t>((z * side + y) * side + x);
        mask[i / 64] |= std::uint64_t{1} << (i % 64);
      }
    }
  }
}

CellCone cell_cone(const calibrate::DirectionTable& table, const CameraTurn& turn, int x0, int y0) {
  const auto direction_at = [&](int x, int y) {
    const std::size_t t =
        table.index(std::clamp(y, 0, table.height - 1), std::clamp(x, 0, table.width - 1));
    return normalize(turn.to_set(Vec3f{table.x[t], table.y[t], table.z[t]}));
  };
  CellCone cone;
  cone.axis = direction_at(x0 + cell_size / 2, y0 + cell_size / 2);
  float cosine = 1;
  for (int y = y0 - 2; y <= y0 + cell_size + 1; ++y) {
    for (int x = x0 - 2; x <= x0 + cell_size + 1; ++x) {
      cosine = std::min(cosine, dot(cone.axis, direction_at(x, y)));
    }
  }
  // Where the lens sees nothing there is no direction: then any may be.
  if (dot(cone.axis, cone.axis) > 0.5F && cosine > 0) {
    cone.half_rad = std::acos(std::min(cosine, 1.0F)) + 1e-3F;
  }
  return cone;
}

std::vector<CellCone> cell_cones(const calibrate::DirectionTable& table, const CameraTurn& turn) {
  std::vector<CellCone> cones;
  for (int y0 = 0; y0 < table.height; y0 += cell_size) {
    for (int x0 = 0; x0 < table.width; x0 += cell_size) {
      cones.push_back(cell_cone(table, turn, x0, y0));
    }
  }
  return cones;
}

// No ray of the cone is further from its axis, at what is there, than the box is grown by.
bool may_be_seen(const CellCone& cone, Vec3f camera, const Scene::Bounds& bounds) {
  constexpr float wide_rad = 1;  // from here on any may be
  if (!(cone.half_rad < wide_rad)) return true;
  const float farthest = length(middle(bounds) - camera) + length(half_size(bounds));
  const float aside = std::tan(cone.half_rad + 1e-3F) * farthest;
  return meets(grown(bounds, {aside, aside, aside}), camera, cone.axis, infinite);
}

MovedThings::MovedThings(std::vector<Scene::Bounds> where,
                         const SpaceGrid& grid,
                         const LightTable& lights,
                         const SoftLights& soft,
                         const SpaceGrid::Mask& receivers,
                         std::vector<Scene::Bounds> relit)
    : where_(std::move(where)), lights_(lights), soft_(soft), relit_(std::move(relit)) {
  for (const Scene::Bounds& bounds : where_) grid.mark_bounds(bounds, filled_);
  for (int i = 0; i < SpaceGrid::side * SpaceGrid::side * SpaceGrid::side; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (!(receivers[at / 64] >> (at % 64) & 1) || !may_shade(grid.box(i))) continue;
    shaded_[at / 64] |= std::uint64_t{1} << (at % 64);
  }
  for (const Scene::Bounds& bounds : relit_) grid.mark_bounds(bounds, shaded_);
}

// Whether anything that moved lies between any of those points and a light: for a lamp, between
// their middle and the lamp, if it is larger by as much as they are apart.
bool MovedThings::may_shade(const Scene::Bounds& receivers) const {
  constexpr float margin = 1.02F;
  const Vec3f from = middle(receivers);
  const Vec3f half = half_size(receivers) * margin;
  const Scene::Bounds around{from - half, from + half};
  return std::ranges::any_of(where_, [&](const Scene::Bounds& bounds) {
    for (std::size_t i = 0; i < lights_.lights.size(); ++i) {
      if (may_be_met(bounds, around, soft_.range(i))) return true;
    }
    const Scene::Bounds larger = grown(bounds, half);
    return std::ranges::any_of(lights_.lamps, [&](const LocalLight& lamp) {
      return meets(larger, from, lamp.position - from, 1);
    });
  });
}

bool MovedThings::may_be_seen(const CellCone& cone, Vec3f camera) const {
  return std::ranges::any_of(where_, [&](const Scene::Bounds& bounds) {
    return render::may_be_seen(cone, camera, bounds);
  });
}

bool MovedThings::may_be_passed(const CellReach& reach) const {
  return have_common(reach.passed, filled_);
}

bool MovedThings::may_light(const CellReach::Receivers& receivers) const {
  return have_common(receivers.boxes, shaded_) ||
         (!is_empty(receivers.outside) &&
          (may_shade(receivers.outside) || std::ranges::any_of(relit_, [&](const auto& bounds) {
             return overlap(bounds, receivers.outside);
           })));
}

}  // namespace render
