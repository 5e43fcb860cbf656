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
    const float width_rad = std::sqrt(length(spread.a) * length(spread.b));
    const float seen =
        add_plate(slot, target, direction, width_rad, direction, weight * p.plate_share, unshaded);
    sees_environment += p.plate_share * (1 - seen);
  }
  if (sees_environment != Vec3f{}) {
    add_environment(slot, target, direction, 0, spread, false, weight * sees_environment);
  }
}

// The same where it meets a stand-in.
void CellBaker::add_bent(const ShadePoint& p, Vec3f weight, std::uint32_t shadow_point) {
  const Vec3f from_camera = p.hit.position - frame_->camera;
  const float distance_m = length(from_camera);
  const float width_rad = std::hypot(p.footprint_m, p.blur_m) / std::max(distance_m, 1e-6F);
  const float seen =
      add_plate(p.slot, target_of(p), from_camera, width_rad, p.incoming, weight, shadow_point);
  if (seen < 1) {
    add_environment(p.slot, target_of(p), p.incoming, 0, {}, false, weight * (1 - seen));
  }
}

// As far as the camera sees that way; how much of it that is.
float CellBaker::add_plate(std::size_t slot,
                           std::size_t target,
                           Vec3f from_camera,
                           float width_rad,
                           Vec3f planned_direction,
                           Vec3f weight,
                           std::uint32_t shadow_point) {
  if (!frame_->lens) return 0;
  const auto q =
      calibrate::project(*frame_->lens, calibrate::to_double(frame_->turn.to_camera(from_camera)));
  const auto& whole = frame_->plate_levels->all().front();
  const float seen = q ? plate_share_at(whole, q->x, q->y) : 0;
  if (!(seen > 0)) return 0;
  weight = weight * seen;
  const float width_px = width_rad / frame_->pixel_angle;
  const int last = static_cast<int>(frame_->plate_levels->all().size()) - 1;
  const int level =
      width_px > 1 ? std::min(static_cast<int>(std::lround(std::log2(width_px))), last) : 0;
  const double shrunk = 1.0 / (1 << level);
  const PlaceTerm term{
      weight, static_cast<float>((q->x + 0.5) * shrunk - 0.5),
      static_cast<float>((q->y + 0.5) * shrunk - 0.5), static_cast<std::uint16_t>(target),
      static_cast<std::uint16_t>(frame_->first_plate_level + static_cast<std::size_t>(level))};
  if (shadow_point == unshaded) {
    bent_.add(term);
  } else {
    transport_->bent_shaded.push_back({term, shadow_point});
  }
  samples_[slot].added += weight * planned_radiance(look_up(planned_direction, 0, {}, false));
  return seen;
}

}  // namespace render
