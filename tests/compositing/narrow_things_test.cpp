// What is narrower than the pixels that are looked at first: shadows beside the things that cast
// them, wherever in a cell, and tips of bright things that no pixel's centre shows.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#include "made_shot.h"

namespace compositing {
namespace {

using capture::float_from_half;

constexpr int side = 64;
constexpr double middle = 31.5;
constexpr double metres_a_pixel = 0.01;

// Of the picture, where a column or a row is in the set.
float metres_right(double column) { return static_cast<float>((column - middle) * metres_a_pixel); }
float metres_up(double row) { return static_cast<float>((middle - row) * metres_a_pixel); }

MadeShot from_above(render::SceneDescription scene) {
  MadeShot shot = made_shot(side, side, std::move(scene));
  shot.directions =
      calibrate::make_direction_table({"pinhole", side, side, {1000, 1000, middle, middle}});
  shot.job.cam_from_set = calibrate::look_at({0, 0, 10}, {0, 0, 0}, 0);
  return shot;
}

render::FrameResult frame_of(const MadeShot& shot) {
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  return result;
}

// A slab on the floor, half a pixel high, that covers all of the picture from behind row `row` on.
MadeShot beside_slab(int row) {
  render::SceneDescription scene = made_scene(false);
  auto slab = std::make_shared<render::Mesh>();
  const float edge = metres_up(row + 0.5), height = 0.005F;
  slab->positions = {{-5, -5, height},   {5, -5, height}, {5, edge, height},
                     {-5, edge, height}, {5, edge, 0},    {-5, edge, 0}};
  slab->triangles = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {3, 4, 5}};
  slab->materials = {1};
  scene.meshes.push_back(std::move(slab));
  scene.instances.emplace_back().mesh = 1;
  return from_above(std::move(scene));
}

// Of the picture's rows, the root mean square of what the shadow is off in the one beside the slab.
double shadow_error(const render::FrameResult& frame, const render::FrameResult& truth, int row) {
  double squares = 0;
  for (int x = 0; x < side; ++x) {
    const std::size_t i = frame.matte.index(row, x);
    squares += std::pow(static_cast<double>(float_from_half(frame.matte.pixels[i]) -
                                            float_from_half(truth.matte.pixels[i])),
                        2);
  }
  return std::sqrt(squares / side);
}

// One pixel of 4x4 is asked first. The shadow's only row is the border of such a block for one edge
// of four, and of a cell for one of sixteen.
TEST(NarrowShadows, AreFoundBesideWhatCastsThemWhereverABlockEnds) {
  for (const bool soft : {false, true}) {
    for (int row = 18; row < 34; ++row) {
      MadeShot shot = beside_slab(row);
      shot.job.effort.soft_lights = soft;
      shot.job.effort.adaptive_visibility = false;
      const render::FrameResult truth = frame_of(shot);
      shot.job.effort.adaptive_visibility = true;
      EXPECT_LT(shadow_error(frame_of(shot), truth, row), 0.01) << row << (soft ? " soft" : "");
      double shadow = 0;
      for (int x = 0; x < side; ++x) {
        shadow +=
            static_cast<double>(float_from_half(truth.matte.pixels[truth.matte.index(row, x)])) /
            side;
      }
      EXPECT_GT(shadow, 0.1) << "there is one";
    }
  }
}

// A glowing square whose corner ends a part of a pixel beyond that pixel's own corner.
TEST(NarrowTips, AreSeenWhereNoPixelsSideShowsThem) {
  constexpr float glow = 20;
  for (const auto& [across, down] :
       {std::array<double, 2>{0.3, 0.3}, {0.4, 0.2}, {0.15, 0.45}, {0.45, 0.45}}) {
    for (const int at : {20, 22, 25}) {
      render::SceneDescription scene = made_scene(false);
      render::StandardParameters bright;
      std::fill_n(bright.base_color, 3, 0.0F);
      bright.specular = 0;
      std::fill_n(bright.emission, 3, glow);
      scene.materials.push_back(make_standard_material("glow", bright));
      auto square = std::make_shared<render::Mesh>();
      const float left = metres_right(at - 10), right = metres_right(at + 0.5 + across);
      const float top = metres_up(at - 10), bottom = metres_up(at + 0.5 + down);
      const float height = 1e-4F;
      square->positions = {{left, bottom, height},
                           {right, bottom, height},
                           {right, top, height},
                           {left, top, height}};
      square->triangles = {{0, 1, 2}, {0, 2, 3}};
      square->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
      scene.meshes.push_back(std::move(square));
      scene.instances.emplace_back().mesh = 1;
      const render::FrameResult frame = frame_of(from_above(std::move(scene)));
      const std::size_t tip = frame.rgba.index(at + 1, at + 1);
      const double shown = static_cast<double>(float_from_half(frame.rgba.pixels[tip]));
      EXPECT_NEAR(shown / double{glow}, across * down, 0.04) << at << ' ' << across << ' ' << down;
    }
  }
}

}  // namespace
}  // namespace compositing
