// The matte car.
#include "studio/charts/matte_shot.h"

#include <algorithm>

#include "render/sampled_light.h"
#include "render/standard.h"
#include "studio/least_time.h"

namespace studio {

BenchLight light_of(const render::Environment& sky, const render::LightTableSettings& settings) {
  render::LightFollower follower;
  return follow_bench_sky(follower, sky, settings);
}

render::PictureError error_of(const capture::Image& picture, const Truth& truth) {
  return render::picture_error(picture, truth.references, truth.mask);
}

ChartPoint measured_point(BenchScene& shot, const Truth& truth, int runs) {
  render::FrameInputs inputs = shot.inputs();
  render::FrameResult result;
  const auto frame = [&] { render_frame(inputs, shot.job, shot.half_plate, result); };
  ChartPoint point;
  point.time_ms = least_time_ms(frame, runs);
  const render::PictureError error = error_of(capture::to_float(result.rgba), truth);
  point.error = error.relative_rms;
  point.error_p99 = error.p99;
  render::KeptTransport kept;
  inputs.kept = &kept;
  frame();
  // Light that lives: cells are lit anew, not shown again.
  const auto live = [&] {
    for (auto& light : shot.job.lights.lights) light.irradiance *= 1.0001F;
    frame();
  };
  point.figures = {{"still_ms", least_time_ms(live, runs)}};
  return point;
}

render::Material make_grey_material(const std::string& name) {
  render::StandardParameters parameters;
  std::fill_n(parameters.base_color, 3, grey_albedo);
  parameters.roughness = 1;
  parameters.specular = 0;
  return render::make_standard_material(name, parameters);
}

MatteShot::MatteShot(int width, int height)
    : shot_(make_bench_scene(width, height, BenchFinish::matte)) {
  shot_.job.effort.aa_samples = 1;
}

capture::Image MatteShot::render(const BenchLight& light, const Visibility& visibility) {
  render::FrameJob job = shot_.job;
  job.effort.light_samples = static_cast<int>(light.table.lights.size());
  visibility.set_in(job.effort);
  job.lights = light.table;
  render_frame(inputs(light.environment), job, shot_.half_plate, result_);
  return capture::to_float(result_.rgba);
}

capture::Image MatteShot::render_sampled(const render::Environment& sky,
                                         int samples,
                                         std::uint32_t seed) {
  return render_sampled_light(inputs(sky), shot_.job, shot_.plate, {samples, seed});
}

Truth MatteShot::truth(const render::Environment& sky, int samples) {
  return truth_of(shot_.plate,
                  [&](std::uint32_t seed) { return render_sampled(sky, samples / 2, seed); });
}

render::FrameInputs MatteShot::inputs(const render::Environment& environment) const {
  render::FrameInputs inputs = shot_.inputs();
  inputs.environment = &environment;
  return inputs;
}

}  // namespace studio
