// The chart of the light table.
#include "studio/charts/lights.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>

#include "render/sampled_light.h"
#include "studio/bench_scene.h"
#include "studio/picture_error.h"

namespace studio {
namespace {

using render::LightMethod;
using render::LightTableSettings;

struct Visibility {
  const char* name;
  bool adaptive;
  int interleave;
};
constexpr Visibility every_pixel{"every pixel", false, 1};
constexpr Visibility adaptive_grid{"adaptive grid", true, 1};
constexpr Visibility visibilities[] = {
    every_pixel, adaptive_grid, {"interleaved 2x2", true, 2}, {"interleaved 4x4", true, 4}};

// What a show does if it is told nothing else.
constexpr int default_lights = render::Effort{}.light_samples;

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

BenchLight light_of(const render::Environment& sky, const LightTableSettings& settings) {
  render::LightFollower follower;
  return follow_bench_sky(follower, sky, settings);
}

// A shot of the matte car through the centres of its pixels. Nothing but the light errs there: no
// edges, no mirrors.
class MatteShot {
 public:
  MatteShot(int width, int height) : shot_(make_bench_scene(width, height, BenchFinish::matte)) {
    shot_.job.effort.aa_samples = 1;
  }

  const BenchScene& scene() const { return shot_; }

  capture::Image render(const BenchLight& light, const Visibility& visibility) {
    render::FrameJob job = shot_.job;
    job.effort.light_samples = static_cast<int>(light.table.lights.size());
    job.effort.adaptive_visibility = visibility.adaptive;
    job.effort.interleave = visibility.interleave;
    job.lights = light.table;
    render_frame(inputs(light.environment), job, shot_.half_plate, result_);
    return capture::to_float(result_.rgba);
  }

  capture::Image render_sampled(const render::Environment& sky, int samples, std::uint32_t seed) {
    return render_sampled_light(inputs(sky), shot_.job, shot_.plate, {samples, seed});
  }

  // Every texel of the map may light every pixel.
  Truth truth(const render::Environment& sky, int samples) {
    return truth_of(shot_.plate,
                    [&](std::uint32_t seed) { return render_sampled(sky, samples / 2, seed); });
  }

 private:
  render::FrameInputs inputs(const render::Environment& environment) const {
    render::FrameInputs inputs = shot_.inputs();
    inputs.environment = &environment;
    return inputs;
  }

  BenchScene shot_;
  render::FrameResult result_;
};

render::PictureError error_of(const capture::Image& picture, const Truth& truth) {
  return render::picture_error(picture, truth.references, truth.mask);
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
        "Made car in matte grey, {}x{}, {} triangles, one sample a pixel. Each line: 4 lights "
        "(left) "
        "to 256.",
        scene.plate.width, scene.plate.height, triangle_count(scene.scene->description()));
    chart.time_name = "time of table and frame, ms";
    chart.error_name = "relative RMS error against the whole sky";
    chart.variant_name = "shadow rays";
    add_tables();
    add_sampled();
    time_points();
    for (Candidate& candidate : candidates_) chart.points.push_back(std::move(candidate.point));
    chart.panels.push_back({"99th percentile of the error", {{"error_p99", ""}}});
    chart.panels.push_back({"flicker from frame to frame",
                            {{"flicker", "table made anew for every frame"},
                             {"flicker_followed", "light followed, as in a show"}}});
    chart.stressors.push_back(sun_size());
    chart.stressors.push_back(sun_strength(false, default_lights));
    chart.stressors.push_back(sun_strength(true, default_lights));
    chart.stressors.push_back(sun_strength(true, 4));
    chart.stressors.push_back(light_count());
    chart.stressors.push_back(whole_picture());
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
                  {"interleave", static_cast<double>(visibility.interleave)}};
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

  // Error and the table's own estimate of it, for one sky, in a smaller picture.
  StressorSample stressed(double value, const BenchSky& wanted, int count = default_lights) {
    progress("skies that are hard to sum up", 0.75);
    if (!small_) small_ = std::make_unique<MatteShot>(quick_ ? 160 : 320, quick_ ? 120 : 240);
    const render::Environment sky = make_bench_sky(wanted);
    return sample(value, *small_, small_->truth(sky, quick_ ? 256 : 2048), sky, count);
  }

  // Every pixel tests every light: the estimate is the table's, and knows no short cuts.
  static StressorSample sample(double value,
                               MatteShot& shot,
                               const Truth& truth,
                               const render::Environment& sky,
                               int count) {
    const BenchLight light = light_of(sky, {count, LightMethod::split});
    const render::PictureError error = error_of(shot.render(light, every_pixel), truth);
    return {value, error.relative_rms, light.table.error_estimate, "ok"};
  }

  Stressor sun_size() {
    Stressor stressor{
        fmt::format("angular radius of the sun, {} lights", default_lights), "degrees", true, {}};
    for (const double degrees :
         quick_ ? std::vector{0.5, 5.0, 40.0} : std::vector{0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0}) {
      stressor.samples.push_back(stressed(
          degrees, {.sun_radius_rad = static_cast<float>(degrees * std::numbers::pi / 180)}));
    }
    return stressor;
  }

  // With the exposure locked, strong suns are cut off at the brightest that a display shows.
  Stressor sun_strength(bool exposure_locked, int count) {
    Stressor stressor{fmt::format("strength of the sun, times a clear day's, {}; {} lights",
                                  exposure_locked ? "exposure locked" : "exposed alike", count),
                      "",
                      true,
                      {}};
    for (const double strength : quick_ ? std::vector{0.01, 1.0, 1000.0}
                                        : std::vector{0.01, 0.1, 1.0, 10.0, 100.0, 1000.0}) {
      stressor.samples.push_back(stressed(
          strength,
          {.sun_to_sky = static_cast<float>(strength), .exposure_locked = exposure_locked}, count));
    }
    return stressor;
  }

  Stressor light_count() {
    Stressor stressor{"lights in the table, light alone", "", true, {}};
    for (const int count : {1, 2, 4, 8, 16, 32, 64, 128, 256, 1024}) {
      stressor.samples.push_back(sample(count, shot_, truth_, sky_, count));
    }
    return stressor;
  }

  // The car as a show shows it, at default effort: edges and mirrors err as well, which is the
  // floor.
  Stressor whole_picture() {
    progress("whole pictures", 0.85);
    const BenchScene shot = make_bench_scene(quick_ ? 160 : 640, quick_ ? 120 : 480);
    const Truth truth = truth_of(shot.plate, [&](std::uint32_t seed) {
      render::ReferenceSettings settings;
      settings.samples = quick_ ? 16 : 64;
      settings.seed = seed;
      return render_reference(shot.inputs(), shot.job, shot.plate, settings);
    });
    const auto error = [&](int count, const Visibility& visibility, float& estimate) {
      const BenchLight light = light_of(sky_, {count, LightMethod::split});
      render::FrameJob job = shot.job;
      job.effort = {};
      job.effort.light_samples = count;
      job.effort.adaptive_visibility = visibility.adaptive;
      job.lights = light.table;
      render::FrameInputs inputs = shot.inputs();
      inputs.environment = &light.environment;
      render::FrameResult result;
      render_frame(inputs, job, shot.half_plate, result);
      estimate = light.table.error_estimate;
      return error_of(capture::to_float(result.rgba), truth).relative_rms;
    };
    Stressor stressor{"lights in the table, whole picture with edges and mirrors", "", true, {}};
    float estimate = 0;
    for (const int count : quick_ ? std::vector{4, 64} : std::vector{4, 8, 16, 32, 64, 128, 256}) {
      const double relative_rms = error(count, adaptive_grid, estimate);
      stressor.samples.push_back({static_cast<double>(count), relative_rms, estimate, "ok"});
    }
    const int floor_lights = quick_ ? 128 : 1024;  // which leave hardly any error to the light
    stressor.floor = error(floor_lights, every_pixel, estimate);
    stressor.floor_name =
        fmt::format("floor: edges and mirrors ({} lights, every pixel)", floor_lights);
    return stressor;
  }

  bool quick_;
  Console& console_;
  MatteShot shot_;
  std::unique_ptr<MatteShot> small_;
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
