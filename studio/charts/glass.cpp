// The chart of glass.
#include "studio/charts/glass.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "render/paper_scenes.h"
#include "studio/paper_shot.h"
#include "studio/picture_error.h"

namespace studio {
namespace {

// Closer to the whole tree of rays than any setting that is charted.
constexpr float whole_tree = 0.9999F;
// Camera rays along a pixel's side: each in the middle of its part, so that all of the pixel is
// seen, as the reference sees it, and nothing adapts to what they meet.
constexpr int rays_across = 4;

// What becomes of rays that are cut.
enum class Cuts { environment, nothing, chance };
constexpr std::array<std::string_view, 3> methods{
    "cut rays see the environment", "cut rays see nothing", "some followed by chance"};

constexpr std::string_view in_the_sun = "headlight in the sun";

// The papers' scenes, and the headlight in the light of their car: a sun that ribs and facets break
// up is the hardest that a lamp is seen in.
PaperShot shot_of(std::string_view scene, int width, int height) {
  if (scene != in_the_sun) return make_paper_shot(scene, width, height);
  render::PaperScene paper = render::made_paper_scene("headlight");
  paper.environment = render::made_paper_scene("car").environment;
  return make_paper_shot(std::move(paper), width, height);
}

// The mean of every rays_across x rays_across pixels.
capture::Image averaged(const capture::Image& fine) {
  capture::Image image =
      capture::make_image(fine.height / rays_across, fine.width / rays_across, fine.channels);
  constexpr float share = 1.0F / (rays_across * rays_across);
  for (int y = 0; y < image.height * rays_across; ++y) {
    for (int x = 0; x < image.width * rays_across; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        image.at(y / rays_across, x / rays_across, c) += share * fine.at(y, x, c);
      }
    }
  }
  return image;
}

class GlassChart {
 public:
  GlassChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        width_(quick_ ? 48 : 240),
        height_(quick_ ? 36 : 180),
        console_(console) {}

  Chart measure() {
    Chart chart;
    chart.stage = "glass";
    chart.title = "Glass: error against time";
    chart.subtitle = fmt::format(
        "{}x{}, {} camera rays in every pixel; error against the same rays followed to an accuracy "
        "of {} %, and against the path-traced reference.",
        width_, height_, rays_across * rays_across, "99.99");
    chart.error_name = "relative RMS error of cutting rays";
    const std::vector<std::string_view> scenes =
        quick_ ? std::vector<std::string_view>{"glass_sphere"}
               : std::vector<std::string_view>{"headlight", in_the_sun, "glass_sphere"};
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      add_scene(scenes[i], static_cast<double>(i) / static_cast<double>(scenes.size()),
                1.0 / static_cast<double>(scenes.size()), chart);
    }
    for (const std::string_view scene : scenes) {
      chart.panels.push_back({fmt::format("error against the reference, {}", scene),
                              {{"error_against_reference", ""}},
                              {},
                              {},
                              std::string(scene)});
      chart.panels.push_back({fmt::format("99th percentile of the error, {}", scene),
                              {{"error_p99", ""}},
                              {},
                              {},
                              std::string(scene)});
    }
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
    return {averaged(capture::to_float(result.rgba)), result.statistics, taken.count()};
  }

  // The same camera rays at any accuracy.
  static render::Effort effort_of(float accuracy, Cuts cuts, int max_depth) {
    render::Effort effort;
    effort.aa_samples = 1;
    effort.aa_tolerance = effort.glint_contrast = 0;
    effort.accuracy = accuracy;
    effort.dark_cuts = cuts == Cuts::nothing;
    effort.chance_cuts = cuts == Cuts::chance;
    effort.max_depth = max_depth;
    return effort;
  }

  Truth truth_of_scene(std::string_view name) const {
    const BenchScene shot = shot_of(name, width_, height_).shot;
    return truth_of(shot.plate, [&](std::uint32_t seed) {
      return render_reference(shot.inputs(), shot.job, shot.plate,
                              {.samples = quick_ ? 16 : 64, .seed = seed});
    });
  }

  void add_scene(std::string_view name, double from, double share, Chart& chart) const {
    const auto progress = [&](double done, std::string_view what) {
      console_.progress(from + share * done, fmt::format("{}: {}", name, what));
    };
    progress(0, "reference");
    const Truth truth = truth_of_scene(name);
    progress(0.3, "all rays");
    const BenchScene shot = shot_of(name, width_ * rays_across, height_ * rays_across).shot;
    const Shown whole = render(shot, effort_of(whole_tree, Cuts::environment, 64));
    const auto error_of = [&](const Shown& shown) {
      return render::picture_error(shown.picture, whole.picture, truth.mask);
    };
    const auto error_against_reference = [&](const Shown& shown) {
      return render::picture_error(shown.picture, truth.references, truth.mask).relative_rms;
    };
    const std::vector<float> accuracies =
        quick_ ? std::vector{0.8F, 0.95F} : std::vector{0.8F, 0.9F, 0.95F, 0.97F, 0.99F, 0.999F};
    for (const Cuts cuts : {Cuts::environment, Cuts::nothing, Cuts::chance}) {
      const auto method = static_cast<std::size_t>(cuts);
      for (const float accuracy : accuracies) {
        progress(0.5 + 0.15 * static_cast<double>(method), "accuracy");
        const Shown shown = render(shot, effort_of(accuracy, cuts, 64));
        const render::PictureError error = error_of(shown);
        ChartPoint point;
        point.scene = name;
        point.method = methods[method];
        point.settings = {{"accuracy", double{accuracy}},
                          {"dark_cuts", cuts == Cuts::nothing},
                          {"chance_cuts", cuts == Cuts::chance}};
        point.time_ms = shown.time_ms;
        point.error = error.relative_rms;
        point.error_p99 = error.p99;
        const double rays = width_ * height_ * rays_across * rays_across;
        point.figures = {
            {"error_against_reference", error_against_reference(shown)},
            {"secondary_rays", static_cast<double>(shown.statistics.secondary_rays) / rays},
            {"shadow_rays", static_cast<double>(shown.statistics.shadow_rays) / rays},
            {"depth_limit_hits", static_cast<double>(shown.statistics.depth_limit_hits)}};
        point.by_default = cuts == Cuts::environment && accuracy == render::Effort{}.accuracy;
        point.label = fmt::format("{:.3g} %", 100 * accuracy);
        chart.points.push_back(std::move(point));
      }
    }
    Stressor depth;
    depth.stressor = fmt::format("deepest ray, {}", name);
    for (const int limit : {1, 2, 4, 8, 16, 32, 64}) {
      progress(0.95, "depth");
      const Shown shown = render(shot, effort_of(0.99F, Cuts::environment, limit));
      depth.samples.push_back(
          {static_cast<double>(limit), error_of(shown).relative_rms, std::nullopt,
           shown.statistics.depth_limit_hits > 0 ? "some rays ended by the limit" : "ok"});
      depth.samples.back().figures = {{"error_against_reference", error_against_reference(shown)}};
    }
    // What is left of the error against the reference, whatever rays are followed: the grid of
    // camera rays, the table's lights, filters.
    depth.samples.back().figures.emplace_back("error_of_all_rays", error_against_reference(whole));
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
