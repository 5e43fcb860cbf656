// platelight bench: ratios to a limit, both measured in one process.
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/kernel.h"
#include "render/light_table.h"
#include "render/ray_log.h"
#include "studio/bench_scene.h"
#include "studio/commands/benches.h"
#include "studio/commands/commands.h"
#include "studio/machine.h"

namespace studio {
namespace {

double best_ms(int runs, const std::function<void()>& work) {
  double best = 1e30;
  for (int i = 0; i < runs; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    best = std::min(best, taken.count());
  }
  return best;
}

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

struct Measured {
  double kernel_ms = 0;
  double bare_ms = 0;  // the same rays, nothing but Embree, its best mode
  std::size_t rays = 0;
};

// Kernel and bare loop take turns, so that both see the same noise of the machine.
Measured measure(const BenchScene& shot, const render::FrameJob& job, int runs) {
  Measured m;
  const std::vector<render::RayLog> logs{log_frame(shot, job)};
  m.rays = logs[0].mask.size();
  m.kernel_ms = m.bare_ms = 1e30;
  render::FrameResult result;
  for (int i = 0; i < runs; ++i) {
    m.kernel_ms =
        std::min(m.kernel_ms,
                 best_ms(1, [&] { render_frame(shot.inputs(), job, shot.half_plate, result); }));
    for (const bool coherent : {true, false}) {
      m.bare_ms =
          std::min(m.bare_ms, best_ms(1, [&] { shoot_logged_rays(*shot.scene, logs, coherent); }));
    }
  }
  return m;
}

// A frame of a still shot, all of whose transport is kept.
double measure_kept(const BenchScene& shot, const render::FrameJob& job, int runs) {
  render::KeptTransport kept;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = &kept;
  render::FrameResult result;
  render_frame(inputs, job, shot.half_plate, result);
  return best_ms(runs, [&] { render_frame(inputs, job, shot.half_plate, result); });
}

}  // namespace

void bench_kernel(int runs, Console& console) {
  const BenchScene shot = make_bench_scene(640, 480);
  render::FrameJob job = shot.job;
  job.lights = make_light_table(shot.environment, {64, render::LightMethod::split});
  const render::FrameJob by_default = job;
  // The plain ray set: every pixel tests every light that it faces, and nothing adapts.
  job.effort.adaptive_visibility = false;
  job.effort.interleave = 1;
  job.effort.aa_tolerance = 0;
  job.effort.glint_contrast = 0;
  const Measured plain = measure(shot, job, runs);
  const Measured adaptive = measure(shot, by_default, runs);

  const double kept_ms = measure_kept(shot, by_default, runs);

  const double share = plain.bare_ms / plain.kernel_ms;
  const double frame_share = adaptive.kernel_ms / plain.bare_ms;
  const auto rate = [](const Measured& m, double ms) {
    return static_cast<double>(m.rays) / ms * 1e-3;
  };
  console.say(fmt::format("made car, 640x480, 64 lights, {} threads",
                          tbb::this_task_arena::max_concurrency()));
  console.say(fmt::format("plain rays     {:8} rays  bare Embree {:7.1f} ms = {:5.1f} Mrays/s",
                          plain.rays, plain.bare_ms, rate(plain, plain.bare_ms)));
  console.say(
      fmt::format("               kernel, shading included {:7.1f} ms = {:5.1f} Mrays/s: {:.0f} % "
                  "of bare Embree",
                  plain.kernel_ms, rate(plain, plain.kernel_ms), 100 * share));
  console.say(
      fmt::format("default effort {:8} rays  kernel {:7.1f} ms = {:.2f} of bare Embree's time for "
                  "the plain rays",
                  adaptive.rays, adaptive.kernel_ms, frame_share));
  console.say(fmt::format("the same, kept  no rays        kernel {:7.1f} ms = {:.2f} of it",
                          kept_ms, kept_ms / plain.bare_ms));
  const Machine machine = this_machine();
  console.figures(nlohmann::ordered_json{
      {"kept_frame_ms", kept_ms},
      {"kept_frame_over_bare", kept_ms / plain.bare_ms},
      {"rays_plain", plain.rays},
      {"bare_ms", plain.bare_ms},
      {"kernel_ms", plain.kernel_ms},
      {"kernel_share", share},
      {"rays_default", adaptive.rays},
      {"default_frame_ms", adaptive.kernel_ms},
      {"default_bare_ms", adaptive.bare_ms},
      {"default_over_plain_bare", frame_share},
      {"machine", {{"cpu", machine.cpu}, {"threads", machine.threads}, {"arch", machine.arch}}}}
                      .dump(2));
}

namespace {

struct BenchOptions {
  std::string what;
  std::string set;
  std::optional<std::int64_t> runs = 5;
};

}  // namespace

Command bench_command() {
  return {"bench",
          "Measure the kernel against bare Embree over the same rays, or what inputs and live "
          "light cost",
          "platelight bench kernel --json kernel.json",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<BenchOptions>();
            arguments.positional(
                "WHAT", o->what,
                "kernel, inputs (plate, probe, light table), or hdr (a live probe's frames)");
            arguments.option("--set", o->set, "the set file whose inputs are measured");
            arguments.option("--runs", o->runs, 1, 1000, "take the best of so many runs");
            return [o](Console& console) {
              const int runs = static_cast<int>(*o->runs);
              if (o->what == "kernel") return bench_kernel(runs, console);
              if (o->what == "hdr") return bench_hdr(runs, console);
              if (o->what != "inputs") {
                throw UsageError(fmt::format(
                    "there is no benchmark of \"{}\": there are kernel, inputs and hdr", o->what));
              }
              if (o->set.empty()) throw UsageError("bench inputs needs a set file: --set SET.toml");
              bench_inputs(o->set, runs, console);
            };
          }};
}

}  // namespace studio
