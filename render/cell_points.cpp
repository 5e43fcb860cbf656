// Light of a cell's points that are no centres.
#include <algorithm>
#include <numeric>

#include "render/cell_baker.h"

namespace render {
namespace {

bool catches(const ShadePoint& p) { return p.catches_shadow || p.catches_lamps; }

}  // namespace

// What is lost where so much passes.
std::uint16_t CellBaker::tint_of(Vec3f passed) {
  using Light = CellTransport::ShadowLight;
  if (passed == Vec3f{1, 1, 1}) return Light::passes;
  if (passed == Vec3f{}) return Light::blocked;
  const Vec3f lost = Vec3f{1, 1, 1} - passed;
  std::vector<Vec3f>& tints = transport_->shadow_tints;
  // Most are as one of those just before; where there are too many, like it.
  constexpr std::size_t most = 0xFFFF - Light::first_tint, just_before = 16;
  const auto off = [&](const Vec3f& tint) { return dot(tint - lost, tint - lost); };
  const auto near = std::min_element(
      tints.end() - static_cast<std::ptrdiff_t>(std::min(tints.size(), just_before)), tints.end(),
      [&](const Vec3f& a, const Vec3f& b) { return off(a) < off(b); });
  const bool is_there = near != tints.end() && (*near == lost || tints.size() == most);
  const auto number = static_cast<std::size_t>(near - tints.begin());
  if (!is_there) tints.push_back(lost);
  return static_cast<std::uint16_t>(Light::first_tint + (is_there ? number : tints.size() - 1));
}

// Which of `tested_` the points have that catch shadows or lamps' light, point by point.
void CellBaker::sort_tested(std::span<const std::uint16_t> point_at) {
  auto& end = end_of_receiver_;
  end.fill(0);
  for (const PointLight& l : tested_) end[l.point] += catches(points_[point_at[l.point]]);
  std::partial_sum(end.begin(), end.end(), end.begin());
  tested_by_receiver_.resize(end.back());
  std::array<std::uint32_t, cell_pixels> next;
  next[0] = 0;
  std::copy(end.begin(), end.end() - 1, next.begin() + 1);
  for (std::uint32_t i = 0; i < tested_.size(); ++i) {
    const std::size_t k = tested_[i].point;
    if (catches(points_[point_at[k]])) tested_by_receiver_[next[k]++] = i;
  }
}

// Lights of points that are no centres, in the order of `tested_`.
void CellBaker::add_tested(std::span<const std::uint16_t> point_at) {
  CellTransport& t = *transport_;
  const std::size_t first_picture_light = t.picture_lights.size();
  looked_for_ = {};
  looked_for_by_.clear();
  for (const PointLight& l : tested_) {
    const ShadePoint& p = points_[point_at[l.point]];
    const Vec3f weight = p.throughput * p.diffuse * l.passed * l.weight;
    if (weight == Vec3f{}) continue;
    if (past_pictures_) {
      add_tested_past_pictures(p, l, weight, light_of_point_[point_at[l.point]].open);
    } else {
      lights_.add({matte_target_of(p), l.light, weight});
    }
  }
  settle_picture_lights(first_picture_light);
  if (std::ranges::any_of(point_at, [&](std::uint16_t i) { return catches(points_[i]); })) {
    sort_tested(point_at);
  }
  for (std::size_t k = 0; k < point_at.size(); ++k) {
    const ShadePoint& p = points_[point_at[k]];
    catcher_of_receiver_[k] = bent_of_receiver_[k] = no_catcher;
    if (!catches(p)) continue;
    const auto first = static_cast<std::uint32_t>(t.shadow_lights.size());
    for (std::size_t i = k == 0 ? 0 : end_of_receiver_[k - 1]; i < end_of_receiver_[k]; ++i) {
      const PointLight& l = tested_[tested_by_receiver_[i]];
      note_picture_shadow(p, k, l, light_of_point_[point_at[k]].open);
      t.shadow_lights.push_back({l.light, tint_of(l.passed), l.weight});
    }
    const bool bent = p.kind == RayKind::bent;
    t.shadow_points.push_back({static_cast<std::uint16_t>(target_of(p)), first,
                               static_cast<std::uint32_t>(t.shadow_lights.size()) - first,
                               p.catches_shadow && !bent ? p.throughput * p.plate_share : Vec3f{}});
    if (bent) {
      bent_of_receiver_[k] = static_cast<std::uint32_t>(t.shadow_points.size()) - 1;
      add_bent(p, p.throughput * p.plate_share, bent_of_receiver_[k]);
      continue;
    }
    if (p.catches_lamps && !frame_->planned_table->lamps.empty()) {
      needs_pictures_ = needs_pictures_ || p.behind != no_picture_ray;
      catcher_of_receiver_[k] = static_cast<std::uint32_t>(t.catchers.size());
      t.catchers.push_back({static_cast<std::uint16_t>(target_of(p)),
                            static_cast<std::uint32_t>(cell_pixels + t.shadow_points.size() - 1),
                            p.throughput, p.albedo});
    }
  }
}

// A further sample that shares the light of a centre on the same surface.
void CellBaker::add_shared(const ShadePoint& p, std::size_t centre) {
  const auto slot = static_cast<std::uint16_t>(target_of(p));
  const auto c = static_cast<std::uint16_t>(centre);
  if (p.diffuse != Vec3f{}) {
    transport_->shared.push_back(
        {matte_target_of(p), c, CellTransport::SharedTerm::Of::light, p.throughput * p.diffuse});
  }
  if (p.catches_shadow) {
    transport_->shared.push_back(
        {slot, c, CellTransport::SharedTerm::Of::shadow, p.throughput * p.plate_share});
  }
  catch_lamps(p, centre, light_[centre].lamps);
}

}  // namespace render
