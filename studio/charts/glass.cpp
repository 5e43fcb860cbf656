// The chart of glass.
#include "studio/charts/glass.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include <fmt/format.h>

#include "studio/paper_shot.h"

namespace studio {
namespace {

// Closer to the whole tree of rays than any setting that is charted.
constexpr float whole_tree = 0.9999F;

class GlassChart {
 public:
  GlassChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        width_(quick_ ? 64 : 320),
        height_(quick_ ? 48 : 240),
        console_(console) {}

  Chart measure() {
    Chart chart;
    chart.stage = "glass";
    chart.title = "Glass: error against time";
    chart.subtitle = fmt::format(
        "{}x{}, 16 camera rays in pixels with an edge, one in others; error against the same "
        "camera rays followed to an accuracy of {} %.",
        width_, height_, "99.99");
    chart.error_name = "relative RMS error of cutting rays";
    chart.variant_name = "what a cut ray sees";
    const std::vector<std::string_view> scenes =
        quick_ ? std::vector<std::string_view>{"glass_sphere"}
               : std::vector<std::string_view>{"headlight", "glass_sphere"};
    double done = 0;
    for (const std::string_view scene : scenes) {
      console_.progress(done++ / static_cast<double>(scenes.size()), scene);
      add_scene(scene, chart);
    }
    chart.panels.push_back({"99th percentile of the error", {{"error_p99", ""}}});
    return chart;
  }

 private:
  struct Shown {
    capture::Image picture;
    render::RenderStatistics statistics;
    double time_ms = 0;
  };

  static Shown render(const BenchScene& shot, const render::Effort& effort) {
    render::FrameJob job = shot.job;
    job.effort = effort;
    render::FrameResult result;
    const auto start = std::chrono::steady_clock::now();
    render_frame(shot.inputs(), job, shot.half_plate, result);
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    return {capture::to_float(result.rgba), result.statistics, taken.count()};
  }

  // The same camera rays at any accuracy: nothing that adapts to what they see.
  static render::Effort effort_of(float accuracy, bool dark, int max_depth) {
    render::Effort effort;
    effort.aa_tolerance = effort.glint_contrast = 0;
    effort.accuracy = accuracy;
    effort.dark_cuts = dark;
    effort.max_depth = max_depth;
    return effort;
  }

  void add_scene(std::string_view name, Chart& chart) const {
    const BenchScene shot = make_paper_shot(name, width_, height_).shot;
    const Shown whole = render(shot, effort_of(whole_tree, false, 64));
    const capture::Image mask = render::affected_mask(whole.picture, shot.plate);
    const auto error_of = [&](const Shown& shown) {
      return render::picture_error(shown.picture, whole.picture, mask);
    };
    const std::vector<float> accuracies =
        quick_ ? std::vector{0.8F, 0.95F} : std::vector{0.8F, 0.9F, 0.95F, 0.97F, 0.99F, 0.999F};
    for (const bool dark : {false, true}) {
      for (const float accuracy : accuracies) {
        const Shown shown = render(shot, effort_of(accuracy, dark, 64));
        const render::PictureError error = error_of(shown);
        ChartPoint point;
        point.method = name;
        point.variant = dark ? "nothing" : "the environment";
        point.settings = {{"accuracy", double{accuracy}}, {"dark_cuts", dark}};
        point.time_ms = shown.time_ms;
        point.error = error.relative_rms;
        point.error_p99 = error.p99;
        const double pixels = width_ * height_;
        point.figures = {
            {"secondary_rays", static_cast<double>(shown.statistics.secondary_rays) / pixels},
            {"shadow_rays", static_cast<double>(shown.statistics.shadow_rays) / pixels},
            {"depth_limit_hits", static_cast<double>(shown.statistics.depth_limit_hits)}};
        point.by_default = !dark && accuracy == render::Effort{}.accuracy;
        point.label = fmt::format("{:.3g} %", 100 * accuracy);
        chart.points.push_back(std::move(point));
      }
    }
    Stressor depth;
    depth.stressor = fmt::format("deepest ray, {}", name);
    for (const int limit : {1, 2, 4, 8, 16, 32, 64}) {
      const Shown shown = render(shot, effort_of(0.99F, false, limit));
      depth.samples.push_back(
          {static_cast<double>(limit), error_of(shown).relative_rms, std::nullopt,
           shown.statistics.depth_limit_hits > 0 ? "some rays ended by the limit" : "ok"});
    }
    chart.stressors.push_back(std::move(depth));
  }

  bool quick_;
  int width_, height_;
  Console& console_;
};

}  // namespace

ChartStage glass_chart() {
  return {"glass", "how far rays are followed through the papers' glass",
          [](const ChartRequest& request, Console& console) {
            return GlassChart(request, console).measure();
          }};
}

}  // namespace studio
