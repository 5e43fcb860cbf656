// Rays through a compiled scene, one at a time: for the reference, tests and tools. Every ray, also
// the kernel's, goes with a TraceContext, because holes and glass are decided while it travels.
#pragma once

#include <optional>

#include "render/scene.h"
#include "render/shader.h"

namespace render {

inline constexpr float ray_far = 1e30F;

// Sets flush-to-zero for this thread, as Embree wants it.
void prepare_thread();

struct TracedHit {
  float distance = 0;
  unsigned geom_id = 0, prim_id = 0, inst_id = 0;
  float u = 0, v = 0;
};

// Whether rays meet surfaces that show live pictures: all; none; those that do not show them apart.
enum class LivePictures : std::uint8_t { met, passed, passed_apart };

// The nearest hit beyond `near_m`, holes passed.
std::optional<TracedHit> closest_hit(const Scene& scene,
                                     Vec3f origin,
                                     Vec3f direction,
                                     float near_m,
                                     unsigned mask,
                                     RayKind kind,
                                     LivePictures pictures = LivePictures::met);

// RGB share of light that passes from origin to far_m along direction: 0 = blocked.
Vec3f transmittance(const Scene& scene,
                    Vec3f origin,
                    Vec3f direction,
                    float near_m,
                    float far_m,
                    unsigned mask,
                    LivePictures pictures = LivePictures::met);

// A start point moved off the surface, against hitting it again: scaled to the size of coordinates,
// the point's and its triangle's.
Vec3f offset_origin(const HitPoint& hit, Vec3f direction);

}  // namespace render
