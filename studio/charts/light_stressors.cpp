// Skies that are hard to sum up.
#include "studio/charts/light_stressors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "render/made_soft_boxes.h"

namespace studio {
namespace {

constexpr int most_charted_lights = 1024;

// Every pixel tests every light: the estimate is the table's, and knows no short cuts.
StressorSample sample(
    double value, MatteShot& shot, const Truth& truth, const render::Environment& sky, int count) {
  const BenchLight light = light_of(sky, {count, render::LightMethod::split});
  const render::PictureError error = error_of(shot.render(light, every_pixel), truth);
  return {value, error.relative_rms, light.table.error_estimate, "ok"};
}

// Lamps of 4 degrees all over the upper half of a dim hall, which shine as strongly whatever their
// number.
render::Environment hall_of_lamps(int lamps) {
  constexpr float side = 4 * std::numbers::pi_v<float> / 180;
  constexpr float all = 1000;  // radiance of a single one
  std::vector<render::SoftBox> boxes;
  for (int i = 0; i < lamps; ++i) {
    // Golden-angle spiral between 20 and 75 degrees of elevation.
    const double angle = 2.399963 * i;
    const double z = std::lerp(0.34, 0.97, (i + 0.5) / lamps);
    const double level = std::sqrt(1 - z * z);
    const float radiance = all / static_cast<float>(lamps);
    boxes.push_back({{static_cast<float>(level * std::cos(angle)),
                      static_cast<float>(level * std::sin(angle)), static_cast<float>(z)},
                     side,
                     side,
                     {radiance, radiance, radiance}});
  }
  const capture::Image map = render::make_soft_box_map(256, {0.2F, 0.2F, 0.2F}, {0.1F, 0.1F, 0.1F},
                                                       {0.05F, 0.05F, 0.05F}, boxes);
  render::Environment hall = render::environment_from_map(map, 0);
  render::smooth_for_reflections(hall);
  return hall;
}

// The smallest table that expects to err by no more than `bound`; the largest one charted if none
// does.
int lights_for(double bound, const render::Environment& sky) {
  for (int power = 1; power <= most_charted_lights; power *= 2) {
    for (const int count : {power, power + power / 2}) {
      const BenchLight light = light_of(sky, {count});
      if (double{light.table.error_estimate} <= bound) return count;
    }
  }
  return most_charted_lights;
}

}  // namespace

LightStressors::LightStressors(bool quick,
                               Console& console,
                               MatteShot& shot,
                               const render::Environment& sky,
                               const Truth& truth)
    : quick_(quick), console_(console), shot_(shot), sky_(sky), truth_(truth) {}

std::vector<Stressor> LightStressors::measure() {
  std::vector<Stressor> all;
  all.push_back(sun_size());
  all.push_back(sun_strength(false, default_lights));
  all.push_back(sun_strength(true, default_lights));
  all.push_back(sun_strength(true, 4));
  all.push_back(compact_sources());
  all.push_back(light_count());
  all.push_back(error_bound(all.back()));
  all.push_back(whole_picture());
  return all;
}

// Error and the table's own estimate of it, for one sky, in a smaller picture.
StressorSample LightStressors::stressed(double value, const render::Environment& sky, int count) {
  progress("skies that are hard to sum up", 0.75);
  if (!small_) small_ = std::make_unique<MatteShot>(quick_ ? 160 : 320, quick_ ? 120 : 240);
  return sample(value, *small_, small_->truth(sky, quick_ ? 256 : 2048), sky, count);
}

Stressor LightStressors::sun_size() {
  Stressor stressor{
      fmt::format("angular radius of the sun, {} lights", default_lights), "degrees", true, {}};
  for (const double degrees :
       quick_ ? std::vector{0.5, 5.0, 40.0} : std::vector{0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0}) {
    const auto radius = static_cast<float>(degrees * std::numbers::pi / 180);
    stressor.samples.push_back(
        stressed(degrees, make_bench_sky({.sun_radius_rad = radius}), default_lights));
  }
  return stressor;
}

// With the exposure locked, strong suns are cut off at the brightest that a display shows.
Stressor LightStressors::sun_strength(bool exposure_locked, int count) {
  Stressor stressor{fmt::format("strength of the sun, times a clear day's, {}; {} lights",
                                exposure_locked ? "exposure locked" : "exposed alike", count),
                    "",
                    true,
                    {}};
  for (const double strength :
       quick_ ? std::vector{0.01, 1.0, 1000.0} : std::vector{0.01, 0.1, 1.0, 10.0, 100.0, 1000.0}) {
    const BenchSky sky{.sun_to_sky = static_cast<float>(strength),
                       .exposure_locked = exposure_locked};
    stressor.samples.push_back(stressed(strength, make_bench_sky(sky), count));
  }
  return stressor;
}

Stressor LightStressors::compact_sources() {
  Stressor stressor{
      fmt::format("lamps of 4 degrees in a dim hall, {} lights", default_lights), "", true, {}};
  for (const int lamps : quick_ ? std::vector{1, 64} : std::vector{1, 2, 4, 8, 16, 32, 64, 128}) {
    stressor.samples.push_back(stressed(lamps, hall_of_lamps(lamps), default_lights));
  }
  return stressor;
}

Stressor LightStressors::light_count() {
  Stressor stressor{"lights in the table, light alone", "", true, {}};
  for (const int count : {1, 2, 4, 8, 16, 32, 64, 128, 256, 1024}) {
    stressor.samples.push_back(sample(count, shot_, truth_, sky_, count));
  }
  return stressor;
}

// How many lights a table takes if it goes by its own estimate, and what it then errs by; beside
// it, the smallest number in `by_count` that is enough.
Stressor LightStressors::error_bound(const Stressor& by_count) {
  Stressor stressor{
      "error bound that lights are chosen for; marks: their number, and how many do", "", true, {}};
  for (const double bound :
       quick_ ? std::vector{0.05, 0.2} : std::vector{0.02, 0.03, 0.05, 0.1, 0.2, 0.5}) {
    const int count = lights_for(bound, sky_);
    StressorSample chosen = sample(bound, shot_, truth_, sky_, count);
    if (!(*chosen.reported_error <= bound)) {
      chosen.status = fmt::format("no table up to {} lights expects this", most_charted_lights);
    }
    chosen.label = fmt::format("{}", count);
    chosen.figures = {{"lights", count}};
    const auto enough = std::ranges::find_if(
        by_count.samples, [&](const StressorSample& s) { return s.error <= bound; });
    if (enough != by_count.samples.end()) {
      chosen.figures.emplace_back("lights_needed", enough->value);
      chosen.label += fmt::format(" ({})", enough->value);
    }
    stressor.samples.push_back(std::move(chosen));
  }
  return stressor;
}

// The car as a show shows it, at default effort: edges and mirrors err as well, which is the
// floor.
Stressor LightStressors::whole_picture() {
  progress("whole pictures", 0.85);
  const BenchScene shot = make_bench_scene(quick_ ? 160 : 640, quick_ ? 120 : 480);
  const Truth truth = truth_of(shot.plate, [&](std::uint32_t seed) {
    render::ReferenceSettings settings;
    settings.samples = quick_ ? 16 : 64;
    settings.seed = seed;
    return render_reference(shot.inputs(), shot.job, shot.plate, settings);
  });
  const auto error = [&](int count, const Visibility& visibility, float& estimate) {
    const BenchLight light = light_of(sky_, {count, render::LightMethod::split});
    render::FrameJob job = shot.job;
    job.effort = {};
    job.effort.light_samples = count;
    visibility.set_in(job.effort);
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

}  // namespace studio
