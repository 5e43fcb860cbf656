// The chart of the light table.
#include "studio/charts/lights.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "studio/charts/bounce_lamps.h"
#include "studio/charts/caustics.h"
#include "studio/charts/light_stressors.h"
#include "studio/charts/matte_shot.h"
#include "studio/charts/screen_lamps.h"

namespace studio {
namespace {

using render::LightMethod;
using render::LightTableSettings;

constexpr std::string_view under_the_sky = "matte car, against the whole sky";

constexpr float noise = 0.1F;        // of the probe, per texel, where flicker is measured
constexpr int followed_frames = 14;  // after which an average over 12 has settled

std::string name_of(LightMethod method) {
  return method == LightMethod::split ? "split" : "median cut";
}

double time_ms(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

// Root mean square difference of two pictures over that of the first, where mask is set.
double difference(const capture::Image& a, const capture::Image& b, const capture::Image& mask) {
  double sum = 0, norm = 0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      if (mask.at(y, x) == 0) continue;
      for (int c = 0; c < 3; ++c) {
        const double d = a.at(y, x, c) - b.at(y, x, c);
        sum += d * d;
        norm += static_cast<double>(a.at(y, x, c)) * a.at(y, x, c);
      }
    }
  }
  return norm > 0 ? std::sqrt(sum / norm) : 0;
}

class LightsChart {
 public:
  LightsChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        console_(console),
        shot_(quick_ ? 160 : 640, quick_ ? 120 : 480),
        sky_(make_bench_sky({})) {
    progress("the reference", 0);
    truth_ = shot_.truth(sky_, quick_ ? 512 : 8192);
    for (std::uint32_t i = 0; i < followed_frames; ++i) {
      noisy_.push_back(make_bench_sky({.noise = noise, .noise_seed = 100 + i}));
    }
  }

  Chart measure() {
    Chart chart;
    chart.stage = "lights";
    chart.title = "The light table: error against time";
    const BenchScene& scene = shot_.scene();
    chart.subtitle = fmt::format(
        "Made car in matte grey, {}x{}, {} triangles, one sample a pixel; each line: 4 lights "
        "(left) to 256. Screens of 1x1 to 9x9 lamps.",
        scene.plate.width, scene.plate.height, triangle_count(scene.scene->description()));
    chart.time_name = "time of table and frame, ms";
    chart.error_name = "relative RMS error";
    chart.variant_name = "shadow rays";
    add_tables();
    add_sampled();
    time_points();
    for (Candidate& candidate : candidates_) {
      candidate.point.scene = under_the_sky;
      chart.points.push_back(std::move(candidate.point));
    }
    chart.panels.push_back(
        {"99th percentile of the error", {{"error_p99", ""}}, {}, {}, std::string(under_the_sky)});
    chart.panels.push_back({"flicker from frame to frame",
                            {{"flicker", "table made anew for every frame"},
                             {"flicker_followed", "light followed, as in a show"}},
                            {},
                            {},
                            std::string(under_the_sky)});
    chart.stressors = LightStressors(quick_, console_, shot_, sky_, truth_).measure();
    progress("lamps on a screen", 0.9);
    add_screen_lamps(quick_, chart);
    progress("light between surfaces", 0.95);
    add_bounce_lamps(quick_, chart);
    progress("light through glass", 0.97);
    add_caustics(quick_, chart);
    return chart;
  }

 private:
  // `share` of the time that a full run takes.
  void progress(std::string_view what, double share) { console_.progress(share, what); }

  // A point and its whole work, which takes time_ms.
  struct Candidate {
    ChartPoint point;
    std::function<capture::Image()> work;
  };

  void add_tables() {
    const std::vector<int> counts =
        quick_ ? std::vector{16, 64} : std::vector{4, 8, 16, 32, 64, 128, 256};
    double done = 0;
    const double all = static_cast<double>(2 * std::size(visibilities) * counts.size());
    for (const LightMethod method : {LightMethod::split, LightMethod::median_cut}) {
      for (const Visibility& visibility : visibilities) {
        for (const int count : counts) {
          progress(fmt::format("{}, {}, {} lights", name_of(method), visibility.name, count),
                   0.15 + 0.2 * done++ / all);
          add_table({count, method}, visibility);
        }
      }
    }
  }

  void add_table(const LightTableSettings& settings, const Visibility& visibility) {
    const BenchLight light = light_of(sky_, settings);
    ChartPoint p;
    p.method = name_of(settings.method);
    p.variant = visibility.name;
    p.settings = {{"lights", static_cast<double>(settings.count)},
                  {"visibility", std::string(visibility.name)},
                  {"adaptive_visibility", visibility.adaptive},
                  {"interleave", static_cast<double>(visibility.interleave)},
                  {"soft_lights", visibility.soft}};
    p.by_default =
        settings == LightTableSettings{default_lights} && p.variant == adaptive_grid.name;
    p.label = fmt::format("{}{}", settings.count, p.by_default ? ": default" : "");
    const capture::Image a = shot_.render(light_of(noisy_[0], settings), visibility);
    const capture::Image b = shot_.render(light_of(noisy_[1], settings), visibility);
    p.figures = {{"flicker", difference(a, b, truth_.mask)},
                 {"flicker_followed", followed_flicker(settings, visibility)},
                 {"reported_error", light.table.error_estimate}};
    candidates_.push_back({std::move(p), [this, light, settings, visibility] {
                             render::LightFollower().follow(sky_, {.table = settings});
                             return shot_.render(light, visibility);
                           }});
  }

  void add_sampled() {
    for (const int samples : quick_ ? std::vector{4, 16} : std::vector{4, 16, 64, 256, 1024}) {
      progress("per-pixel importance sampling", 0.35);
      ChartPoint p;
      p.method = "per-pixel importance sampling";
      p.peer = true;
      p.settings = {{"samples", static_cast<double>(samples)}};
      p.label = fmt::format("{}", samples);
      const capture::Image a = shot_.render_sampled(noisy_[0], samples, 12);
      const capture::Image b = shot_.render_sampled(noisy_[1], samples, 13);
      p.figures = {{"flicker", difference(a, b, truth_.mask)}};
      candidates_.push_back(
          {std::move(p), [this, samples] { return shot_.render_sampled(sky_, samples, 11); }});
    }
  }

  // In rounds, so that what else the machine does for a while slows no point alone.
  void time_points() {
    const int rounds = quick_ ? 1 : 3;
    for (int round = 0; round < rounds; ++round) {
      for (Candidate& candidate : candidates_) {
        progress(candidate.point.method, 0.4 + 0.3 * round / rounds);
        capture::Image picture;
        const double taken_ms = time_ms([&] { picture = candidate.work(); });
        ChartPoint& p = candidate.point;
        p.time_ms = round == 0 ? taken_ms : std::min(p.time_ms, taken_ms);
        if (round > 0) continue;
        const render::PictureError error = error_of(picture, truth_);
        p.error = error.relative_rms;
        p.error_p99 = error.p99;
      }
    }
  }

  // From the last frame but one to the last, when the light has been followed for a while.
  double followed_flicker(const LightTableSettings& settings, const Visibility& visibility) {
    render::LightFollower follower;
    for (std::size_t i = 0; i + 2 < noisy_.size(); ++i) {
      follower.follow(noisy_[i], {.table = settings});
    }
    const auto next = [&](const render::Environment& sky) {
      return shot_.render(follow_bench_sky(follower, sky, settings), visibility);
    };
    const capture::Image a = next(noisy_[noisy_.size() - 2]);
    const capture::Image b = next(noisy_.back());
    return difference(a, b, truth_.mask);
  }

  bool quick_;
  Console& console_;
  MatteShot shot_;
  render::Environment sky_;
  Truth truth_;
  std::vector<render::Environment> noisy_;
  std::vector<Candidate> candidates_;
};

}  // namespace

ChartStage lights_chart() {
  return {"lights", "the light table: method, number of lights, visibility",
          [](const ChartRequest& request, Console& console) {
            return LightsChart(request, console).measure();
          }};
}

}  // namespace studio
