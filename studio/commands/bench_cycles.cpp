// platelight bench cycles: the same scenes in Blender's Cycles, error against time of both.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/exr.h"
#include "render/pixel_rays.h"
#include "render/trace.h"
#include "studio/commands/bench_rows.h"
#include "studio/commands/benches.h"
#include "studio/commands/compare_with_cycles.h"
#include "studio/display_png.h"
#include "studio/machine.h"
#include "studio/peer_scene.h"

namespace studio {
namespace {

using capture::Image;
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int width = 640, height = 480;
constexpr float brightest = 4;  // of what errors count, as in the design's error of a picture

using Pair = std::array<Image, 2>;  // converged, of independent noise

double clamped(float value) { return std::min(value, brightest); }

// Calls add(pixel, channel) for all RGB of a picture (height, width, 4).
template <class F>
void for_each_rgb(F&& add) {
  for (std::size_t pixel = 0; pixel < std::size_t{width} * height; ++pixel) {
    for (std::size_t c = 0; c < 3; ++c) add(pixel, 4 * pixel + c);
  }
}

// Root mean square of x - truth over all pixels and colours, without the truth's own noise.
double rms_error(const Image& x, const Pair& truth) {
  double sum = 0;
  for_each_rgb([&](std::size_t, std::size_t i) {
    const double value = clamped(x.pixels[i]);
    sum += (value - clamped(truth[0].pixels[i])) * (value - clamped(truth[1].pixels[i]));
  });
  return std::sqrt(std::max(0.0, sum) / (3.0 * width * height));
}

struct Difference {
  double mean = 0, rms = 0, share = 0;  // signed mean of a - b; noise left out of the rms
};
// Over the pixels of a region, or all of the picture.
Difference difference(const Pair& a, const Pair& b, const std::vector<bool>* region) {
  double sum = 0, squares = 0;
  std::size_t count = 0;
  for_each_rgb([&](std::size_t pixel, std::size_t i) {
    if (region != nullptr && !(*region)[pixel]) return;
    const double first = clamped(a[0].pixels[i]) - clamped(b[0].pixels[i]);
    const double second = clamped(a[1].pixels[i]) - clamped(b[1].pixels[i]);
    sum += 0.5 * (first + second);
    squares += first * second;
    ++count;
  });
  const auto n = static_cast<double>(count);
  return {sum / n, std::sqrt(std::max(0.0, squares / n)), n / (3.0 * width * height)};
}

// Which pixels' middle rays meet each material.
std::map<std::string, std::vector<bool>> regions_of(const BenchScene& shot) {
  std::map<std::string, std::vector<bool>> regions;
  const render::PixelRays rays(shot.directions, shot.job.cam_from_set);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto direction = rays.direction(x, y, 0, 0);
      if (!direction) continue;
      const auto hit =
          closest_hit(*shot.scene, rays.origin(), *direction, 0, ~0U, render::RayKind::camera);
      if (!hit) continue;
      const auto surface = shot.scene->surface_of(hit->geom_id, hit->prim_id, hit->inst_id);
      auto& region = regions[shot.scene->description().materials[surface.material].name];
      region.resize(std::size_t{width} * height);
      region[static_cast<std::size_t>(y * width + x)] = true;
    }
  }
  return regions;
}

// Runs Blender on a scene's folder; what it says goes to a file there.
void run_blender(const fs::path& directory,
                 int runs,
                 int converged,
                 const std::vector<int>& counts) {
  const fs::path script = directory / "compare_with_cycles.py", log = directory / "blender.log";
  std::ofstream(script) << compare_with_cycles;
  std::vector<std::string> words{"blender",
                                 "-b",
                                 "--factory-startup",
                                 "-noaudio",
                                 "-P",
                                 script.string(),
                                 "--",
                                 directory.string(),
                                 std::to_string(tbb::this_task_arena::max_concurrency()),
                                 std::to_string(runs),
                                 std::to_string(converged)};
  for (const int count : counts) words.push_back(std::to_string(count));
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int error = posix_spawnp(&child, "blender", &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (error == ENOENT) {
    throw std::runtime_error(
        "blender is not installed: it is what bench cycles compares with; apt install blender");
  }
  if (error != 0) throw std::runtime_error(fmt::format("blender: {}", std::strerror(error)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0 || !fs::exists(directory / "cycles.json"))
    throw std::runtime_error("blender failed: see " + log.string());
}

// What Cycles shows, over the even plate.
Image over_plate(const fs::path& path, const Image& plate) {
  Image rgba = capture::read_exr(path.string());
  if (rgba.width != width || rgba.height != height || rgba.channels != 4)
    throw std::runtime_error(path.string() + ": not the picture that was asked for");
  for_each_rgb([&](std::size_t pixel, std::size_t i) {
    rgba.pixels[i] += (1 - rgba.pixels[4 * pixel + 3]) * plate.pixels[3 * pixel + i - 4 * pixel];
  });
  return rgba;
}

struct Point {
  std::string name;
  double cpu_ms = 0, wall_ms = 0, error = 0, error_to_other = 0;
};

Json json_of(const Point& p) {
  return {{"name", p.name},
          {"cpu_ms", p.cpu_ms},
          {"wall_ms", p.wall_ms},
          {"rmse", p.error},
          {"rmse_to_other", p.error_to_other}};
}

// CPU time at which a series of points, by growing time, comes to an error: between two of them by
// powers, beyond the last as the square, but no further than a quarter of its error, since what is
// below is lost in the truths' noise.
struct TimeAt {
  double cpu_ms = 0;
  bool at_least = false;
};
TimeAt time_at(const std::vector<Point>& points, double error) {
  if (error >= points[0].error) return {points[0].cpu_ms};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Point &a = points[i - 1], &b = points[i];
    if (error > a.error || error < b.error) continue;
    const double t = std::log(error / a.error) / std::log(b.error / a.error);
    return {a.cpu_ms * std::pow(b.cpu_ms / a.cpu_ms, t)};
  }
  const Point& last = points.back();
  const double furthest = std::max(error, last.error / 4);
  return {last.cpu_ms * std::pow(last.error / furthest, 2), furthest > error};
}

struct NamedEffort {
  std::string name;
  render::Effort effort;
};

std::vector<NamedEffort> efforts() {
  std::vector<NamedEffort> all;
  for (const int lights : {16, 24, 64}) {
    for (const int interleave : {2, 1}) {
      for (const bool soft : {false, true}) {
        render::Effort e;
        e.light_samples = lights;
        e.interleave = interleave;
        e.soft_lights = soft;
        const auto add = [&](int rays, float contrast, const char* where) {
          e.aa_samples = rays;
          e.aa_tolerance = e.glint_contrast = contrast;
          all.push_back({fmt::format("{} {} lights, interleaved {}, {}", lights,
                                     soft ? "soft" : "hard", interleave, where),
                         e});
        };
        add(1, 0, "1 ray");
        add(4, 0, "4 at edges");
        add(4, 0.3F, "4 at glints too");
      }
    }
  }
  all.push_back({"default", {}});
  render::Effort high;
  high.light_samples = 256;
  high.aa_tolerance = 0.03F;
  high.glint_contrast = 0.02F;
  high.accuracy = 0.99F;
  all.push_back({"256 lights, tolerance .03", high});
  return all;
}

// What was measured of one scene.
struct Comparison {
  std::string name;
  Json blender;       // what it tells of itself
  Pair ours, theirs;  // converged
  std::vector<Point> our_points, their_points;
  std::map<std::string, std::vector<bool>> regions;
  Difference all() const { return difference(ours, theirs, nullptr); }
};

std::vector<Point> measure_theirs(const Comparison& made,
                                  const fs::path& directory,
                                  const Image& plate) {
  std::vector<Point> points;
  for (const Json& rendered : made.blender["pictures"]) {
    if (rendered["seed"] != 1) continue;
    const Image picture = over_plate(directory / std::string(rendered["file"]), plate);
    points.push_back({fmt::format("{} samples", int{rendered["samples"]}),
                      1000 * double{rendered["cpu_s"]}, 1000 * double{rendered["render_s"]},
                      rms_error(picture, made.theirs), rms_error(picture, made.ours)});
  }
  return points;
}

// One effort, the best of so many runs. Its light is the shot's then.
Point measure_ours(const NamedEffort& named,
                   const render::Environment& sky,
                   int runs,
                   const Comparison& made,
                   BenchScene& shot,
                   render::FrameInputs inputs) {
  render::LightFollower follower;
  BenchLight light = follow_bench_sky(follower, sky, {.count = named.effort.light_samples});
  shot.environment = std::move(light.environment);
  shot.job.lights = std::move(light.table);
  shot.job.effort = named.effort;
  inputs.environment = &shot.environment;
  render::FrameResult result;
  Point point{named.name, 1e30, 1e30};
  for (int run = 0; run < runs; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu = cpu_ms_so_far();
    render_frame(inputs, shot.job, shot.half_plate, result);
    point.cpu_ms = std::min(point.cpu_ms, cpu_ms_so_far() - cpu);
    point.wall_ms =
        std::min(point.wall_ms,
                 std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                     .count());
  }
  const Image picture = capture::to_float(result.rgba);
  point.error = rms_error(picture, made.ours);
  point.error_to_other = rms_error(picture, made.theirs);
  return point;
}

Comparison compare(const std::string& name, const CyclesBench& bench) {
  const fs::path directory = fs::absolute(fs::path(bench.directory) / name);
  PeerScene scene = make_peer_scene(name, width, height);
  BenchScene& shot = scene.shot;
  write_peer_scene(scene, directory);
  std::vector<int> counts;
  for (int count = 1; count <= std::min(bench.converged, 256); count *= 4) counts.push_back(count);
  run_blender(directory, bench.runs, bench.converged, counts);
  Comparison made;
  made.name = name;
  std::ifstream(directory / "cycles.json") >> made.blender;

  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &shot.lens;
  inputs.plate = &shot.half_plate;
  for (std::uint32_t i = 0; i < 2; ++i) {
    made.ours[i] =
        render_reference(inputs, shot.job, shot.plate, {.samples = bench.check, .seed = i + 1});
    made.theirs[i] =
        over_plate(directory / fmt::format("cycles_{}_{}.exr", bench.converged, i + 2), shot.plate);
  }
  write_display_png(directory / "platelight.png", made.ours[0]);
  write_display_png(directory / "cycles.png", made.theirs[0]);

  made.their_points = measure_theirs(made, directory, shot.plate);
  const render::Environment sky = std::move(shot.environment);
  for (const NamedEffort& named : efforts()) {
    made.our_points.push_back(measure_ours(named, sky, bench.runs, made, shot, inputs));
  }
  std::ranges::sort(made.our_points, {}, &Point::cpu_ms);
  made.regions = regions_of(shot);
  return made;
}

// How many times the CPU time Cycles takes to come to a point's error.
struct Faster {
  double times = 0;
  bool at_least = false;
};
Faster faster_than(const std::vector<Point>& theirs, const Point& ours) {
  const auto [cycles_ms, at_least] = time_at(theirs, ours.error);
  return {cycles_ms / ours.cpu_ms, at_least};
}

void print(const Comparison& made, Console& console) {
  const Difference all = made.all();
  console.say(fmt::format("\n{}: converged pictures differ by {:+.5f} in the mean, {:.4f} rms",
                          made.name, all.mean, all.rms));
  for (const auto& [material, region] : made.regions) {
    const Difference there = difference(made.ours, made.theirs, &region);
    if (there.share <= 0.002) continue;
    console.say(fmt::format("  {:<12} {:5.1f} % of the picture  {:+.4f} mean  {:.4f} rms", material,
                            100 * there.share, there.mean, there.rms));
  }
  console.say(fmt::format("  {:<44} {:>10} {:>10} {:>8} {:>10}", "Cycles", "CPU ms", "wall ms",
                          "RMSE", "to ours"));
  for (const Point& p : made.their_points) {
    console.say(fmt::format("  {:<44} {:>10.0f} {:>10.0f} {:>8.4f} {:>10.4f}", p.name, p.cpu_ms,
                            p.wall_ms, p.error, p.error_to_other));
  }
  console.say(fmt::format("  {:<44} {:>10} {:>10} {:>8} {:>10} {:>8}", "Platelight", "CPU ms",
                          "wall ms", "RMSE", "to theirs", "faster"));
  for (const Point& p : made.our_points) {
    const Faster faster = faster_than(made.their_points, p);
    console.say(fmt::format("  {:<44} {:>10.0f} {:>10.0f} {:>8.4f} {:>10.4f} {:>2}{:>5.0f}x",
                            p.name, p.cpu_ms, p.wall_ms, p.error, p.error_to_other,
                            faster.at_least ? ">" : "", faster.times));
  }
}

Json json_of(const Comparison& made) {
  Json regions = Json::object();
  for (const auto& [material, region] : made.regions) {
    const Difference there = difference(made.ours, made.theirs, &region);
    regions[material] = {{"share", there.share}, {"mean", there.mean}, {"rms", there.rms}};
  }
  Json ours = Json::array(), theirs = Json::array();
  for (const Point& p : made.our_points) {
    ours.push_back(json_of(p));
    ours.back()["times_faster"] = faster_than(made.their_points, p).times;
  }
  for (const Point& p : made.their_points) theirs.push_back(json_of(p));
  const Difference all = made.all();
  return {{"scene", made.name},
          {"mean_difference", all.mean},
          {"rms_difference", all.rms},
          {"materials", regions},
          {"blender", made.blender["version"]},
          {"cycles_preparing_cpu_s", made.blender["preparing_cpu_s"]},
          {"cycles", theirs},
          {"platelight", ours}};
}

}  // namespace

void bench_cycles(const CyclesBench& bench, Console& console) {
  console.say(fmt::format("{}x{}, {} threads; CPU time of all threads, preparing the scene apart",
                          width, height, tbb::this_task_arena::max_concurrency()));
  Json rows = Json::array();
  for (const std::string& name : peer_scene_names()) {
    if (!bench.scene.empty() && bench.scene != name) continue;
    const Comparison made = compare(name, bench);
    print(made, console);
    rows.push_back(json_of(made));
  }
  if (rows.empty()) make_peer_scene(bench.scene, width, height);  // throws, naming those there are
  give_rows(rows, console);
}

}  // namespace studio
