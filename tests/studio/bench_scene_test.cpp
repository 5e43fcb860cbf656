// What benches and charts render.
#include "studio/bench_scene.h"

#include <gtest/gtest.h>

#include "render/renderer.h"

namespace studio::bench_scene_test {
namespace {

TEST(Drift, ChangesTheLightOfLightsAndOfLampsButNotWhatIsPlanned) {
  render::FrameJob job;
  job.lights.lights.resize(1);
  job.lights.lights[0].irradiance = {1, 2, 3};
  job.lights.lamps.resize(2);
  job.lights.lamps[0].intensity = {3, 2, 1};
  job.lights.lamps[1].intensity = job.lights.lamps[1].planned = {4, 4, 4};
  const render::FrameJob first = job;
  for (int frame = 0; frame < 2; ++frame) {
    const render::FrameJob before = job;
    drift(job);
    EXPECT_GT(job.lights.lights[0].irradiance.x, before.lights.lights[0].irradiance.x);
    EXPECT_EQ(job.lights.lights[0].planned, first.lights.lights[0].irradiance);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_GT(job.lights.lamps[i].intensity.x, before.lights.lamps[i].intensity.x);
      EXPECT_EQ(job.lights.lamps[i].planned, first.lights.lamps[i].intensity);
    }
  }
}

// A screen's video alone lights these: frames of it are what is timed as still.
TEST(Drift, MakesAStillFrameOfAScreenLightItsCellsAnew) {
  BenchScene shot = make_bench_scene(48, 32, BenchFinish::matte);
  shot.job.effort.aa_samples = 1;
  shot.job.lights.lights.clear();
  shot.job.lights.lamps = {
      {.position = {0, -3, 3}, .normal = {0, 0, 0}, .intensity = {100, 100, 100}}};
  render::KeptTransport kept;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = &kept;
  render::FrameResult before, after;
  render_frame(inputs, shot.job, shot.half_plate, before);
  for (int frame = 0; frame < 30; ++frame) drift(shot.job);
  render_frame(inputs, shot.job, shot.half_plate, after);
  EXPECT_GT(after.statistics.kept_rays, 0U);
  EXPECT_NE(after.rgba.pixels, before.rgba.pixels);
}

}  // namespace
}  // namespace studio::bench_scene_test
