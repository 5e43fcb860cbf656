// The chart of the light table.
#include "studio/charts/lights.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "studio/bench_scene.h"

namespace studio {
namespace {

using render::LightMethod;

struct Visibility {
  const char* name;
  bool adaptive;
  int interleave;
};
constexpr Visibility visibilities[] = {{"every pixel", false, 1},
                                       {"adaptive grid", true, 1},
                                       {"adaptive grid, 2x2", true, 2},
                                       {"interleaved 4x4", true, 4}};

double milliseconds_since(std::chrono::steady_clock::time_point start) {
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
        shot_(make_bench_scene(quick_ ? 160 : 640, quick_ ? 120 : 480)) {
    // The reference: every texel of the map may light every pixel.
    console_.progress(0, "reference");
    render::ReferenceSettings settings;
    settings.samples = quick_ ? 64 : 400;
    reference_ = render_reference(shot_.inputs(), shot_.job, shot_.plate, settings);
    mask_ = render::affected_mask(reference_, shot_.plate);
    for (std::uint32_t i = 0; i < 2; ++i) {
      BenchSky sky;
      sky.noise = 0.1F;
      sky.noise_seed = 100 + i;
      noisy_[i] = make_bench_sky(sky);
    }
  }

  Chart measure() {
    Chart chart;
    chart.stage = "lights";
    chart.title = "The light table: error against time";
    chart.subtitle =
        fmt::format("made car, {}x{}, {} triangles, table and frame together", shot_.plate.width,
                    shot_.plate.height, triangle_count(shot_.scene->description()));
    const std::vector<int> counts =
        quick_ ? std::vector{16, 64} : std::vector{4, 8, 16, 32, 64, 128, 256};
    double done = 0;
    const double all = static_cast<double>(counts.size() * std::size(visibilities) * 2);
    for (const LightMethod method : {LightMethod::split, LightMethod::median_cut}) {
      for (const Visibility& visibility : visibilities) {
        for (const int count : counts) {
          console_.progress(0.2 + 0.6 * done++ / all, "light tables");
          chart.points.push_back(point(method, visibility, count));
        }
      }
    }
    for (const int samples : quick_ ? std::vector{1, 4} : std::vector{1, 4, 16, 64}) {
      console_.progress(0.8, "importance sampling");
      chart.points.push_back(importance_point(samples));
    }
    chart.stressors.push_back(sun_size());
    chart.stressors.push_back(sun_strength());
    chart.stressors.push_back(light_count());
    return chart;
  }

 private:
  capture::Image render(const render::Environment& environment,
                        const render::LightTable& table,
                        render::Effort effort) {
    render::FrameJob job = shot_.job;
    job.effort = effort;
    job.lights = table;
    render::FrameInputs inputs = shot_.inputs();
    inputs.environment = &environment;
    render_frame(inputs, job, shot_.half_plate, result_);
    return capture::to_float(result_.rgba);
  }

  ChartPoint point(LightMethod method, const Visibility& visibility, int count) {
    render::Effort effort = shot_.job.effort;
    effort.aa_samples = 16;
    effort.light_samples = count;
    effort.adaptive_visibility = visibility.adaptive;
    effort.interleave = visibility.interleave;
    const render::LightTableSettings settings{count, method};
    ChartPoint p;
    p.method = fmt::format("{}, {}", method == LightMethod::split ? "split" : "median cut",
                           visibility.name);
    p.settings = {{"lights", static_cast<double>(count)},
                  {"table", std::string(method == LightMethod::split ? "split" : "median cut")},
                  {"adaptive_visibility", visibility.adaptive},
                  {"interleave", static_cast<double>(visibility.interleave)}};
    p.label = fmt::format("{}", count);
    capture::Image picture;
    p.time_ms = 1e30;
    for (int run = 0; run < (quick_ ? 1 : 3); ++run) {
      const auto start = std::chrono::steady_clock::now();
      const render::LightTable table = make_light_table(shot_.environment, settings);
      picture = render(shot_.environment, table, effort);
      p.time_ms = std::min(p.time_ms, milliseconds_since(start));
    }
    const render::PictureError error = render::picture_error(picture, reference_, mask_);
    p.error = error.relative_rms;
    p.error_p99 = error.p99;
    const capture::Image a =
        render(shot_.environment, make_light_table(noisy_[0], settings), effort);
    const capture::Image b =
        render(shot_.environment, make_light_table(noisy_[1], settings), effort);
    p.figures = {{"flicker", difference(a, b, mask_)}};
    return p;
  }

  ChartPoint importance_point(int samples) {
    ChartPoint p;
    p.method = "per-pixel importance sampling";
    p.settings = {{"samples", static_cast<double>(samples)}};
    p.label = fmt::format("{}", samples);
    render::ReferenceSettings settings;
    settings.samples = samples;
    settings.seed = 11;
    const auto start = std::chrono::steady_clock::now();
    const capture::Image a = render_reference(shot_.inputs(), shot_.job, shot_.plate, settings);
    p.time_ms = milliseconds_since(start);
    settings.seed = 12;
    const capture::Image b = render_reference(shot_.inputs(), shot_.job, shot_.plate, settings);
    const render::PictureError error = render::picture_error(a, reference_, mask_);
    p.error = error.relative_rms;
    p.error_p99 = error.p99;
    p.figures = {{"flicker", difference(a, b, mask_)}};
    return p;
  }

  // Error and the table's own estimate of it, for one sky and number of lights, in a small picture.
  StressorSample stressed(double value, const BenchSky& sky, int count) {
    BenchScene& small = small_shot();
    small.environment = make_bench_sky(sky);
    render::ReferenceSettings settings;
    settings.samples = quick_ ? 32 : 256;
    const capture::Image truth = render_reference(small.inputs(), small.job, small.plate, settings);
    render::FrameJob job = small.job;
    job.effort.aa_samples = 16;
    job.lights = make_light_table(small.environment, {count, LightMethod::split});
    render::FrameResult result;
    render_frame(small.inputs(), job, small.half_plate, result);
    const render::PictureError error = render::picture_error(
        capture::to_float(result.rgba), truth, render::affected_mask(truth, small.plate));
    return {value, error.relative_rms, job.lights.error_estimate, "ok"};
  }

  BenchScene& small_shot() {
    if (!small_.scene) small_ = make_bench_scene(160, 120);
    return small_;
  }

  Stressor sun_size() {
    Stressor stressor{"angular radius of the sun", "degrees", true, {}};
    for (const double degrees : {0.5, 1.0, 2.0, 5.0, 10.0, 20.0}) {
      BenchSky sky;
      sky.sun_radius_rad = static_cast<float>(degrees * std::numbers::pi / 180);
      stressor.samples.push_back(stressed(degrees, sky, 64));
    }
    return stressor;
  }

  Stressor sun_strength() {
    Stressor stressor{"strength of the sun, times a clear day's", "", true, {}};
    for (const double strength : {0.01, 0.1, 1.0, 10.0, 100.0, 1000.0}) {
      BenchSky sky;
      sky.sun_to_sky = static_cast<float>(strength);
      stressor.samples.push_back(stressed(strength, sky, 64));
    }
    return stressor;
  }

  Stressor light_count() {
    Stressor stressor{"lights in the table", "", true, {}};
    for (const int count : {1, 2, 4, 8, 16, 64, 256}) {
      stressor.samples.push_back(stressed(count, {}, count));
    }
    return stressor;
  }

  bool quick_;
  Console& console_;
  BenchScene shot_;
  BenchScene small_;
  capture::Image reference_, mask_;
  std::array<render::Environment, 2> noisy_;
  render::FrameResult result_;
};

}  // namespace

ChartStage lights_chart() {
  return {"lights", "the light table: method, number of lights, visibility",
          [](const ChartRequest& request, Console& console) {
            return LightsChart(request, console).measure();
          }};
}

}  // namespace studio
