// Laws of the counts of rays by pixel: they cost no bit, and add up to what the kernel traced.
#include "render/ray_counts.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "made_shot.h"
#include "render/glass.h"
#include "render/kept_transport.h"

namespace compositing::ray_counts_test {
namespace {

using render::FrameResult;
using render::RayCount;

// All kinds of rays: edges and glints, mirrors, glass, a real ball that shades, a lamp.
MadeShot busy_shot(int width = 120, int height = 80) {
  render::SceneDescription scene = shot_scene();
  render::Instance real = scene.instances[1];
  real.kind = render::ObjectKind::stand_in;
  real.set_from_object[3] = -1.2F;
  scene.meshes.push_back(made_ball({0, 0, 0.5F}, 0.5F, 0));
  real.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.push_back(real);
  MadeShot shot = made_shot(width, height, std::move(scene), 48);
  shot.job.lights.lamps.push_back({{0.4F, -1.5F, 1.5F}, {}, {2, 2, 2}});
  return shot;
}

FrameResult render(const MadeShot& shot, bool count_rays, render::KeptTransport* kept = nullptr) {
  render::FrameInputs inputs = shot.inputs();
  inputs.count_rays = count_rays;
  inputs.kept = kept;
  FrameResult result;
  render_frame(inputs, shot.job, shot.plate, result);
  return result;
}

template <class Value>
std::uint64_t sum_of(const FrameResult& result, Value RayCount::*value) {
  std::uint64_t sum = 0;
  for (const RayCount& pixel : result.rays.pixels) sum += pixel.*value;
  return sum;
}

TEST(CountRays, ChangesNoBitOfThePicture) {
  const MadeShot shot = busy_shot();
  const FrameResult without = render(shot, false), with = render(shot, true);
  EXPECT_EQ(with.rgba.pixels, without.rgba.pixels);
  EXPECT_EQ(with.matte.pixels, without.matte.pixels);
  EXPECT_EQ(with.statistics, without.statistics);
  EXPECT_TRUE(without.rays.pixels.empty());
  EXPECT_EQ(with.rays.pixels.size(), 120U * 80U);
}

TEST(CountRays, AddsUpToAllThatWasTraced) {
  for (const int interleave : {1, 2, 4}) {
    for (const int aa_samples : {1, 16}) {
      MadeShot shot = busy_shot();
      shot.job.effort.interleave = interleave;
      shot.job.effort.aa_samples = aa_samples;
      const FrameResult result = render(shot, true);
      const render::RenderStatistics& s = result.statistics;
      EXPECT_EQ(sum_of(result, &RayCount::rays), s.primary_rays + s.secondary_rays);
      EXPECT_EQ(sum_of(result, &RayCount::shadow_rays), s.shadow_rays);
      EXPECT_GT(s.shadow_rays, 10000U);
      EXPECT_GT(s.secondary_rays, 1000U);
    }
  }
}

TEST(CountRays, DoesNotDependOnTilesOrThreads) {
  MadeShot shot = busy_shot(150, 110);
  shot.job.effort.tile_size = 64;
  const FrameResult first = render(shot, true);
  for (const int tile : {16, 48, 160}) {
    shot.job.effort.tile_size = tile;
    for (const std::size_t threads : {1U, 2U}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      EXPECT_EQ(render(shot, true).rays.pixels, first.rays.pixels) << tile << " " << threads;
    }
  }
}

TEST(CountRays, TellsTheSameOfWhatIsKept) {
  const MadeShot shot = busy_shot();
  const FrameResult cold = render(shot, true);
  render::KeptTransport kept;
  render(shot, false, &kept);
  for (int frame = 0; frame < 4; ++frame) {
    const bool asks = frame != 2;
    const FrameResult warm = render(shot, asks, &kept);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.rays.pixels.empty(), !asks) << frame;
    if (asks) {
      EXPECT_EQ(warm.rays.pixels, cold.rays.pixels) << frame;
    }
    // The first that asks finds its cells anew; after it nothing is lost by asking or not.
    EXPECT_EQ(warm.statistics.primary_rays > 0, frame == 0) << frame;
  }
}

TEST(CountRays, IsOneRayWhereThereIsOnlyThePlate) {
  MadeShot shot = made_shot(64, 48, shot_scene(false));
  shot.job.cam_from_set = calibrate::look_at({3, -3, 1.5}, {1, 0, -1}, 0);  // below the horizon
  for (const RayCount& pixel : render(shot, true).rays.pixels) {
    ASSERT_EQ(pixel, (RayCount{.rays = 1, .shadow_rays = 0, .depth = 0, .error = 0}));
  }
}

TEST(CountRays, CountsNoneWhereTheLensSeesNothing) {
  MadeShot shot = busy_shot(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 10; ++x) {
      const std::size_t at = shot.directions.index(y, x);
      shot.directions.x[at] = shot.directions.y[at] = shot.directions.z[at] = 0;
    }
  }
  const FrameResult result = render(shot, true);
  for (int y = 0; y < 48; ++y) {
    const auto row = static_cast<std::size_t>(y) * 64;
    ASSERT_EQ(result.rays.pixels[row + 5].rays, 0U);
    ASSERT_GE(result.rays.pixels[row + 20].rays, 1U);
  }
}

TEST(CountRays, IsAsDeepAsTheEffortAllows) {
  for (const int max_depth : {0, 1, 3}) {
    MadeShot shot = busy_shot();
    shot.job.effort.max_depth = max_depth;
    const FrameResult result = render(shot, true);
    std::uint32_t deepest = 0;
    for (const RayCount& pixel : result.rays.pixels) deepest = std::max(deepest, pixel.depth);
    EXPECT_EQ(deepest, static_cast<std::uint32_t>(max_depth));
  }
}

TEST(CountRays, EstimatesAnErrorWhereFurtherSamplesAreAndLessTheMoreThereAre) {
  MadeShot shot = busy_shot(48, 32);
  shot.job.effort.aa_tolerance = 0;
  shot.job.effort.accuracy = 1;  // below, samples of more test fewer lights each
  const auto mean_error = [&](int samples) {
    shot.job.effort.aa_samples = samples;
    const FrameResult result = render(shot, true);
    double sum = 0;
    for (const RayCount& pixel : result.rays.pixels) {
      EXPECT_GE(pixel.error, 0);
      if (pixel.error > 0) {
        EXPECT_GE(pixel.rays, static_cast<std::uint32_t>(samples));
      }
      sum += pixel.error;
    }
    return sum;
  };
  EXPECT_EQ(mean_error(1), 0);
  // Samples that are spread well: between those by chance (.5) and those on a line (.25).
  const double of4 = mean_error(4), of16 = mean_error(16), of64 = mean_error(64);
  EXPECT_GT(of4, 0);
  EXPECT_NEAR(of16 / of4, 0.375, 0.125);
  EXPECT_NEAR(of64 / of16, 0.375, 0.125);
}

}  // namespace
}  // namespace compositing::ray_counts_test
