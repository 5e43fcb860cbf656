// What is kept from frame to frame where things are flat, tiny, nowhere or no number, and where
// finding a cell was given up.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "made_room.h"
#include "render/cell_reach.h"
#include "render/photons.h"
#include "render/renderer.h"

namespace compositing::reuse_limits_test {
namespace {

using capture::Half;
using render::FrameResult;

// A mirroring ball on a real floor that shows in it.
struct MirrorShot {
  MadeShot shot;
  calibrate::Lens lens{"pinhole", 160, 120, {176, 176, 79.5, 59.5}};

  explicit MirrorShot(float roughness) {
    register_shaders();
    render::SceneDescription scene = shot_scene();
    scene.instances[0].mirrored = true;
    render::StandardParameters metal;
    metal.metallic = 1;
    metal.roughness = roughness;
    scene.materials[1] = render::make_standard_material("metal", metal);
    shot = made_shot(160, 120, scene);
  }
  FrameResult show(const capture::HalfImage& plate, render::KeptTransport* kept = nullptr) const {
    render::FrameInputs inputs = shot.inputs();
    inputs.lens = &lens;
    inputs.kept = kept;
    FrameResult result;
    render_frame(inputs, shot.job, plate, result);
    return result;
  }
};

// Wherever finding a cell is given up, the next frame has the bits that it has alone.
TEST(ReuseAtTheEdge, ForgetsCellsThatWereGivenUp) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  MadeRoom room(96, 80);
  room.job.effort.aa_samples = 4;
  const FrameResult alone = render_room(room);
  render::KeptTransport kept;
  render::FrameInputs inputs = room.inputs();
  inputs.kept = &kept;
  room.job.stages.assign(6 * 5, render::one_ray_stage);
  render_room(room, &kept);
  int given_up = 0;
  for (int i = 0; i < 240; ++i) {
    render::FrameJob job = room.job;
    const auto frame = render::prepare_frame(inputs, job, room.plate);
    std::vector<render::Refinement> plan{
        {static_cast<std::size_t>(6 + i % 24), render::finished_stage}};
    render::RenderStatistics statistics;
    render::refine_cells(*frame, plan, std::chrono::steady_clock::now() + std::chrono::seconds(1),
                         std::chrono::microseconds(100 + 41 * i), job, statistics);
    if (!plan[0].given_up) continue;
    ++given_up;
    job.stages.clear();
    FrameResult cold;
    render_frame(room.inputs(), job, room.plate, cold);
    ASSERT_EQ(cold.rgba.pixels, alone.rgba.pixels) << i;
  }
  EXPECT_GT(given_up, 5);
}

// A pixel of the plate that is no number, or endless, is its own alone, also in mirrors.
TEST(ReuseAtTheEdge, ShowsABrokenPixelOfThePlateInNoOther) {
  for (const float roughness : {0.0F, 0.7F}) {
    const MirrorShot mirror(roughness);
    const FrameResult whole = mirror.show(mirror.shot.plate);
    for (const Half broken : {Half{0x7E00}, Half{0x7C00}, Half{0xFC00}}) {
      capture::HalfImage plate = mirror.shot.plate;
      const std::size_t at = plate.index(100, 80);
      std::fill_n(&plate.pixels[at], 3, broken);
      const FrameResult shown = mirror.show(plate);
      int far = 0;
      for (std::size_t i = 0; i < whole.rgba.pixels.size(); ++i) {
        const float a = capture::float_from_half(whole.rgba.pixels[i]);
        const float b = capture::float_from_half(shown.rgba.pixels[i]);
        far += i / 4 != at / 3 && !(std::abs(a - b) < 0.1F);
      }
      EXPECT_LE(far, 3 * 4) << roughness << " " << broken;
    }
  }
}

// The light changes and comes back, and meanwhile the plate has, where a glance does not see it.
TEST(ReuseAtTheEdge, ShowsThePlateOfTheFrameAfterLightCameBack) {
  MirrorShot mirror(0);
  const render::LightTable bright = mirror.shot.job.lights;
  render::LightTable dim = bright;
  for (auto& light : dim.lights) light.irradiance *= 0.5F;
  for (render::LightTable* table : {&dim, &mirror.shot.job.lights}) {
    for (std::size_t i = 0; i < bright.lights.size(); ++i)
      table->lights[i].planned = bright.lights[i].irradiance;
  }
  const render::LightTable planned = mirror.shot.job.lights;
  const capture::HalfImage before = mirror.shot.plate;
  capture::HalfImage after = before;
  std::fill(after.pixels.begin() + static_cast<std::ptrdiff_t>(after.index(112, 0)),
            after.pixels.end(), capture::half_from_float(0.9F));
  render::KeptTransport kept;
  const auto expect_same = [&](const render::LightTable& light, const capture::HalfImage& plate) {
    mirror.shot.job.lights = light;
    const FrameResult warm = mirror.show(plate, &kept), cold = mirror.show(plate);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels);
  };
  for (int i = 0; i < 3; ++i) expect_same(planned, before);
  expect_same(dim, before);
  for (int i = 0; i < 4; ++i) expect_same(planned, after);
}

// Flat by its matrix, to any side, used once or twice, still or moving; and less than flat.
TEST(ReuseAtTheEdge, DrawsWhatIsFlatByItsMatrix) {
  register_shaders();
  const std::vector<std::array<float, 12>> matrices{
      {1, 0, 0, 0, 0, 0, 0, -0.5F, 0, 0, 1, 0},          // a wall
      {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1e-3F},          // on the floor
      {0.6F, 0.8F, 0, 0, 0.6F, 0.8F, 0, 0, 0, 0, 1, 0},  // turned
      {1, 0, 0, 0, 0, 1e-12F, 0, -0.5F, 0, 0, 1, 0},     // nearly flat
      {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0},
      {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.2F}};
  for (std::size_t m = 0; m < matrices.size(); ++m) {
    capture::HalfImage once;
    for (const bool moves : {false, true}) {
      render::SceneDescription scene = shot_scene();
      // One layer, however it is pressed.
      auto sheet = std::make_shared<render::Mesh>();
      sheet->positions = {
          {-0.5F, -0.4F, 0}, {0.5F, -0.3F, 0.1F}, {0.5F, 0.4F, 1}, {-0.5F, 0.3F, 0.9F}};
      sheet->triangles = {{0, 1, 2}, {0, 2, 3}};
      sheet->materials = {1};
      for (std::size_t i = 1; i < scene.meshes.size(); ++i) scene.meshes[i] = sheet;
      for (std::size_t i = 1; i < scene.instances.size(); ++i) {
        scene.instances[i].set_from_object = matrices[m];
        scene.instances[i].moves = moves;
      }
      MadeShot shot = made_shot(96, 64, scene);
      FrameResult result;
      render_frame(shot.inputs(), shot.job, shot.plate, result);
      for (const Half value : result.rgba.pixels)
        ASSERT_TRUE(std::isfinite(capture::float_from_half(value))) << m;
      if (!moves) {
        once = result.rgba;
        continue;
      }
      double apart = 0;
      for (std::size_t i = 0; i < once.pixels.size(); ++i) {
        apart += std::abs(capture::float_from_half(once.pixels[i]) -
                          capture::float_from_half(result.rgba.pixels[i]));
      }
      EXPECT_LT(apart / static_cast<double>(once.pixels.size()), 0.004) << m;
      EXPECT_EQ(result.statistics.virtual_pixels > 0, m < 4) << m;
    }
  }
}

// Laid over nothing, it holds nothing and has no point.
TEST(ReuseAtTheEdge, KnowsThatAGridOverNothingHasNoPlaces) {
  const render::SpaceGrid grid(render::no_bounds);
  EXPECT_EQ(grid.box_at({0, 0, 0}), -1);
  EXPECT_EQ(grid.box_at({3, -2, 1}), -1);
  EXPECT_FALSE(grid.holds({{0, 0, 0}, {1, 1, 1}}));
  EXPECT_TRUE(grid.holds(render::no_bounds));
}

}  // namespace
}  // namespace compositing::reuse_limits_test
