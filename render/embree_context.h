// Embree's ray context with ours behind it. Private to render: includes Embree.
#pragma once

#include <limits>

#include <embree3/rtcore.h>

#include "render/shader.h"
#include "render/trace.h"

namespace render {

// `context` must be the first member: filters get a pointer to it.
struct TraceContext {
  RTCIntersectContext context;
  const Scene* scene;
  RayKind kind = RayKind::camera;
  float cone_rad = std::numeric_limits<float>::infinity();  // full angle of rays, if it is known
  LivePictures pictures = LivePictures::met;
  // Shadow rays: per ray id, share of light so far. Null: any surface that is not a hole blocks.
  float* transmittance_r = nullptr;
  float* transmittance_g = nullptr;
  float* transmittance_b = nullptr;

  TraceContext(const Scene& traced, RayKind ray_kind, bool coherent)
      : scene(&traced), kind(ray_kind) {
    rtcInitIntersectContext(&context);
    context.flags =
        coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
};

}  // namespace render
