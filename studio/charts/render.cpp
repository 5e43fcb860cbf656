// The chart of whole frames.
#include "studio/charts/render.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <vector>

#include <fmt/format.h>

#include "render/refinement.h"
#include "studio/charts/error_map.h"
#include "studio/charts/render_stressors.h"
#include "studio/effort_points.h"
#include "studio/effort_settings.h"
#include "studio/scene_trial.h"

namespace studio {
namespace {

using render::Effort;
using render::GroupError;

// Of a group's colour: what the share of good ones is counted by.
constexpr double good_group = 0.05;

std::vector<EffortSetting> settings_to_measure(std::string_view scene, bool quick) {
  const Effort base;
  const std::vector<EffortSetting> dial = effort_dial(base);
  std::vector<EffortSetting> all{{"all together", "default", base}};
  if (quick) {
    all.push_back(dial.front());
    return all;
  }
  std::ranges::copy_if(dial, std::back_inserter(all),
                       [&](const EffortSetting& s) { return s.effort != base; });
  all.push_back({"all together, beyond the default", "finer",
                 render::effort_of_stage(base, render::finer_stage)});
  Effort papers = base;  // while anything moved
  papers.aa_samples = 1;
  papers.accuracy = 0.95F;
  papers.soft_lights = false;
  all.push_back({"as the papers: one ray a pixel", "1 ray", papers});
  vary_effort(all, "accuracy", base, &Effort::accuracy, {0.9F, 0.99F});
  if (scene == "headlight") return all;
  vary_effort(all, "rays at edges and glints", base, &Effort::aa_samples, {4, 64});
  vary_effort(all, "tolerance of uncertain pixels", base, &Effort::aa_tolerance, {0.0F, 0.03F});
  vary_effort(all, "lights", base, &Effort::light_samples, {16, 256});
  vary_effort(all, "shadow rays", base, &Effort::interleave, {2, 4});
  all.push_back({"shadow rays", "hard", base});
  all.back().effort.soft_lights = false;
  return all;
}

// With fewer, the noise of the reference alone takes groups of pixels beyond what is allowed.
constexpr int paths = 512, paths_of_headlight = 128;

class RenderChart {
 public:
  RenderChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        out_(request.out),
        width_(quick_ ? 64 : 320),
        height_(quick_ ? 48 : 240),
        console_(console) {
    if (!out_.empty()) std::filesystem::create_directories(out_);
  }

  Chart measure() {
    Chart chart;
    chart.stage = "render";
    chart.title = "The papers' scenes: error against time";
    chart.subtitle = fmt::format(
        "{}x{}, the headlight half as wide and high, each against its own reference of {} paths a "
        "pixel (headlight: {}). Moving: all rays anew. Still: only light changes.",
        width_, height_, paths, paths_of_headlight);
    chart.error_name = "relative RMS error";
    std::vector<std::string_view> scenes = render::paper_scene_names();
    if (quick_) scenes = {"tv_room_lit", "glass_sphere"};
    const double share = 0.8 / static_cast<double>(scenes.size());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      add_scene(scenes[i], share * static_cast<double>(i), share, chart);
    }
    chart.stressors = render_stressors(quick_, console_, 0.8, 1);
    return chart;
  }

 private:
  void add_scene(std::string_view name, double from, double share, Chart& chart) const {
    console_.progress(from, fmt::format("{}: reference", name));
    // A pixel of the headlight takes ten times as long as others.
    const bool slow = name == "headlight";
    const int smaller = slow ? 2 : 1;
    const SceneTrial trial(make_paper_shot(name, width_ / smaller, height_ / smaller),
                           slow ? paths_of_headlight : paths);
    const std::vector<EffortSetting> settings = settings_to_measure(name, quick_);
    std::vector<ChartPoint> still;
    for (std::size_t i = 0; i < settings.size(); ++i) {
      console_.progress(
          from + share * static_cast<double>(i + 1) / static_cast<double>(settings.size() + 1),
          fmt::format("{}: {} {}", name, settings[i].method, settings[i].label));
      const TriedEffort tried = trial.measure(settings[i].effort, quick_ ? 1 : 3);
      const bool by_default = settings[i].effort == Effort{};
      for (const bool moves : {true, false}) {
        ChartPoint point = point_of(name, settings[i], tried, moves);
        point.by_default = by_default;
        (moves ? chart.points : still).push_back(std::move(point));
      }
      if (by_default && !out_.empty()) write_pictures(name, tried);
    }
    std::ranges::move(still, std::back_inserter(chart.points));
  }

  static ChartPoint point_of(std::string_view scene,
                             const EffortSetting& setting,
                             const TriedEffort& tried,
                             bool moves) {
    ChartPoint point;
    point.scene = fmt::format("{}, {}", scene, moves ? "moving" : "still");
    point.method = setting.method;
    point.label = setting.label;
    point.settings = settings_of(setting.effort);
    point.settings.emplace_back("moves", moves);
    point.time_ms = moves ? tried.moving_ms : tried.still_ms;
    point.error = tried.error.relative_rms;
    point.error_p99 = tried.error.p99;
    const render::RenderStatistics& s = moves ? tried.statistics : tried.still_statistics;
    const std::vector<GroupError> worst = worst_groups(tried.groups, 1);
    point.figures = {
        {"delta_e", tried.error.delta_e_mean},
        {"reference_noise", tried.error.reference_noise},
        {"groups_within_5_percent", share_within(tried.groups, &GroupError::mean, good_group)},
        {"groups_rms_within_5_percent", share_within(tried.groups, &GroupError::rms, good_group)},
        {"rays", static_cast<double>(all_rays(s))},
        {"kept_mb", moves ? 0 : tried.kept_mb}};
    if (!worst.empty() && std::isfinite(worst[0].mean)) {
      point.figures.emplace_back("worst_group_error", worst[0].mean);
      point.figures.emplace_back("worst_group_x", worst[0].x);
      point.figures.emplace_back("worst_group_y", worst[0].y);
    }
    return point;
  }

  void write_pictures(std::string_view name, const TriedEffort& tried) const {
    const double good = share_within(tried.groups, &GroupError::mean, good_group);
    const std::string path =
        (std::filesystem::path(out_) / fmt::format("render_{}", name)).string();
    write_error_map(
        path, fmt::format("{}: error of 8x8 groups, {:.1f} % of them within 5 %", name, 100 * good),
        tried.picture, tried.groups);
  }

  bool quick_;
  std::string out_;
  int width_, height_;
  Console& console_;
};

}  // namespace

ChartStage render_chart() {
  return {"render", "whole frames of the papers' scenes, at all efforts",
          [](const ChartRequest& request, Console& console) {
            return RenderChart(request, console).measure();
          }};
}

}  // namespace studio
