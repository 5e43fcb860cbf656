// Single rays.
#include "render/trace.h"

#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>

#include "render/embree_context.h"

namespace render {

void prepare_thread() {
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}

std::optional<TracedHit> closest_hit(const Scene& scene,
                                     Vec3f origin,
                                     Vec3f direction,
                                     float near_m,
                                     unsigned mask,
                                     RayKind kind,
                                     LivePictures pictures) {
  TraceContext context(scene, kind, false);
  context.pictures = pictures;
  RTCRayHit ray{};
  ray.ray = {.org_x = origin.x,
             .org_y = origin.y,
             .org_z = origin.z,
             .tnear = near_m,
             .dir_x = direction.x,
             .dir_y = direction.y,
             .dir_z = direction.z,
             .time = 0,
             .tfar = ray_far,
             .mask = mask,
             .id = 0,
             .flags = 0};
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene.embree(), &context.context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return TracedHit{ray.ray.tfar,      ray.hit.geomID, ray.hit.primID,
                   ray.hit.instID[0], ray.hit.u,      ray.hit.v};
}

Vec3f transmittance(const Scene& scene,
                    Vec3f origin,
                    Vec3f direction,
                    float near_m,
                    float far_m,
                    unsigned mask,
                    LivePictures pictures) {
  TraceContext context(scene, RayKind::shadow, false);
  context.pictures = pictures;
  Vec3f share{1, 1, 1};
  context.transmittance_r = &share.x;
  context.transmittance_g = &share.y;
  context.transmittance_b = &share.z;
  RTCRay ray{.org_x = origin.x,
             .org_y = origin.y,
             .org_z = origin.z,
             .tnear = near_m,
             .dir_x = direction.x,
             .dir_y = direction.y,
             .dir_z = direction.z,
             .time = 0,
             .tfar = far_m,
             .mask = mask,
             .id = 0,
             .flags = 0};
  rtcOccluded1(scene.embree(), &context.context, &ray);
  return ray.tfar < 0 ? Vec3f{} : share;
}

Vec3f offset_origin(const HitPoint& hit, Vec3f direction) {
  const Vec3f p = hit.position;
  const float size = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z), 1e-3F});
  const float side = dot(direction, hit.geometric_normal) < 0 ? -1.0F : 1.0F;
  // Far away some floats' steps, for more would begin inside of what stands there: 2 mm at a
  // kilometre. Nearer up to 20 micrometres, which nobody sees. Near the origin, a large triangle is
  // as coarse as its corners.
  const float near = std::min(size * 2e-5F, 2e-5F);
  const float off = std::max({size * 2e-6F, near, hit.largest_coordinate * 1e-6F});
  return p + hit.geometric_normal * (side * off);
}

}  // namespace render
