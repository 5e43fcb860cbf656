// platelight bench: ratios to a limit, both measured in one process.
#include <tbb/task_arena.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/light_table.h"
#include "studio/bench_scene.h"
#include "studio/commands/benches.h"
#include "studio/commands/commands.h"
#include "studio/commands/kernel_rate.h"
#include "studio/machine.h"

namespace studio {
void bench_kernel(int runs, Console& console) {
  const BenchScene shot = make_bench_scene(640, 480);
  render::FrameJob job = shot.job;
  job.lights = make_light_table(shot.environment, {64, render::LightMethod::split});
  const render::FrameJob by_default = job;
  job.effort = plain_effort(job.effort);
  const KernelRate plain = measure_kernel(shot, job, runs);
  const KernelRate adaptive = measure_kernel(shot, by_default, runs);

  const KeptRate kept = measure_kept(shot, by_default, runs);

  const double share = plain.bare_ms / plain.kernel_ms;
  const double frame_share = adaptive.kernel_ms / plain.bare_ms;
  const auto rate = [](const KernelRate& m, double ms) {
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
  console.say(fmt::format("the same, kept {:8} rays  kernel {:7.1f} ms = {:.2f} of it", kept.rays,
                          kept.ms, kept.ms / plain.bare_ms));
  const Machine machine = this_machine();
  console.figures(nlohmann::ordered_json{
      {"kept_frame_ms", kept.ms},
      {"kept_frame_over_bare", kept.ms / plain.bare_ms},
      {"rays_kept", kept.rays},
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
  std::string pictures, scene;
  std::vector<std::string> files;
  // As given; what is left out is as default_runs and the benches' own settings have it.
  std::optional<std::int64_t> runs, check, converged, width, height, frames;
};

constexpr int default_runs = 5;
constexpr std::int64_t default_frames = 250;

void take(const std::optional<std::int64_t>& given, int& setting) {
  if (given) setting = static_cast<int>(*given);
}

PapersBench papers_of(const BenchOptions& o, int runs) {
  PapersBench bench{.runs = runs, .pictures = o.pictures, .scene = o.scene};
  take(o.check, bench.check);
  take(o.width, bench.width);
  take(o.height, bench.height);
  return bench;
}

CyclesBench cycles_of(const BenchOptions& o, int runs) {
  if (o.pictures.empty()) throw UsageError("bench cycles needs a place: --pictures DIR");
  CyclesBench bench{.directory = o.pictures, .runs = runs, .scene = o.scene};
  take(o.check, bench.check);
  take(o.converged, bench.converged);
  bench.check = std::max(1, bench.check);
  return bench;
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// What is named for a benchmark that does not look at it.
void refuse_what_is_ignored(const BenchOptions& o) {
  struct Option {
    const char* name;
    bool is_given;
    std::vector<std::string> takers;
  };
  for (const Option& option :
       {Option{"--set", !o.set.empty(), {"inputs"}}, Option{"--model", !o.files.empty(), {"load"}},
        Option{"--scene", !o.scene.empty(), {"papers", "drag", "cycles"}},
        Option{"--pictures", !o.pictures.empty(), {"papers", "drag", "cycles"}},
        Option{"--check-error", o.check.has_value(), {"papers", "cycles"}},
        Option{"--converged", o.converged.has_value(), {"cycles"}},
        Option{"--width", o.width.has_value(), {"papers"}},
        Option{"--height", o.height.has_value(), {"papers"}},
        Option{"--frames", o.frames.has_value(), {"inputs"}},
        Option{"--runs",
               o.runs.has_value(),
               {"kernel", "growth", "papers", "deform", "cycles", "inputs", "hdr", "load"}}}) {
    if (!option.is_given || std::ranges::find(option.takers, o.what) != option.takers.end()) {
      continue;
    }
    throw UsageError(fmt::format("bench {} takes no {}: it is for {}", o.what, option.name,
                                 listed(option.takers)));
  }
}

}  // namespace

Command bench_command() {
  return {
      "bench",
      "Measure the kernel against bare Embree over the same rays, or what inputs, live "
      "light and models cost",
      "platelight bench kernel --json kernel.json",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<BenchOptions>();
        arguments.positional(
            "WHAT", o->what,
            "kernel, growth (with triangles and threads), papers (both papers' scenes), drag (a "
            "part of them that moves), deform (a cloth), cycles (the same pictures in Blender's "
            "Cycles), inputs (plate, probe, light table), hdr (a live probe's frames), or load "
            "(models)");
        arguments.repeated("--model", o->files, "load: a model's file; without one, a made one");
        arguments.option("--set", o->set, "the set file whose inputs are measured");
        arguments.option(
            "--pictures", o->pictures,
            "papers: a directory for pictures of every scene: itself, and depth and rays by pixel; "
            "drag: for what it shows; "
            "cycles: for the scenes as files and all pictures");
        arguments.option("--scene", o->scene, "papers, drag, cycles: only this one");
        arguments.option("--check-error", o->check, 0, 65536,
                         "papers: paths a pixel of both references together, 0 = no error; cycles: "
                         "of each of two, at least 1");
        arguments.option("--converged", o->converged, 2, 65536,
                         "cycles: samples a pixel of Cycles' own converged picture");
        arguments.option("--width", o->width, 16, 7680, "papers: of the pictures, in pixels");
        arguments.option("--height", o->height, 16, 4320, "papers: of the pictures, in pixels");
        arguments.option("--frames", o->frames, 2, 1 << 20, "inputs: at most so many of the set's");
        arguments.option("--runs", o->runs, 1, 1000, "all but drag: take the best of so many runs");
        return [o](Console& console) {
          const int runs = static_cast<int>(o->runs.value_or(default_runs));
          const std::vector<std::string> names{"kernel", "growth", "papers", "drag", "deform",
                                               "cycles", "inputs", "hdr",    "load"};
          if (std::ranges::find(names, o->what) == names.end()) {
            throw UsageError(fmt::format("there is no benchmark of \"{}\": there are {}", o->what,
                                         listed(names)));
          }
          refuse_what_is_ignored(*o);
          if (o->what == "kernel") return bench_kernel(runs, console);
          if (o->what == "growth") return bench_growth(runs, console);
          if (o->what == "hdr") return bench_hdr(runs, console);
          if (o->what == "deform") return bench_deform(runs, console);
          if (o->what == "drag") return bench_drag(o->scene, o->pictures, console);
          if (o->what == "papers") return bench_papers(papers_of(*o, runs), console);
          if (o->what == "load") return bench_load(o->files, runs, console);
          if (o->what == "cycles") return bench_cycles(cycles_of(*o, runs), console);
          if (o->set.empty()) throw UsageError("bench inputs needs a set file: --set SET.toml");
          bench_inputs(o->set, runs, o->frames.value_or(default_frames), console);
        };
      }};
}

}  // namespace studio
