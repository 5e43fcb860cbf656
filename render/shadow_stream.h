// A stream of shadow rays of a cell, filled one by one and shot together. Private to the kernel.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "render/lanes.h"
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

// Adds a ray from each of eight receivers side by side, the first of which is `point`, whose bit is
// set. The stream must have room for eight.
inline void add_rays(GatherWorkspace& w,
                     const Receivers& r,
                     std::size_t point,
                     unsigned bits,
                     std::uint32_t light,
                     Vec3f direction) {
  static constexpr std::array<std::uint32_t, 8> count{0, 1, 2, 3, 4, 5, 6, 7};
  const auto i = static_cast<std::size_t>(w.rays);
  const ToFront to_front(bits);
  to_front.move(&r.px[point], &w.ox[i]);
  to_front.move(&r.py[point], &w.oy[i]);
  to_front.move(&r.pz[point], &w.oz[i]);
  to_front.move(&r.mask[point], &w.mask[i]);
  to_front.move(count.data(), &w.ray_point[i]);
  for (std::size_t k = i; k < i + 8; ++k) {
    w.dx[k] = direction.x, w.dy[k] = direction.y, w.dz[k] = direction.z;
    w.far_m[k] = ray_far;
    w.ray_light[k] = light;
    w.ray_point[k] += static_cast<std::uint32_t>(point);
  }
  w.rays += std::popcount(bits);
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

// The same, for those rays alone that are blocked or tinted.
template <class F>
void flush_dimmed(const Scene& scene, GatherWorkspace& w, RenderStatistics& statistics, F&& visit) {
  if (w.rays == 0) return;
  shoot(scene, w, statistics);
  const bool tinted = scene.has_filters();
  const auto n = static_cast<std::size_t>(w.rays);
  for (std::size_t first = 0; first < n; first += 8) {
    unsigned dimmed = bits_of(load_eight(&w.far_m[first]) < Eight{});
    if (tinted) {
      const auto dims = [&](const auto& share) {
        return bits_of(load_eight(&share[first]) != eight_of(1));
      };
      dimmed |= dims(w.tr) | dims(w.tg) | dims(w.tb);
    }
    if (n - first < 8) dimmed &= (1U << (n - first)) - 1;
    for (; dimmed != 0; dimmed &= dimmed - 1) {
      const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(dimmed));
      const Vec3f share = tinted ? Vec3f{w.tr[i], w.tg[i], w.tb[i]} : Vec3f{1, 1, 1};
      visit(w.ray_point[i], w.ray_light[i], w.far_m[i] < 0, share);
    }
  }
  w.rays = 0;
}

}  // namespace render
