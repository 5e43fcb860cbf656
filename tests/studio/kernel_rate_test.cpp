// What benches measure as plain.
#include "studio/commands/kernel_rate.h"

#include <gtest/gtest.h>

#include "render/light_table.h"

namespace studio::kernel_rate_test {
namespace {

TEST(PlainEffort, TakesOneCameraRayAPixelAndTestsEveryLight) {
  BenchScene shot = make_bench_scene(64, 48, BenchFinish::matte);
  shot.job.lights = make_light_table(shot.environment, {.count = 16});
  shot.job.effort = plain_effort(shot.job.effort);
  render::FrameResult plain, culled;
  render_frame(shot.inputs(), shot.job, shot.half_plate, plain);
  EXPECT_EQ(plain.statistics.primary_rays, 64U * 48U);
  shot.job.effort.cull_lights = true;
  render_frame(shot.inputs(), shot.job, shot.half_plate, culled);
  EXPECT_GT(plain.statistics.shadow_rays, culled.statistics.shadow_rays);
}

TEST(MeasureKept, CountsTheRaysOfAStillFrameOfWhichThereAreNoneIfAllCellsAreKept) {
  BenchScene shot = make_bench_scene(64, 48, BenchFinish::matte);
  shot.job.lights = make_light_table(shot.environment, {.count = 4});
  shot.job.effort.aa_samples = 4;
  shot.job.effort.aa_tolerance = 0;
  const KeptRate kept = measure_kept(shot, shot.job, 1);
  EXPECT_GT(kept.ms, 0);
  EXPECT_EQ(kept.rays, 0U);
}

}  // namespace
}  // namespace studio::kernel_rate_test
