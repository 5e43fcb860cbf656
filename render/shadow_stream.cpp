// Shadow rays to Embree.
#include "render/shadow_stream.h"

#include <algorithm>

#include "render/embree_context.h"

namespace render {

void shoot(const Scene& scene, GatherWorkspace& w, RenderStatistics& statistics) {
  const auto n = static_cast<unsigned>(w.rays);
  TraceContext context(scene, RayKind::shadow, false);
  context.pictures = w.pictures;
  for (unsigned i = 0; i < n; ++i) {
    w.near_m[i] = 0, w.time[i] = 0, w.id[i] = i, w.flags[i] = 0;
  }
  if (scene.has_filters()) {
    for (unsigned i = 0; i < n; ++i) w.tr[i] = w.tg[i] = w.tb[i] = 1;
    context.transmittance_r = w.tr.data();
    context.transmittance_g = w.tg.data();
    context.transmittance_b = w.tb.data();
  }
  if (w.log) {
    w.log->add(true, false, 0,
               {w.ox.data(), w.oy.data(), w.oz.data(), w.dx.data(), w.dy.data(), w.dz.data(),
                w.near_m.data(), w.far_m.data()},
               w.mask.data(), n);
  }
  RTCRayNp rays{w.ox.data(),    w.oy.data(),   w.oz.data(), w.near_m.data(),
                w.dx.data(),    w.dy.data(),   w.dz.data(), w.time.data(),
                w.far_m.data(), w.mask.data(), w.id.data(), w.flags.data()};
  if (w.notes.ask_for_reach()) std::copy_n(w.far_m.begin(), n, w.reach_m.begin());
  rtcOccludedNp(scene.embree(), &context.context, &rays, n);
  w.notes.note(w);
  statistics.shadow_rays += n;
  if (w.counts) {
    for (unsigned i = 0; i < n; ++i) ++w.counts[w.ray_point[i]];
  }
}

}  // namespace render
