// The rays that a frame shoots, kept to be shot again: the limit that the kernel is measured
// against.
#pragma once

#include <cstdint>
#include <vector>

#include "render/scene.h"

namespace render {

// One stream as it went to Embree.
struct LoggedStream {
  bool any_hit = false;                // shadow rays
  bool coherent = false;               // camera rays
  float cone_rad = 0;                  // of rays that are not shadow rays: as TraceContext has it
  std::uint32_t first = 0, count = 0;  // in RayLog's arrays
};

struct RayLog {
  std::vector<LoggedStream> streams;
  std::vector<float> ox, oy, oz, dx, dy, dz, near_m, far_m;
  std::vector<unsigned> mask;

  void add(bool any_hit,
           bool coherent,
           float cone_rad,
           const float* const (&origin_direction_near_far)[8],
           const unsigned* masks,
           std::size_t count);
};

// Shoots all rays of the logs (one a thread) with nothing but Embree between them, in streams, and
// returns how many hit something. `coherent_camera`: whether camera rays get the coherent flag.
std::uint64_t shoot_logged_rays(const Scene& scene,
                                const std::vector<RayLog>& logs,
                                bool coherent_camera);

}  // namespace render
