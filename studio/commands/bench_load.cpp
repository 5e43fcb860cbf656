// platelight bench load: from a model's file to its first picture, what each stage takes.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/load_mesh.h"
#include "render/made_headlight.h"
#include "render/made_model_file.h"
#include "studio/bench_scene.h"
#include "studio/commands/bench_rows.h"
#include "studio/commands/benches.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr int width_px = 640, height_px = 480;

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}
double processor_s() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    sum += seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  return sum;
}

// Peak resident memory since the last call, megabytes.
double take_peak_mb() {
  std::ifstream status("/proc/self/status");
  double kb = 0;
  for (std::string word; status >> word;) {
    if (word == "VmHWM:") status >> kb;
  }
  std::ofstream("/proc/self/clear_refs") << "5";
  return kb / 1024;
}

struct Stage {
  double wall_s = 0, processor_s = 0, peak_mb = 0;
};

template <class Act>
Stage measured(const Act& act) {
  take_peak_mb();
  const double before = processor_s();
  const Clock::time_point start = Clock::now();
  act();
  return {std::chrono::duration<double>(Clock::now() - start).count(), processor_s() - before,
          take_peak_mb()};
}

// Everything of a frame but the scene, which is to be seen from its front, right, and above.
BenchScene shot_of(const render::LoadReport& report) {
  BenchScene shot;
  const calibrate::Vec3 lower = calibrate::to_double(report.lower);
  const calibrate::Vec3 upper = calibrate::to_double(report.upper);
  const calibrate::Vec3 middle = (lower + upper) * 0.5;
  const double size = std::max(length(upper - lower), 1e-6);
  shot.job.cam_from_set =
      calibrate::look_at(middle + calibrate::Vec3{0.8, -0.8, 0.5} * size, middle, 0);
  const double focal_px = 1.1 * width_px;
  shot.directions = calibrate::make_direction_table(
      {"pinhole",
       width_px,
       height_px,
       {focal_px, focal_px, (width_px - 1) / 2.0, (height_px - 1) / 2.0}});
  render::LightFollower follower;
  BenchLight light = follow_bench_sky(follower, make_bench_sky({}), {.count = 64});
  shot.environment = std::move(light.environment);
  shot.plate = capture::make_image(height_px, width_px, 3);
  shot.half_plate = capture::to_half(shot.plate);
  shot.job.lights = std::move(light.table);
  // As the headlight's paper while anything moves: one ray a pixel, the contribution cut at 95 %.
  shot.job.effort.aa_samples = 1;
  shot.job.effort.accuracy = 0.95F;
  return shot;
}

struct Load {
  render::LoadReport report;
  Stage read, compile, frame;
};

Load load(const std::string& file) {
  Load result;
  render::LoadedModel model;
  result.read = measured([&] { model = render::load_model(file); });
  result.report = model.report;
  BenchScene shot = shot_of(model.report);
  result.compile =
      measured([&] { shot.scene = std::make_unique<render::Scene>(std::move(model.scene)); });
  render::FrameResult frame;
  result.frame = measured([&] { render_frame(shot.inputs(), shot.job, shot.half_plate, frame); });
  return result;
}

void keep_best(Stage& best, const Stage& other) {
  best = {std::min(best.wall_s, other.wall_s), std::min(best.processor_s, other.processor_s),
          std::max(best.peak_mb, other.peak_mb)};
}

Json to_json(const Stage& stage) {
  return {{"wall_s", stage.wall_s}, {"processor_s", stage.processor_s}, {"peak_mb", stage.peak_mb}};
}

// The headlight as a file, removed at the end.
struct MadeFile {
  std::string path;
  MadeFile()
      : path(std::filesystem::temp_directory_path() /
             fmt::format("platelight_headlight_{}.glb", getpid())) {
    render::write_glb(path, render::make_headlight());
  }
  ~MadeFile() {
    std::error_code error;
    std::filesystem::remove(path, error);
  }
  MadeFile(const MadeFile&) = delete;
  MadeFile& operator=(const MadeFile&) = delete;
};

}  // namespace

void bench_load(std::vector<std::string> files, int runs, Console& console) {
  std::optional<MadeFile> made;
  if (files.empty()) files.push_back(made.emplace().path);
  Json rows = Json::array();
  for (const std::string& file : files) {
    Load best = load(file);
    for (int run = 1; run < runs; ++run) {
      const Load next = load(file);
      keep_best(best.read, next.read);
      keep_best(best.compile, next.compile);
      keep_best(best.frame, next.frame);
    }
    // The system counts what we had taken when it began as the helper's.
    rusage helpers{};
    getrusage(RUSAGE_CHILDREN, &helpers);
    const double reader_mb = static_cast<double>(helpers.ru_maxrss) / 1024;
    console.say(fmt::format("{}: {} triangles, {} vertices", file, best.report.triangles,
                            best.report.vertices));
    for (const auto& [name, stage] :
         {std::pair("read", best.read), {"compile", best.compile}, {"first frame", best.frame}}) {
      console.say(fmt::format("  {:12} {:6.2f} s, {:6.2f} s of processor, peak {:5.0f} MB", name,
                              stage.wall_s, stage.processor_s, stage.peak_mb));
    }
    console.say(fmt::format("  its reader took at most {:.0f} MB, and has ended", reader_mb));
    rows.push_back({{"file", file},
                    {"triangles", best.report.triangles},
                    {"vertices", best.report.vertices},
                    {"read", to_json(best.read)},
                    {"compile", to_json(best.compile)},
                    {"first_frame", to_json(best.frame)},
                    {"reader_peak_mb", reader_mb}});
  }
  give_rows(rows, console);
}

}  // namespace studio
