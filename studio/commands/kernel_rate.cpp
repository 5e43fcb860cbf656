// The kernel beside bare Embree.
#include "studio/commands/kernel_rate.h"

#include <algorithm>
#include <vector>

#include "render/kernel.h"
#include "render/ray_log.h"
#include "studio/least_time.h"

namespace studio {
namespace {

// All rays of a frame as the kernel shoots them.
render::RayLog log_frame(const BenchScene& shot, const render::FrameJob& job) {
  render::RayLog log;
  const render::FrameContext context = make_frame_context(shot.inputs(), job);
  render::TileWorkspace workspace;
  workspace.log_rays(&log);
  render::TileJob tile;
  render::TileResult result;
  const render::Rect picture{0, 0, shot.half_plate.width, shot.half_plate.height};
  cut_tile(shot.half_plate, picture, 0, tile);
  size_result(picture, result);
  render_tile(context, tile, workspace, result);
  return log;
}

}  // namespace

KernelRate measure_kernel(const BenchScene& shot, const render::FrameJob& job, int runs) {
  KernelRate m;
  const std::vector<render::RayLog> logs{log_frame(shot, job)};
  m.rays = logs[0].mask.size();
  m.kernel_ms = m.bare_ms = 1e30;
  render::FrameResult result;
  for (int i = 0; i < runs; ++i) {
    m.kernel_ms = std::min(
        m.kernel_ms,
        least_time_ms([&] { render_frame(shot.inputs(), job, shot.half_plate, result); }, 1));
    for (const bool coherent : {true, false}) {
      m.bare_ms = std::min(
          m.bare_ms, least_time_ms([&] { shoot_logged_rays(*shot.scene, logs, coherent); }, 1));
    }
  }
  return m;
}

KeptRate measure_kept(const BenchScene& shot, const render::FrameJob& job, int runs) {
  render::KeptTransport kept;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = &kept;
  render::FrameResult result;
  render_frame(inputs, job, shot.half_plate, result);
  render::FrameJob live = job;
  const double ms = least_time_ms(
      [&] {
        drift(live);
        render_frame(inputs, live, shot.half_plate, result);
      },
      runs);
  return {ms, all_rays(result.statistics)};
}

render::Effort plain_effort(render::Effort effort) {
  effort.aa_samples = 1;
  effort.adaptive_visibility = false;
  effort.cull_lights = false;
  effort.interleave = 1;
  effort.aa_tolerance = 0;
  effort.glint_contrast = 0;
  return effort;
}

}  // namespace studio
