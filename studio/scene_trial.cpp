// Frames that are timed and compared.
#include "studio/scene_trial.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace studio {
namespace {

// Frames that take longer are rendered fewer times: what is gained by more is less there.
constexpr double slow_ms = 600, very_slow_ms = 2500;

double time_ms(const render::FrameInputs& inputs,
               const render::FrameJob& job,
               const capture::HalfImage& plate,
               render::FrameResult& result) {
  const auto start = std::chrono::steady_clock::now();
  render_frame(inputs, job, plate, result);
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
  return taken.count();
}

}  // namespace

SceneTrial::SceneTrial(PaperShot shot, int paths) : shot_(std::move(shot)) {
  const BenchScene& scene = shot_.shot;
  truth_ = truth_of(scene.plate, [&](std::uint32_t seed) {
    return render_reference(scene.inputs(), scene.job, scene.plate,
                            {.samples = std::max(1, paths / 2), .seed = seed});
  });
  covered_ = capture::make_image(scene.plate.height, scene.plate.width, 1);
  for (int y = 0; y < covered_.height; ++y) {
    for (int x = 0; x < covered_.width; ++x) {
      covered_.at(y, x) = truth_.references[0].at(y, x, 3) > 0 ? 1.0F : 0.0F;
    }
  }
}

const BenchLight& SceneTrial::light_of(int count) const {
  const auto known = lights_.find(count);
  if (known != lights_.end()) return known->second;
  render::LightFollower follower;
  BenchLight light = follow_bench_sky(follower, shot_.shot.environment, {.count = count});
  light.table.lamps = shot_.shot.job.lights.lamps;
  return lights_.emplace(count, std::move(light)).first->second;
}

TriedEffort SceneTrial::measure(const render::Effort& effort, int runs) const {
  const BenchScene& scene = shot_.shot;
  const BenchLight& light = light_of(effort.light_samples);
  render::FrameJob job = scene.job;
  job.effort = effort;
  job.lights = light.table;
  render::FrameInputs inputs = scene.inputs();
  inputs.environment = &light.environment;
  render::FrameResult result;
  TriedEffort tried;
  tried.table_error = light.table.error_estimate;
  tried.moving_ms = time_ms(inputs, job, scene.half_plate, result);
  tried.picture = capture::to_float(result.rgba);
  tried.statistics = result.statistics;
  tried.error = render::picture_error(tried.picture, truth_.references, truth_.mask);
  tried.groups = render::group_errors(tried.picture, truth_.references, covered_);
  if (runs == 0) return tried;
  const auto faster = [&](double& best_ms, const render::FrameInputs& of) {
    best_ms = std::min(best_ms, time_ms(of, job, scene.half_plate, result));
  };
  const double first_ms = tried.moving_ms;
  const int again = first_ms > very_slow_ms ? 0 : first_ms > slow_ms ? 1 : runs - 1;
  for (int i = 0; i < again; ++i) faster(tried.moving_ms, inputs);

  render::KeptTransport kept;
  inputs.kept = &kept;
  render_frame(inputs, job, scene.half_plate, result);
  const auto still = [&] {
    drift(job);
    return time_ms(inputs, job, scene.half_plate, result);
  };
  tried.still_ms = still();
  const int still_again = tried.still_ms > slow_ms ? 0 : 2 * runs;
  for (int i = 0; i < still_again; ++i) tried.still_ms = std::min(tried.still_ms, still());
  tried.still_statistics = result.statistics;
  tried.kept_mb = static_cast<double>(kept.bytes()) / (1 << 20);
  return tried;
}

}  // namespace studio
