// Light on what is seen in mirrors, where each point may test a share of the lights only.
#include <gtest/gtest.h>

#include <algorithm>

#include "made_shot.h"

namespace compositing::bounced_light_test {
namespace {

constexpr int width = 48, height = 32;

// A matte floor seen in a dull mirror, lit from where nothing hides the light.
MadeShot mirrored_floor(float reflectance) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "environment";
  render::StandardParameters matte;
  std::fill_n(matte.base_color, 3, 0.6F);
  matte.roughness = 1;
  matte.specular = 0;
  render::StandardParameters mirror;
  std::fill_n(mirror.base_color, 3, reflectance);
  mirror.metallic = 1;
  mirror.roughness = 0;
  scene.materials = {make_standard_material("matte", matte),
                     make_standard_material("mirror", mirror)};
  auto wall = std::make_shared<render::Mesh>();
  wall->positions = {{-9, 3, 0}, {9, 3, 0}, {9, 3, 9}, {-9, 3, 9}};
  wall->triangles = {{0, 1, 2}, {0, 2, 3}};
  wall->materials = {1};
  scene.meshes = {made_floor(200, 0), wall};
  scene.instances.resize(2);
  scene.instances[1].mesh = 1;
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(scene));
  const double f = width;
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
  shot.environment = made_sky(16, 0, 1);
  shot.plate = capture::to_half(capture::make_image(height, width));
  shot.job.cam_from_set = calibrate::look_at({0, -2, 2}, {0, 3, 1}, 0);
  shot.job.lights = even_lights(64);
  std::erase_if(shot.job.lights.lights, [](const auto& light) { return light.direction.y > 0; });
  shot.job.effort.aa_samples = 1;
  return shot;
}

capture::Image picture_of(const MadeShot& shot) {
  render::FrameResult result;
  render::render_frame(shot.inputs(), shot.job, shot.plate, result);
  return capture::to_float(result.rgba);
}

TEST(GatherPoints, GivesPointsThatTestAShareOfTheLightsAllOfItWhereNothingIsHidden) {
  for (const float reflectance : {0.4F, 0.15F, 0.06F}) {
    MadeShot shot = mirrored_floor(reflectance);
    const capture::Image some = picture_of(shot);
    shot.job.effort.accuracy = 1;
    const capture::Image all = picture_of(shot);
    double brightest = 0;
    for (std::size_t i = 0; i < all.pixels.size(); ++i) {
      brightest = std::max(brightest, double{all.pixels[i]});
      ASSERT_NEAR(some.pixels[i], all.pixels[i], 2e-3 * all.pixels[i] + 1e-5)
          << "at " << i << " of reflectance " << reflectance;
    }
    EXPECT_GT(brightest, 0.1 * reflectance);
  }
}

}  // namespace
}  // namespace compositing::bounced_light_test
