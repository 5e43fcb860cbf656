// platelight bench papers: the scenes of both papers, their figures and ours.
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/png.h"
#include "render/false_colour.h"
#include "render/paired_error.h"
#include "render/paper_scenes.h"
#include "studio/commands/bench_rows.h"
#include "studio/commands/benches.h"
#include "studio/commands/kernel_rate.h"
#include "studio/display_png.h"
#include "studio/least_time.h"
#include "studio/paper_shot.h"
#include "studio/picture_error.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr double very_slow_ms = 10000;  // frames that take longer are timed once

// As the papers did while anything moved: one ray a pixel, and the contribution cut at 95 %.
render::Effort papers_effort() {
  render::Effort effort;
  effort.aa_samples = 1;
  effort.accuracy = 0.95F;
  effort.soft_lights = false;
  return effort;
}

Json rays_of(const BenchScene& shot, const render::FrameJob& job) {
  render::FrameResult result;
  render_frame(shot.inputs(), job, shot.half_plate, result);
  const render::RenderStatistics& s = result.statistics;
  return {{"primary", s.primary_rays},
          {"shadow", s.shadow_rays},
          {"secondary", s.secondary_rays},
          {"depth_limit_hits", s.depth_limit_hits},
          {"ray_limit_hits", s.ray_limit_hits}};
}

render::PairedError paired(const capture::Image& picture, const Truth& truth) {
  return render::paired_error({&picture, &picture}, {&truth.references[0], &truth.references[1]},
                              truth.mask);
}

// An error that the noise of the references hides is told by what it is at most, of two deviations.
std::string percent(const render::PairedError& error) {
  const double noise = error.square_standard_error;
  if (error.square > noise) return fmt::format("{:.1f} %", 100 * error.relative_rms);
  return fmt::format("<{:.1f} %", 100 * std::sqrt(std::max(0.0, error.square) + 2 * noise));
}

// The depth of every pixel's ray tree and its rays, as the headlight paper's figures 2 and 3.
void write_views(const std::string& path_start,
                 const BenchScene& shot,
                 const render::FrameJob& job) {
  render::FrameInputs inputs = shot.inputs();
  inputs.count_rays = true;
  render::FrameResult result;
  render_frame(inputs, job, shot.half_plate, result);
  std::vector<std::uint8_t> codes(result.rays.pixels.size() * 3);
  for (const render::RayView view : {render::RayView::depth, render::RayView::rays}) {
    draw_false_colour(result.rays, view, codes);
    const int width = result.rays.width, height = result.rays.height;
    draw_legend(view, width, height, codes);
    const std::string& name = render::ray_view_names()[static_cast<std::size_t>(view)];
    capture::write_png(fmt::format("{}_{}.png", path_start, name), width, height, 3, codes);
  }
}

// The live video of a paper's scene: "130x100 at 25 fps".
std::string video_of(const render::PaperFigure& paper) {
  if (paper.video_width == 0) return "none";
  return fmt::format("{}x{} at {:g} fps", paper.video_width, paper.video_height, paper.video_fps);
}

// What ours has in its place. Of a video, the bench shows one frame.
std::string video_of(const BenchScene& shot, const render::PaperFigure* paper) {
  if (shot.video) return fmt::format("{}x{}", shot.video->width(), shot.video->height());
  return paper != nullptr && paper->video_width > 0 ? "still picture" : "none";
}

Json row_of(std::string_view name, const PapersBench& bench, Console& console) {
  const int width = bench.width, height = bench.height;
  const auto [shot, compile_ms] = make_paper_shot(name, width, height);
  const auto figures = render::paper_figures();
  const auto found = std::ranges::find(figures, name, &render::PaperFigure::scene);
  const render::PaperFigure* const theirs = found != figures.end() ? &*found : nullptr;
  const std::string texture = video_of(shot, theirs);
  render::FrameJob fast = shot.job;
  fast.effort = papers_effort();
  render::FrameJob plain = fast;
  plain.effort = plain_effort(plain.effort);
  const KernelRate share = measure_kernel(shot, plain, bench.runs);
  const KernelRate moving = measure_kernel(shot, fast, bench.runs);
  // Not beside bare Embree: the headlight's rays, some 300 million, are more than memory holds.
  render::FrameResult whole;
  const double whole_ms =
      least_time_ms([&] { render_frame(shot.inputs(), shot.job, shot.half_plate, whole); }, 1);
  const KeptRate still = measure_kept(shot, shot.job, whole_ms > very_slow_ms ? 1 : bench.runs);
  Json row{{"scene", name},
           {"triangles", triangle_count(shot.scene->description())},
           {"texture", texture},
           {"width", width},
           {"height", height},
           {"threads", tbb::this_task_arena::max_concurrency()},
           {"fps", 1000 / moving.kernel_ms},
           {"fps_default", 1000 / whole_ms},
           {"fps_still", 1000 / still.ms},
           {"rays_per_frame", moving.rays},
           {"rays", rays_of(shot, fast)},
           {"rays_per_frame_default", all_rays(whole.statistics)},
           {"rays_per_frame_still", still.rays},
           {"embree_share", share.bare_ms / share.kernel_ms},
           {"compile_ms", compile_ms},
           {"error", nullptr},
           {"error_noise", nullptr},
           {"error_default", nullptr},
           {"error_default_noise", nullptr}};
  std::string rough_error = "-", whole_error = "-";
  const capture::Image picture = capture::to_float(whole.rgba);
  if (bench.check > 0) {
    const Truth truth = truth_of(shot.plate, [&](std::uint32_t seed) {
      return render_reference(shot.inputs(), shot.job, shot.plate,
                              {.samples = std::max(1, bench.check / 2), .seed = seed});
    });
    render::FrameResult rough;
    render_frame(shot.inputs(), fast, shot.half_plate, rough);
    const render::PairedError of_rough = paired(capture::to_float(rough.rgba), truth);
    const render::PairedError of_whole = paired(picture, truth);
    row["error"] = of_rough.relative_rms;
    row["error_noise"] = of_rough.standard_error;
    row["error_default"] = of_whole.relative_rms;
    row["error_default_noise"] = of_whole.standard_error;
    rough_error = percent(of_rough);
    whole_error = percent(of_whole);
    if (!bench.pictures.empty()) {
      write_display_png(fmt::format("{}/{}_reference.png", bench.pictures, name),
                        truth.references[0]);
    }
  }
  if (!bench.pictures.empty()) {
    write_display_png(fmt::format("{}/{}.png", bench.pictures, name), picture);
    write_views(fmt::format("{}/{}", bench.pictures, name), shot, fast);
  }
  if (theirs != nullptr) {
    row["paper"] = {{"source", theirs->source},
                    {"triangles", theirs->triangles},
                    {"cpus", theirs->cpus},
                    {"texture", video_of(*theirs)},
                    {"fps", theirs->fps}};
  }
  console.say(fmt::format(
      "{:<13} {:>9}  {:<17} {:<13} {:>8} {:>10.1f} {:>7} {:>9.1f} {:>7} {:>8.1f} {:>9.2f} M "
      "{:>7.0f} %",
      name, std::size_t{row["triangles"]}, theirs != nullptr ? video_of(*theirs) : "-", texture,
      theirs != nullptr ? fmt::format("{:.1f}", theirs->fps) : "-", double{row["fps"]}, rough_error,
      double{row["fps_default"]}, whole_error, double{row["fps_still"]},
      1e-6 * static_cast<double>(moving.rays), 100 * share.bare_ms / share.kernel_ms));
  return row;
}

}  // namespace

void bench_papers(const PapersBench& bench, Console& console) {
  if (!bench.scene.empty()) render::made_paper_scene(bench.scene);  // throws for another name
  if (!bench.pictures.empty()) std::filesystem::create_directories(bench.pictures);
  console.say(fmt::format("{:23}  {:<31} {:>8} {:>10} {:>7} {:>9} {:>7} {:>8} {:>11} {:>9}", "",
                          "texture", "paper", "1 ray a", "error", "default", "error", "still",
                          "rays", "share of"));
  console.say(
      fmt::format("{:<13} {:>9}  {:<17} {:<13} {:>8} {:>10} {:>7} {:>9} {:>7} {:>8} {:>11} {:>9}",
                  "scene", "triangles", "paper's", "ours", "fps", "pixel, fps", "", "fps", "",
                  "fps", "moving", "Embree"));
  Json rows = Json::array();
  for (const std::string_view name : render::paper_scene_names()) {
    if (!bench.scene.empty() && name != bench.scene) continue;
    rows.push_back(row_of(name, bench, console));
  }
  give_rows(rows, console);
}

}  // namespace studio
