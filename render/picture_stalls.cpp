// Boxes around live pictures.
#include "render/picture_stalls.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace render {
namespace {

float down(float v) { return std::floor(v / PictureStalls::lattice_m) * PictureStalls::lattice_m; }
float up(float v) { return std::ceil(v / PictureStalls::lattice_m) * PictureStalls::lattice_m; }

bool same(const Scene::Bounds& a, const Scene::Bounds& b) {
  return a.lower == b.lower && a.upper == b.upper;
}

bool holds(const std::vector<Scene::Bounds>& boxes, const Scene::Bounds& box) {
  return std::ranges::any_of(boxes, [&](const Scene::Bounds& b) { return same(b, box); });
}

Scene::Bounds outwards(const Scene::Bounds& b, float margin_m) {
  const Vec3f by{margin_m, margin_m, margin_m};
  const Vec3f lower = b.lower - by, upper = b.upper + by;
  return {{down(lower.x), down(lower.y), down(lower.z)}, {up(upper.x), up(upper.y), up(upper.z)}};
}

bool contains(const Scene::Bounds& box, const Scene::Bounds& b) {
  return box.lower.x <= b.lower.x && box.lower.y <= b.lower.y && box.lower.z <= b.lower.z &&
         box.upper.x >= b.upper.x && box.upper.y >= b.upper.y && box.upper.z >= b.upper.z;
}

float volume(const Scene::Bounds& box) {
  const Vec3f size = box.upper - box.lower;
  return size.x * size.y * size.z;
}

// Boxes that hold what of one box lies outside of another.
void add_rest(Scene::Bounds box, const Scene::Bounds& other, std::vector<Scene::Bounds>& rest) {
  const auto cut = [&](float Vec3f::*axis) {
    if (box.upper.*axis < other.lower.*axis || box.lower.*axis > other.upper.*axis) {
      rest.push_back(box);
      return false;
    }
    const float low = std::max(other.lower.*axis, box.lower.*axis);
    const float high = std::min(other.upper.*axis, box.upper.*axis);
    Scene::Bounds below = box, above = box;
    below.upper.*axis = low, above.lower.*axis = high;
    if (below.lower.*axis < low) rest.push_back(below);
    if (above.upper.*axis > high) rest.push_back(above);
    box.lower.*axis = low, box.upper.*axis = high;
    return true;
  };
  if (cut(&Vec3f::x) && cut(&Vec3f::y)) cut(&Vec3f::z);
}

// Calls visit(number, bounds) for each moving instance that shows pictures apart and is anywhere.
template <class Visit>
void for_pictures(const Scene::Places& places, Visit&& visit) {
  for (std::size_t i = 0; i < places.bounds.size(); ++i) {
    const Scene::Bounds& bounds = places.bounds[i];
    if (i < places.apart.size() && places.apart[i] != 0 && bounds.lower.x <= bounds.upper.x)
      visit(i, bounds);
  }
}

}  // namespace

PictureStalls::PictureStalls(const Scene::Places& places) {
  for_pictures(places, [&](std::size_t, const Scene::Bounds& bounds) {
    const Scene::Bounds box = outwards(bounds, 0);
    if (!holds(boxes_, box)) boxes_.push_back(box);
  });
  for (const Scene::Bounds& box : boxes_) all_ = joined(all_, box);
}

PictureStalls::PictureStalls(std::vector<Scene::Bounds> boxes) : boxes_(std::move(boxes)) {
  for (const Scene::Bounds& box : boxes_) all_ = joined(all_, box);
}

bool PictureStalls::hold(const Scene::Places& places) const {
  bool all = true;
  for_pictures(places, [&](std::size_t, const Scene::Bounds& bounds) {
    all =
        all && std::ranges::any_of(boxes_, [&](const auto& box) { return contains(box, bounds); });
  });
  return all;
}

PictureStalls StallFollower::follow(const Scene::Places& places) {
  stalls_.resize(places.bounds.size());
  std::vector<Scene::Bounds> boxes;
  std::vector<std::uint8_t> stands(stalls_.size(), 0);
  for_pictures(places, [&](std::size_t i, const Scene::Bounds& bounds) {
    stands[i] = 1;
    Stall& stall = stalls_[i];
    const Scene::Bounds wanted = outwards(bounds, margin_m);
    const bool too_large = 2 * volume(wanted) < volume(stall.box);
    stall.too_large = too_large ? stall.too_large + 1 : 0;
    if (!stall.used || !contains(stall.box, bounds) || stall.too_large > patience) {
      stall = {wanted, 0, true};
    }
    boxes.push_back(stall.box);
  });
  for (std::size_t i = 0; i < stalls_.size(); ++i) stalls_[i].used = stands[i] != 0;
  return PictureStalls(std::move(boxes));
}

bool PictureStalls::are_passed(Vec3f from, Vec3f direction, float far_m) const {
  if (boxes_.empty()) return false;
  const auto passes = [&](const Scene::Bounds& box) {
    const auto [first, last] = stretch_in(box, from, direction, far_m);
    return first <= last;
  };
  return passes(all_) && (boxes_.size() == 1 || std::ranges::any_of(boxes_, passes));
}

std::vector<Scene::Bounds> PictureStalls::changed(const PictureStalls& before,
                                                  const PictureStalls& now) {
  std::vector<Scene::Bounds> boxes;
  const bool in_pairs = before.boxes_.size() == now.boxes_.size();
  for (std::size_t i = 0; in_pairs && i < now.boxes_.size(); ++i) {
    add_rest(before.boxes_[i], now.boxes_[i], boxes);
    add_rest(now.boxes_[i], before.boxes_[i], boxes);
  }
  if (in_pairs) return boxes;
  for (const Scene::Bounds& box : before.boxes_) {
    if (!holds(now.boxes_, box)) boxes.push_back(box);
  }
  for (const Scene::Bounds& box : now.boxes_) {
    if (!holds(before.boxes_, box)) boxes.push_back(box);
  }
  return boxes;
}

BoxStretch stretch_in(const Scene::Bounds& box, Vec3f from, Vec3f direction, float far_m) {
  BoxStretch s{0, far_m};
  const auto cut = [&](float o, float d, float low, float high) {
    if (d == 0) {
      if (o < low || o > high) s = {1, 0};
      return;
    }
    const float a = (low - o) / d, b = (high - o) / d;
    s.first = std::max(s.first, std::min(a, b));
    s.last = std::min(s.last, std::max(a, b));
  };
  cut(from.x, direction.x, box.lower.x, box.upper.x);
  if (s.first <= s.last) cut(from.y, direction.y, box.lower.y, box.upper.y);
  if (s.first <= s.last) cut(from.z, direction.z, box.lower.z, box.upper.z);
  return s;
}

}  // namespace render
