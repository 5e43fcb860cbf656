// Scenes at the edge of what the kernel can take: the right picture, or a clear refusal; never a
// number that is not finite.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/compositing/made_shot.h"

namespace compositing::kernel_stability_test {
namespace {

using capture::float_from_half;
using render::FrameResult;

FrameResult render(const MadeShot& shot) {
  FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  const auto is_finite = [](capture::Half half) { return std::isfinite(float_from_half(half)); };
  EXPECT_TRUE(std::ranges::all_of(result.rgba.pixels, is_finite));
  EXPECT_TRUE(std::ranges::all_of(result.matte.pixels, is_finite));
  return result;
}

bool is_plate(const MadeShot& shot, const FrameResult& result) {
  for (std::size_t i = 0; i < shot.plate.pixels.size(); ++i) {
    if (result.rgba.pixels[i / 3 * 4 + i % 3] != shot.plate.pixels[i]) return false;
  }
  return true;
}

TEST(KernelAtTheEdge, ShowsThePlateWithoutObjectsOrStandIns) {
  register_shaders();
  render::SceneDescription nothing;
  nothing.background = "plate";
  const MadeShot shot = made_shot(50, 40, nothing);
  EXPECT_TRUE(is_plate(shot, render(shot)));
}

TEST(KernelAtTheEdge, ShowsThePlateWhenTheObjectIsBehindTheCamera) {
  render::SceneDescription scene = shot_scene();
  for (std::size_t i = 1; i < scene.instances.size(); ++i) {
    scene.instances[i].set_from_object[3] += 60;
    scene.instances[i].set_from_object[7] -= 60;
  }
  MadeShot shot = made_shot(50, 40, scene);
  // High light only: objects this far away cast no shadow into the picture.
  shot.job.lights.lights = {{{0, 0, 1}, {1, 1, 1}, 0}};
  EXPECT_TRUE(is_plate(shot, render(shot)));
}

TEST(KernelAtTheEdge, IsAllObjectWhenTheCameraIsInsideIt) {
  MadeShot shot = made_shot(50, 40, shot_scene());
  shot.job.cam_from_set = calibrate::look_at({0, 0, 0.5}, {0, 1, 0.5}, 0);
  const FrameResult result = render(shot);
  for (std::size_t i = 3; i < result.rgba.pixels.size(); i += 4) {
    ASSERT_EQ(float_from_half(result.rgba.pixels[i]), 1.0F);
  }
}

TEST(KernelAtTheEdge, ShowsThePlateOnAStandInSeenEdgeOn) {
  MadeShot shot = made_shot(60, 45, shot_scene(false));
  for (const double height : {0.0, 1e-9, 1e-6, 1e-3}) {
    shot.job.cam_from_set = calibrate::look_at({3, -3, height}, {0, 0, height}, 0);
    EXPECT_TRUE(is_plate(shot, render(shot))) << height;
  }
}

TEST(KernelAtTheEdge, RendersPicturesOfOnePixelAndOddSizes) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 50}, {17, 3}, {15, 33}}) {
    const MadeShot shot = made_shot(width, height, shot_scene());
    const FrameResult result = render(shot);
    EXPECT_EQ(result.rgba.width, width);
    EXPECT_EQ(result.rgba.height, height);
  }
}

// Some rows of a shot as a shot of its own, with the same scene.
MadeShot strip_of(MadeShot whole, int first, int rows) {
  const auto cut = [&](auto& values, int count, int per_row) {
    const auto begin = values.begin() + std::ptrdiff_t{first} * per_row;
    values = std::vector(begin, begin + std::ptrdiff_t{count} * per_row);
  };
  calibrate::DirectionTable& d = whole.directions;
  for (std::vector<float>* values : {&d.x, &d.y, &d.z}) cut(*values, rows + 2, d.width + 2);
  cut(whole.plate.pixels, rows, 3 * d.width);
  d.height = whole.plate.height = rows;
  return whole;
}

// Where nothing looks beyond a cell, a strip of whole cells is the same alone; in the middle, for
// it is the middle's pixels that tell how wide all are.
TEST(KernelAtTheEdge, RendersAnEightKPictureAsItsPartsAlone) {
  constexpr int width = 7680, height = 4320, first = 2144, rows = 32;
  MadeShot shot = made_shot(width, height, shot_scene(), 2);
  shot.job.effort.aa_samples = 1;
  const FrameResult whole = render(shot);
  EXPECT_GT(whole.statistics.virtual_pixels, 1000000U);
  const FrameResult alone = render(strip_of(std::move(shot), first, rows));
  EXPECT_GT(alone.statistics.virtual_pixels, 10000U);
  EXPECT_GT(alone.statistics.affected_pixels, alone.statistics.virtual_pixels);
  const auto of_whole = [](const capture::HalfImage& image) {
    const auto row = std::ptrdiff_t{image.width} * image.channels;
    return std::vector(image.pixels.begin() + first * row,
                       image.pixels.begin() + (first + rows) * row);
  };
  EXPECT_TRUE(alone.rgba.pixels == of_whole(whole.rgba));
  EXPECT_TRUE(alone.matte.pixels == of_whole(whole.matte));
}

TEST(KernelAtTheEdge, TakesAThousandInstances) {
  render::SceneDescription scene = shot_scene();
  for (int i = 0; i < 1000; ++i) {
    render::Instance ball = scene.instances[1];
    ball.set_from_object[3] = static_cast<float>(i % 32) - 16;
    ball.set_from_object[7] = static_cast<float>(i / 32) * 1.5F + 2;
    scene.instances.push_back(ball);
  }
  const MadeShot shot = made_shot(160, 120, scene);
  EXPECT_GT(render(shot).statistics.virtual_pixels, 4000U);
}

TEST(KernelAtTheEdge, TakesTrianglesWithoutAreaAndVerticesThatAreNotFinite) {
  render::SceneDescription scene = shot_scene();
  auto mesh = std::make_shared<render::Mesh>(*scene.meshes[1]);
  for (std::uint32_t i = 0; i < mesh->triangles.size(); i += 3)
    mesh->triangles[i][1] = mesh->triangles[i][0];
  for (std::size_t i = 0; i < mesh->positions.size(); i += 50) mesh->positions[i].y = NAN;
  for (std::size_t i = 0; i < mesh->normals.size(); i += 7) mesh->normals[i] = {};
  scene.meshes[1] = mesh;
  render(made_shot(80, 60, scene));
}

TEST(KernelAtTheEdge, ShowsBlackObjectsAndTheWholePlateInTheDark) {
  MadeShot shot = made_shot(80, 60, shot_scene());
  shot.environment = made_sky(32, 0, 0);
  shot.job.lights.lights.clear();
  const FrameResult result = render(shot);
  for (std::size_t i = 0; i < result.matte.pixels.size(); ++i) {
    const float coverage = float_from_half(result.rgba.pixels[i * 4 + 3]);
    ASSERT_NEAR(float_from_half(result.matte.pixels[i]), coverage, 2e-3F) << "no light, no shadow";
    if (coverage == 1) {
      ASSERT_LT(float_from_half(result.rgba.pixels[i * 4]), 1e-3F);
    }
  }
}

TEST(KernelAtTheEdge, ClampsSunsBeyondHalfAndCountsThem) {
  MadeShot shot = made_shot(80, 60, shot_scene());
  shot.environment.radiance.at(3, 20, 0) = shot.environment.radiance.at(3, 20, 1) = 1e9F;
  shot.environment.smoothed.clear();
  smooth_for_reflections(shot.environment);
  shot.job.lights.lights.push_back({{0, 0.6F, 0.8F}, {1e9F, 1e9F, 1e9F}, 0});
  const FrameResult result = render(shot);
  EXPECT_GT(result.statistics.clamped_values, 0U);
}

TEST(KernelAtTheEdge, CountsTheDepthLimitInAHallOfMirrors) {
  render::SceneDescription scene = shot_scene(false);
  scene.instances.clear();
  render::StandardParameters mirror;
  mirror.metallic = 1;
  mirror.roughness = 0;
  scene.materials.push_back(render::make_standard_material("mirror", mirror));
  scene.meshes.push_back(
      made_ball({0, 0, 0}, 10, static_cast<std::uint32_t>(scene.materials.size() - 1)));
  render::Instance ball;
  ball.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.push_back(ball);
  MadeShot shot = made_shot(40, 30, scene);
  shot.job.effort.accuracy = 1;
  EXPECT_GT(render(shot).statistics.depth_limit_hits, 1000U);
  EXPECT_EQ(render(shot).statistics.ray_limit_hits, 0U);
  shot.job.effort.max_rays = 5;
  const render::RenderStatistics few = render(shot).statistics;
  EXPECT_EQ(few.depth_limit_hits, 0U);
  EXPECT_EQ(few.secondary_rays, 5U * 40 * 30);
  EXPECT_GE(few.ray_limit_hits, 40U * 30);
}

}  // namespace
}  // namespace compositing::kernel_stability_test
