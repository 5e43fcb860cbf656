// Rays shot again.
#include "render/ray_log.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "capture/parallel_loop.h"
#include "render/embree_context.h"
#include "render/light_gather.h"
#include "render/trace.h"

namespace render {

void RayLog::add(bool any_hit,
                 bool coherent,
                 float cone_rad,
                 const float* const (&from)[8],
                 const unsigned* masks,
                 std::size_t count) {
  streams.push_back({any_hit, coherent, cone_rad, static_cast<std::uint32_t>(mask.size()),
                     static_cast<std::uint32_t>(count)});
  std::vector<float>* const to[8] = {&ox, &oy, &oz, &dx, &dy, &dz, &near_m, &far_m};
  for (std::size_t i = 0; i < 8; ++i) to[i]->insert(to[i]->end(), from[i], from[i] + count);
  mask.insert(mask.end(), masks, masks + count);
}

namespace {

std::uint64_t shoot(const Scene& scene, const RayLog& log, const LoggedStream& s, bool coherent) {
  // Only what Embree overwrites, and what does not differ between rays, is made here.
  alignas(64) std::array<float, stream_rays> far_m, time, u, v, ngx, ngy, ngz;
  alignas(64) std::array<unsigned, stream_rays> geom, prim, inst, id, flags;
  alignas(64) std::array<float, stream_rays> share;
  const std::size_t n = s.count, at = s.first;
  std::copy_n(log.far_m.data() + at, n, far_m.data());
  for (std::size_t i = 0; i < n; ++i) {
    time[i] = 0, id[i] = static_cast<unsigned>(i), flags[i] = 0, share[i] = 1;
  }
  // Embree does not write to the rays' origins, directions and masks.
  const auto input = [at](const std::vector<float>& values) {
    return const_cast<float*>(values.data() + at);
  };
  RTCRayNp ray{input(log.ox), input(log.oy),
               input(log.oz), input(log.near_m),
               input(log.dx), input(log.dy),
               input(log.dz), time.data(),
               far_m.data(),  const_cast<unsigned*>(log.mask.data() + at),
               id.data(),     flags.data()};
  TraceContext context(scene, s.any_hit ? RayKind::shadow : RayKind::camera, coherent);
  context.cone_rad = s.cone_rad;
  std::uint64_t hits = 0;
  if (s.any_hit) {
    context.transmittance_r = context.transmittance_g = context.transmittance_b = share.data();
    rtcOccludedNp(scene.embree(), &context.context, &ray, static_cast<unsigned>(n));
    for (std::size_t i = 0; i < n; ++i) hits += far_m[i] < 0;
    return hits;
  }
  for (std::size_t i = 0; i < n; ++i) geom[i] = inst[i] = RTC_INVALID_GEOMETRY_ID;
  RTCRayHitNp rays;
  rays.ray = ray;
  rays.hit.Ng_x = ngx.data(), rays.hit.Ng_y = ngy.data(), rays.hit.Ng_z = ngz.data();
  rays.hit.u = u.data(), rays.hit.v = v.data();
  rays.hit.primID = prim.data(), rays.hit.geomID = geom.data(), rays.hit.instID[0] = inst.data();
  rtcIntersectNp(scene.embree(), &context.context, &rays, static_cast<unsigned>(n));
  for (std::size_t i = 0; i < n; ++i) hits += geom[i] != RTC_INVALID_GEOMETRY_ID;
  return hits;
}

}  // namespace

std::uint64_t shoot_logged_rays(const Scene& scene,
                                const std::vector<RayLog>& logs,
                                bool coherent_camera) {
  std::atomic<std::uint64_t> hits = 0;
  for (const RayLog& log : logs) {
    constexpr std::size_t batch = 64;
    capture::parallel_for(std::size_t{0}, (log.streams.size() + batch - 1) / batch,
                          [&](std::size_t i) {
                            prepare_thread();
                            std::uint64_t sum = 0;
                            const std::size_t end = std::min(log.streams.size(), (i + 1) * batch);
                            for (std::size_t k = i * batch; k < end; ++k) {
                              const LoggedStream& s = log.streams[k];
                              sum += shoot(scene, log, s, s.coherent && coherent_camera);
                            }
                            hits += sum;
                          });
  }
  return hits;
}

}  // namespace render
