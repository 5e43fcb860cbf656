// Where shadows and mirrored edges lie, whatever the kernel's cells.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "made_shot.h"

namespace compositing::shadow_edges_test {
namespace {

using capture::float_from_half;

// A floor seen from straight above, 100 pixels a metre, half of it in the shadow of a wide roof
// under a sun straight above: the shadow's edge is the picture's row `row`, less `slope` a column.
MadeShot half_shaded(float row, float slope) {
  render::SceneDescription scene = shot_scene(false);
  auto roof = std::make_shared<render::Mesh>();
  // Behind the camera, as wide as all the picture and more: y is up in it.
  const auto y_at = [&](float column) { return (31.5F - row + slope * column) / 100; };
  roof->positions = {{-2, -5, 20}, {2, -5, 20}, {2, y_at(231.5F), 20}, {-2, y_at(-168.5F), 20}};
  roof->triangles = {{0, 1, 2}, {0, 2, 3}};
  roof->materials = {1};
  scene.meshes.push_back(std::move(roof));
  scene.instances.emplace_back().mesh = 1;
  MadeShot shot = made_shot(64, 64, std::move(scene));
  shot.directions = calibrate::make_direction_table({"pinhole", 64, 64, {1000, 1000, 31.5, 31.5}});
  shot.job.cam_from_set = calibrate::look_at({0, 0, 10}, {0, 0, 0}, 0);
  shot.job.lights.lights = {{{0, 0, 1}, {3, 3, 3}, 0.01F, 1}};
  return shot;
}

TEST(RenderFrame, CastsTheSunsShadowAcrossTheBordersOfCells) {
  // The edge enters a cell by less than a block of pixels; so flat that no block beside it tells.
  for (const float row : {14.5F, 15.5F, 16.5F, 17.5F, 30.5F, 33.5F}) {
    for (const float slope : {0.0F, 0.05F}) {
      MadeShot shot = half_shaded(row, slope);
      render::FrameResult adaptive, all;
      shot.job.effort.adaptive_visibility = true;
      render_frame(shot.inputs(), shot.job, shot.plate, adaptive);
      shot.job.effort.adaptive_visibility = false;
      render_frame(shot.inputs(), shot.job, shot.plate, all);
      std::size_t dark = 0, wrong = 0;
      for (std::size_t i = 0; i < all.matte.pixels.size(); ++i) {
        dark += float_from_half(all.matte.pixels[i]) > 0.5F;
        wrong += all.matte.pixels[i] != adaptive.matte.pixels[i];
      }
      EXPECT_NEAR(static_cast<double>(dark), 64 * (64 - row - 0.5 + 31.5 * slope), 64);
      // What is left may touch a border between the pixels tested there: a tip of a wedge.
      EXPECT_LE(wrong, slope > 0 ? 6U : 0U) << "row " << row << ", slope " << slope;
    }
  }
}

// A step above a floor, of one look, but each of its own of very many materials; seen from above
// under a sun that shines aslant.
MadeShot stepped_floor(std::uint32_t floor, std::uint32_t step) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "environment";
  render::StandardParameters dull;
  dull.roughness = 1;
  dull.specular = 0;
  scene.materials.assign(4097, render::make_standard_material("dull", dull));
  auto high = std::make_shared<render::Mesh>();
  high->positions = {{0.03F, -1, 0.2F}, {1, -1, 0.2F}, {1, 1, 0.2F}, {-0.05F, 1, 0.2F}};
  high->triangles = {{0, 1, 2}, {0, 2, 3}};
  high->materials = {step};
  scene.meshes = {made_floor(1, floor), std::move(high)};
  scene.instances.resize(2);
  scene.instances[1].mesh = 1;
  MadeShot shot = made_shot(64, 64, std::move(scene));
  shot.directions = calibrate::make_direction_table({"pinhole", 64, 64, {1000, 1000, 31.5, 31.5}});
  shot.job.cam_from_set = calibrate::look_at({0, 0, 10}, {0, 0, 0}, 0);
  shot.job.lights.lights = {{normalize(render::Vec3f{1, 0.2F, 2}), {3, 3, 3}, 0.01F, 1}};
  shot.job.effort.interleave = 4;
  return shot;
}

TEST(RenderFrame, KeepsSurfacesApartHoweverManyMaterialsThereAre) {
  const MadeShot few = stepped_floor(0, 1), many = stepped_floor(4096, 0);
  render::FrameResult with_few, with_many;
  render_frame(few.inputs(), few.job, few.plate, with_few);
  render_frame(many.inputs(), many.job, many.plate, with_many);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < with_few.rgba.pixels.size(); i += 4) {
    differ += with_few.rgba.pixels[i] != with_many.rgba.pixels[i];
  }
  EXPECT_EQ(differ, 0U);
  EXPECT_EQ(with_few.statistics, with_many.statistics);
}

// A mirror, in which the edge of a bright wall behind the camera lies at `column` of the picture,
// or at such a row.
MadeShot mirrored_edge(float place, bool upright) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "environment";
  render::StandardParameters chrome, glow;
  chrome.metallic = 1;
  chrome.roughness = 0;
  std::fill_n(glow.base_color, 3, 0.0F);
  glow.specular = 0;
  std::fill_n(glow.emission, 3, 1.0F);
  scene.materials = {make_standard_material("chrome", chrome),
                     make_standard_material("glow", glow)};
  const auto add = [&](std::array<render::Vec3f, 4> corners, std::uint32_t material) {
    auto mesh = std::make_shared<render::Mesh>();
    mesh->positions.assign(corners.begin(), corners.end());
    mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh->materials = {material};
    scene.meshes.push_back(std::move(mesh));
    scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  };
  add({{{-9, 2, -9}, {9, 2, -9}, {9, 2, 9}, {-9, 2, 9}}}, 0);
  // The camera looks along y, from the origin; the wall is 8 m away by the mirror.
  const float edge = 8 * (place - 31.5F) / 64;
  if (upright) {
    add({{{edge, -4, -20}, {20, -4, -20}, {20, -4, 20}, {edge, -4, 20}}}, 1);
  } else {
    add({{{-20, -4, -20}, {20, -4, -20}, {20, -4, -edge}, {-20, -4, -edge}}}, 1);
  }
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(scene));
  shot.directions = calibrate::make_direction_table({"pinhole", 64, 64, {64, 64, 31.5, 31.5}});
  shot.environment = made_sky(16, 0, 0);
  shot.plate = capture::to_half(capture::make_image(64, 64));
  shot.job.cam_from_set = calibrate::look_at({0, 0, 0}, {0, 1, 0}, 0);
  return shot;
}

// An edge within the outermost pixels of a cell, of which all the cell's other pixels show nothing.
TEST(RenderFrame, IsSmoothWhereAMirroredEdgeLiesOnTheBorderOfCells) {
  for (const float place : {15.3F, 15.45F, 15.6F, 15.9F, 16.2F, 47.55F, 20.3F, 8.8F}) {
    for (const bool upright : {true, false}) {
      const MadeShot shot = mirrored_edge(place, upright);
      render::FrameResult result;
      render_frame(shot.inputs(), shot.job, shot.plate, result);
      const float cut = std::round(place);
      for (int i = 0; i < 64; ++i) {
        for (const int j : {3, 31, 40}) {
          const float covered = std::clamp(static_cast<float>(i) + 0.5F - place, 0.0F, 1.0F);
          const int x = upright ? i : j, y = upright ? j : i;
          const float shown = float_from_half(result.rgba.pixels[result.rgba.index(y, x, 0)]);
          EXPECT_NEAR(shown, covered, static_cast<float>(i) == cut ? 1.0F / 16 : 1e-3F)
              << place << (upright ? " upright" : " flat") << " at " << x << ", " << y;
        }
      }
    }
  }
}

// What a lamp adds on the real floor is no mirrored light that a cell's neighbours would lack.
TEST(RenderFrame, TakesNoMoreSamplesOnTheBordersOfCellsWhereALampShines) {
  MadeShot shot = made_shot(64, 64, shot_scene(false));
  shot.job.cam_from_set = calibrate::look_at({0, 0, 3}, {0, 0, 0}, 0);
  render::LocalLight lamp;
  lamp.position = {0.3F, 0, 1.5F};
  lamp.intensity = {2, 2, 2};
  shot.job.lights.lamps = {lamp};
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  EXPECT_EQ(result.statistics.primary_rays, 64U * 64U);
}

TEST(RenderFrame, MakesSoftShadowsWithoutSeamsBetweenCells) {
  MadeShot shot = made_shot(192, 144, shot_scene(), 256);
  render::FrameResult adaptive, all;
  render_frame(shot.inputs(), shot.job, shot.plate, adaptive);
  shot.job.effort.adaptive_visibility = false;
  render_frame(shot.inputs(), shot.job, shot.plate, all);
  // The error's rms at the borders of cells, and inside them.
  double border = 0, inside = 0;
  int border_pixels = 0, inside_pixels = 0;
  for (int y = 0; y < 144; ++y) {
    for (int x = 0; x < 192; ++x) {
      if (all.rgba.pixels[all.rgba.index(y, x, 3)] != 0) continue;
      const double error =
          static_cast<double>(float_from_half(adaptive.matte.pixels[adaptive.matte.index(y, x)])) -
          static_cast<double>(float_from_half(all.matte.pixels[all.matte.index(y, x)]));
      const bool at_border = y % 16 == 0 || y % 16 == 15 || x % 16 == 0 || x % 16 == 15;
      (at_border ? border : inside) += error * error;
      ++(at_border ? border_pixels : inside_pixels);
    }
  }
  border = std::sqrt(border / border_pixels);
  inside = std::sqrt(inside / inside_pixels);
  EXPECT_LT(inside, 0.0006);
  EXPECT_LT(border, 0.001);
  RecordProperty("border", std::to_string(border));
  RecordProperty("inside", std::to_string(inside));
}

}  // namespace
}  // namespace compositing::shadow_edges_test
