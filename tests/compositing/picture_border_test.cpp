// Pixels at the picture's border, and those where the lens sees nothing.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "../render/plain_shapes.h"
#include "../render/sun_and_sky.h"
#include "compositing/stand_in.h"
#include "render/kernel.h"
#include "render/reference.h"
#include "render/standard.h"

namespace compositing::picture_border_test {
namespace {

using render::Vec3f;

constexpr int side = 32;
constexpr float focal_px = 32, middle = (side - 1) / 2.0F;

float value_at(const render::FrameResult& frame, int x, int y, std::size_t channel) {
  return capture::float_from_half(frame.rgba.pixels[frame.rgba.index(y, x) + channel]);
}

// What glows to the right of column `edge` of a picture that is turned so many quarters.
render::SceneDescription glow_beyond(float edge, int quarters) {
  register_shaders();
  render::StandardParameters glow;
  std::fill_n(glow.base_color, 3, 0.0F);
  std::fill_n(glow.emission, 3, 1.0F);
  glow.specular = 0;
  auto sheet = std::make_shared<render::Mesh>();
  const float left = (edge - middle) / focal_px;
  for (const auto& [x, y] : {std::array{left, -3.0F}, {3.0F, -3.0F}, {3.0F, 3.0F}, {left, 3.0F}}) {
    float right = x, down = y;
    for (int i = 0; i < quarters; ++i) {
      const float turned = right;
      right = -down, down = turned;
    }
    sheet->positions.push_back({right, 1, -down});
  }
  sheet->triangles = {{0, 1, 2}, {0, 2, 3}};
  sheet->materials = {0};
  render::SceneDescription scene = render::make_scene(std::move(sheet), glow);
  scene.background = "plate";
  return scene;
}

TEST(PictureBorder, IsCoveredAsFarAsThingsReachOverItsPixels) {
  render::Environment environment = render::make_even_environment(0.01F, 16);
  render::smooth_for_reflections(environment);
  const auto directions = render::make_pinhole_directions(side, side, focal_px);
  const auto plate = capture::to_half(capture::make_image(side, side));
  render::FrameJob job;
  job.cam_from_set = calibrate::look_at({0, 0, 0}, {0, 1, 0}, 0);
  job.lights = render::make_light_table(environment, {.count = 4});
  for (const float edge : {30.3F, 31.1F, 31.2F, 31.3F, 31.4F}) {
    for (int quarters = 0; quarters < 4; ++quarters) {
      const render::Scene scene(glow_beyond(edge, quarters));
      const render::FrameInputs inputs{&scene, &directions, &environment};
      render::FrameResult whole;
      render_frame(inputs, job, plate, whole);
      const int last = static_cast<int>(std::lround(edge)), first = side - 1 - last;
      const std::array<std::array<int, 2>, 4> places{
          {{last, 16}, {16, last}, {first, 16}, {16, first}}};
      const auto [x, y] = places[static_cast<std::size_t>(quarters)];
      EXPECT_NEAR(value_at(whole, x, y, 3), static_cast<float>(last) + 0.5F - edge, 0.03F)
          << edge << ", " << quarters;
      render::FrameJob small = job;
      small.effort.tile_size = 16;
      render::FrameResult tiles;
      render_frame(inputs, small, plate, tiles);
      EXPECT_EQ(whole.rgba.pixels, tiles.rgba.pixels) << edge << ", " << quarters;
    }
  }
}

TEST(PictureBorder, ShowsThePlateWhereTheLensSeesNothing) {
  register_shaders();
  render::SceneDescription description = render::make_scene(render::make_sphere(0.3F, 24), {});
  description.background = "environment";
  const render::Scene scene(description);
  render::Environment environment = render::make_even_environment(1, 16);
  render::smooth_for_reflections(environment);
  calibrate::Lens lens{"equisolid", side, side, {20, middle, middle}};
  lens.max_angle_rad = 0.5;
  const auto directions = calibrate::make_direction_table(lens);
  capture::Image plate = capture::make_image(side, side);
  std::ranges::fill(plate.pixels, 0.25F);
  render::FrameJob job;
  job.cam_from_set = calibrate::look_at({0, -2, 0}, {0, 0, 0}, 0);
  job.lights = render::make_light_table(environment, {.count = 4});
  const render::FrameInputs inputs{&scene, &directions, &environment};
  render::FrameResult frame;
  render_frame(inputs, job, capture::to_half(plate), frame);
  const capture::Image reference = render_reference(inputs, job, plate, {.samples = 16});
  int blind = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const std::size_t t = directions.index(y, x);
      const bool sees = directions.x[t] != 0 || directions.y[t] != 0 || directions.z[t] != 0;
      const float shown = value_at(frame, x, y, 0);
      if (sees) continue;
      ++blind;
      EXPECT_EQ(shown, 0.25F) << x << ", " << y;
      EXPECT_EQ(reference.at(y, x, 0), 0.25F) << x << ", " << y;
      EXPECT_EQ(value_at(frame, x, y, 3), 0) << x << ", " << y;
    }
  }
  EXPECT_GT(blind, side * side / 4);
  EXPECT_NEAR(value_at(frame, 24, 16, 0), 1, 1e-3F) << "the environment";
}

}  // namespace
}  // namespace compositing::picture_border_test
