// Rays that surfaces send on.
#include <algorithm>
#include <limits>

#include "calibrate/lens.h"
#include "render/cell_baker.h"
#include "render/cones.h"
#include "render/embree_context.h"
#include "render/trace.h"

namespace render {

// What a ray sees that surfaces send on. Of those from real surfaces, the plate shows already what
// they mirror of each other.
unsigned CellBaker::mask_of(const QueuedRay& ray) const {
  if (ray.kind == RayKind::camera || ray.kind == RayKind::bent) return mask_virtual | mask_stand_in;
  return ray.sees_mirrored ? mask_virtual | mask_mirrored : mask_virtual;
}

// The space that the stream's rays passed, up to what they met.
void CellBaker::mark_passed(std::size_t count) {
  const RayStream& s = stream_;
  const bool stands_back = frame_->inputs.scene->has_standing_back();
  for (std::size_t i = 0; i < count; ++i) {
    // A real surface may let a ray see what is behind it.
    const bool met = s.geom[i] != RTC_INVALID_GEOMETRY_ID;
    const bool on = stands_back &&
                    ((s.mask[i] & mask_stand_in) != 0 || ((s.mask[i] & mask_mirrored) != 0 && met &&
                                                          !hides_pictures(static_cast<int>(i))));
    const float far_m = on ? ray_far : s.far_m[i];
    grid_->mark_line({s.ox[i], s.oy[i], s.oz[i]}, {s.dx[i], s.dy[i], s.dz[i]}, far_m,
                     transport_->reach.passed);
  }
}

// What a ray that asks meets is not shaded, but taken for grey in the light of what the pixel
// shows. What lets light through does not count.
void CellBaker::meet_surroundings(const QueuedRay& ray, std::size_t i) {
  const Scene& scene = *frame_->inputs.scene;
  const std::uint32_t material =
      scene.surface_of(stream_.geom[i], stream_.prim[i], stream_.inst[i]).material;
  const bool open =
      scene.shader_of(material).lets_light_through(scene.description().materials[material]);
  if (open || !in(transport_->receiving, ray.pixel)) {
    add_environment(ray.slot, target_of(ray), ray.sees, ray.roughness, ray.spread, ray.one_of_many,
                    ray.throughput);
  } else {
    add_surroundings(ray.slot, target_of(ray), ray.pixel, ray.throughput);
  }
}

// What a ray that asks sees of the plate, in whatever shadow.
void CellBaker::meet_plate(const QueuedRay& ray, std::size_t i) {
  ShadePoint p{};
  set_point(p, static_cast<int>(i), ray.pixel, ray.slot);
  arrive_bounced(p, ray.steps, ray.spread, ray.roughness, ray.one_of_many, stream_.far_m[i]);
  p.behind = ray.behind;
  PlateView view = view_of(ray);
  if (frame_->lens) find_plate(calibrate::project(*frame_->lens, from_camera(p)), view);
  add_bent(p, ray.throughput, unshaded, view);
}

// How much of a light, or lamp, lobes see: not where the plate shows a real surface before it.
float CellBaker::seen_past_plate(const ShadePoint& p, Vec3f direction, float far_m) {
  const Scene& scene = *frame_->inputs.scene;
  if (!scene.has_mirrored() || !frame_->lens) return 1;
  const Vec3f origin = offset_origin(p.hit, direction);
  ++statistics_->shadow_rays;
  if (counting_) ++counting_[p.pixel].shadow_rays;
  if (grid_) grid_->mark_line(origin, direction, far_m, transport_->reach.passed);
  const auto met = closest_hit(scene, origin, direction, 0, mask_mirrored, RayKind::reflection,
                               gather_.pictures);
  if (!met || met->distance >= far_m) return 1;
  const Vec3f from_camera = origin + direction * met->distance - frame_->camera;
  PlateView view{.sees = direction, .spread = {}, .mirrored = true};
  find_plate(
      calibrate::project(*frame_->lens, calibrate::to_double(frame_->turn.to_camera(from_camera))),
      view);
  return 1 - view.share;
}

// Whether a mirrored ray meets a stand-in, and sees the plate there.
bool CellBaker::meets_plate(const QueuedRay& ray, std::size_t i) const {
  if (!ray.sees_mirrored || stream_.geom[i] == RTC_INVALID_GEOMETRY_ID) return false;
  const Scene& scene = *frame_->inputs.scene;
  const auto met = scene.surface_of(stream_.geom[i], stream_.prim[i], stream_.inst[i]);
  return scene.description().instances[met.instance].kind == ObjectKind::stand_in;
}

void CellBaker::bounce() {
  while (!queue_.empty()) {
    const std::size_t n = std::min<std::size_t>(queue_.size(), stream_rays);
    const std::size_t from = queue_.size() - n;
    for (std::size_t i = 0; i < n; ++i) {
      const QueuedRay& q = queue_[from + i];
      if (counting_) {
        RayCount& pixel = counting_[q.pixel];
        ++pixel.rays;
        pixel.depth = std::max<std::uint32_t>(pixel.depth, q.depth);
      }
      stream_.ox[i] = q.origin.x, stream_.oy[i] = q.origin.y, stream_.oz[i] = q.origin.z;
      stream_.dx[i] = q.direction.x, stream_.dy[i] = q.direction.y, stream_.dz[i] = q.direction.z;
      stream_.near_m[i] = 0;
      stream_.mask[i] = mask_of(q);
    }
    trace(static_cast<int>(n), false, RayKind::reflection, std::numeric_limits<float>::infinity());
    if (grid_) mark_passed(n);
    statistics_->secondary_rays += n;
    int count = 0;
    std::size_t leaving = 0;
    for (std::size_t i = 0; i < n; ++i) {
      QueuedRay& q = queue_[from + i];
      const bool hit = stream_.geom[i] != RTC_INVALID_GEOMETRY_ID;
      const std::size_t target = target_of(q);
      const bool in_plate = meets_plate(q, i);
      if (hit && q.asks) {
        if (in_plate) {
          meet_plate(q, i);
        } else {
          meet_surroundings(q, i);
        }
        continue;
      }
      const auto see_straight_on = [&](std::size_t to, Vec3f weight) {
        if (q.kind == RayKind::bent) {
          leave_bent(q.slot, to, q.direction, q.spread, weight);
        } else {
          add_environment(q.slot, to, q.sees, q.roughness, q.spread, q.one_of_many, weight);
        }
      };
      const OpenLobe lobe = q.by_lights && !in_plate ? open_lobes_.at(q.pixel) : OpenLobe{};
      const float left = 1 - lobe.by_lights();
      if (left < 1) see_straight_on(target, q.throughput * (1 - left));
      q.throughput = q.throughput * left;
      const float end_m = past_pictures_ ? picture_end(static_cast<int>(i), q.origin, q.direction)
                                         : stream_.far_m[i];
      const std::uint16_t behind = !q.asks && may_be_passed(q.origin, q.direction, end_m)
                                       ? add_picture_ray(q, end_m)
                                       : q.behind;
      const bool before_pictures = behind != q.behind;
      // What it counts as is not what it meets, but by how much that differs from what is straight
      // on.
      const bool as_difference = q.kind == RayKind::difference || q.beyond_cut;
      if (!hit && !before_pictures && as_difference) continue;
      if (as_difference) see_straight_on(target, -q.throughput);
      if (!hit && q.kind != RayKind::camera) {
        // Of what the lights leave of a lobe, the ray tells that its own part is open.
        const float seen = left < 1 ? lobe.by_ray() / left : 1;
        const std::size_t to = behind != no_picture_ray ? slots + behind : target;
        see_straight_on(to, q.throughput * seen);
        if (seen < 1) add_surroundings(q.slot, to, q.pixel, q.throughput * (1 - seen));
        continue;
      }
      ShadePoint& p =
          hit ? points_[static_cast<std::size_t>(count++)] : points_[stream_rays - ++leaving];
      set_point(p, static_cast<int>(i), q.pixel, q.slot);
      if (!hit) group_[leaving - 1] = &p;
      if (hit) arrive_bounced(p, q.steps, q.spread, q.roughness, q.one_of_many, stream_.far_m[i]);
      p.throughput = q.throughput;
      if (hit && q.media.count > 0) {
        p.throughput =
            p.throughput * passed_through(*frame_->inputs.scene, q.media, stream_.far_m[i]);
      }
      if (hit) {
        const auto k = static_cast<std::size_t>(count - 1);
        sees_mirrored_[k] = q.sees_mirrored;
        plate_views_[k] = in_plate ? view_of(q) : PlateView{.sees = q.direction, .spread = {}};
        lamps_apart_[k] = q.lamps_apart;
        is_first_[k] = q.first;
      }
      p.media = q.media;
      // The plate shows as behind clear bodies.
      p.kind = in_plate                        ? RayKind::bent
               : q.kind == RayKind::difference ? RayKind::reflection
                                               : q.kind;
      p.depth = q.depth;
      p.behind = behind;
      p.path = q.path;
    }
    queue_.resize(from);
    run_background({group_.data(), leaving});
    shade_points(count, false);
  }
  lamps_apart_.fill(0);
  sees_mirrored_.fill(0);
  is_first_.fill(0);
}

}  // namespace render
