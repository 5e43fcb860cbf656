// A stream of shadow rays of a cell, filled one by one and shot together. Private to the kernel.
#pragma once

#include "render/light_gather.h"
#include "render/scene.h"
#include "render/trace.h"

namespace render {

// Adds a ray from a receiver to the stream, which must not be full.
inline void add_ray(GatherWorkspace& w,
                    const Receivers& r,
                    std::size_t point,
                    std::uint32_t light,
                    Vec3f direction,
                    unsigned mask,
                    float far_m = ray_far) {
  const auto i = static_cast<std::size_t>(w.rays++);
  w.ox[i] = r.px[point], w.oy[i] = r.py[point], w.oz[i] = r.pz[point];
  w.dx[i] = direction.x, w.dy[i] = direction.y, w.dz[i] = direction.z;
  w.mask[i] = mask;
  w.far_m[i] = far_m;
  w.ray_light[i] = light;
  w.ray_point[i] = static_cast<std::uint32_t>(point);
}

// A receiver as lamps want it.
inline LampReceiver lamp_receiver(const Receivers& r, std::size_t k) {
  return {{r.px[k], r.py[k], r.pz[k]}, {r.nx[k], r.ny[k], r.nz[k]}, {r.gx[k], r.gy[k], r.gz[k]}};
}

// Shoots the stream's rays. Afterwards far_m < 0 marks what is blocked; tr, tg, tb what glass let
// by.
void shoot(const Scene& scene, GatherWorkspace& w, RenderStatistics& statistics);

// Calls visit(point, light, blocked, share that passes) for every ray of the stream, and empties
// it.
template <class F>
void flush(const Scene& scene, GatherWorkspace& w, RenderStatistics& statistics, F&& visit) {
  if (w.rays == 0) return;
  shoot(scene, w, statistics);
  const bool tinted = scene.has_filters();
  for (std::size_t i = 0; i < static_cast<std::size_t>(w.rays); ++i) {
    const bool blocked = w.far_m[i] < 0;
    const Vec3f share = tinted ? Vec3f{w.tr[i], w.tg[i], w.tb[i]} : Vec3f{1, 1, 1};
    visit(w.ray_point[i], w.ray_light[i], blocked, share);
  }
  w.rays = 0;
}

}  // namespace render
