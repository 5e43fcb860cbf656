// What rays that clear bodies bent, or mirrors sent on, see of the plate.
#include <algorithm>
#include <cmath>

#include "calibrate/lens.h"
#include "render/cell_baker.h"
#include "render/trace.h"

namespace render {

// What a ray that clear bodies bent sees where it leaves the scene: as the background says, the
// plate, if that lies in the picture, or the environment. What the plate adds is planned by the
// environment, so that what is decided by it does not change with the plate.
void CellBaker::leave_bent(
    std::size_t slot, std::size_t target, Vec3f direction, const Spread& spread, Vec3f weight) {
  ShadePoint p{};
  p.incoming = direction;
  p.throughput = weight;
  p.kind = RayKind::bent;
  ShadePoint* const leaving = &p;
  const Scene& scene = *frame_->inputs.scene;
  scene.background().shade({&scene.description(), &scene}, {&leaving, 1});
  Vec3f sees_environment = p.environment_share;
  if (p.plate_share != Vec3f{}) {
    PlateView view{.sees = direction, .spread = {}};
    if (frame_->lens) {
      const calibrate::Vec3 v = calibrate::to_double(frame_->turn.to_camera(direction));
      find_plate(calibrate::project(*frame_->lens, v), view);
    }
    const float width_rad = std::sqrt(length(spread.a) * length(spread.b));
    if (view.share > 0) {
      add_plate(slot, target, view, width_rad, weight * p.plate_share, unshaded);
    }
    sees_environment += p.plate_share * (1 - view.share);
  }
  if (sees_environment != Vec3f{}) {
    add_environment(slot, target, direction, 0, spread, false, weight * sees_environment);
  }
}

calibrate::Vec3 CellBaker::from_camera(const ShadePoint& p) const {
  return calibrate::to_double(frame_->turn.to_camera(p.hit.position - frame_->camera));
}

// Where the plate shows what points of stand-ins are that were not seen straight on. What lies
// beyond the picture is the environment, in no shadow that would have to be looked for.
void CellBaker::find_plate(int count) {
  seen_elsewhere_.clear();
  places_elsewhere_.clear();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (points_[i].kind != RayKind::bent || points_[i].plate_share == Vec3f{}) continue;
    seen_elsewhere_.push_back(static_cast<std::uint16_t>(i));
    if (frame_->lens) places_elsewhere_.push_back(from_camera(points_[i]));
  }
  if (seen_elsewhere_.empty()) return;
  const auto pixels = frame_->lens ? calibrate::project_all(*frame_->lens, places_elsewhere_)
                                   : std::vector<std::optional<calibrate::Vec2>>();
  for (std::size_t k = 0; k < seen_elsewhere_.size(); ++k) {
    const std::size_t i = seen_elsewhere_[k];
    find_plate(pixels.empty() ? std::nullopt : pixels[k], plate_views_[i]);
    if (!(plate_views_[i].share > 0)) points_[i].catches_shadow = false;
  }
}

void CellBaker::find_plate(std::optional<calibrate::Vec2> q, PlateView& view) const {
  view.share = 0;
  if (!q) return;
  view.share = plate_share_at(frame_->plate_levels->all().front(), q->x, q->y, view.mirrored);
  view.x = q->x, view.y = q->y;
}

void CellBaker::add_bent(const ShadePoint& p, Vec3f weight, std::uint32_t shadow_point) {
  add_bent(p, weight, shadow_point, plate_views_[index_of(p)]);
}

// What is seen where a ray meets a stand-in that is not straight on.
void CellBaker::add_bent(const ShadePoint& p,
                         Vec3f weight,
                         std::uint32_t shadow_point,
                         const PlateView& view) {
  if (view.share > 0) {
    const float distance_m = length(p.hit.position - frame_->camera);
    const float width_rad = std::max(p.footprint_m, p.blur_m) / std::max(distance_m, 1e-6F);
    add_plate(p.slot, target_of(p), view, width_rad, weight, shadow_point);
  }
  if (view.share < 1) {
    add_environment(p.slot, target_of(p), view.sees, view.roughness, view.spread, view.one_of_many,
                    weight * (1 - view.share));
  }
}

void CellBaker::add_plate(std::size_t slot,
                          std::size_t target,
                          const PlateView& view,
                          float width_rad,
                          Vec3f weight,
                          std::uint32_t shadow_point) {
  weight = weight * view.share;
  const float width_px = width_rad / frame_->pixel_angle;
  const int last = static_cast<int>(frame_->plate_levels->all().size()) - 1;
  const int level =
      width_px > 1 ? std::min(static_cast<int>(std::lround(std::log2(width_px))), last) : 0;
  const double shrunk = 1.0 / (1 << level);
  const PlaceTerm term{
      weight, static_cast<float>((view.x + 0.5) * shrunk - 0.5),
      static_cast<float>((view.y + 0.5) * shrunk - 0.5), static_cast<std::uint16_t>(target),
      static_cast<std::uint16_t>(frame_->first_plate_level + static_cast<std::size_t>(level))};
  if (shadow_point == unshaded) {
    bent_.add(term);
  } else {
    transport_->bent_shaded.push_back({term, shadow_point});
  }
  samples_[slot].added +=
      weight * planned_radiance(look_up(view.sees, view.roughness, view.spread, view.one_of_many));
}

}  // namespace render
