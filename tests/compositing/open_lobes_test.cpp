// What rough lobes see of the sky past what the ray in their middle meets, and faint ones at all.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "render/light_table.h"
#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"

namespace compositing::open_lobes_test {
namespace {

render::StandardParameters plastic(float albedo, float roughness, float specular = 1) {
  render::StandardParameters p;
  for (float& channel : p.base_color) channel = albedo;
  p.roughness = roughness;
  p.specular = specular;
  return p;
}

// A floor between two walls, open above and at both ends.
render::SceneDescription trench(const render::StandardParameters& parameters) {
  render::SceneDescription scene;
  scene.materials.push_back(render::make_standard_material("plastic", parameters));
  for (const auto& box : {render::make_box({-0.5F, -2, -0.1F}, {0.5F, 2, 0}),
                          render::make_box({-0.6F, -2, -0.1F}, {-0.5F, 2, 1}),
                          render::make_box({0.5F, -2, -0.1F}, {0.6F, 2, 1})}) {
    render::Instance instance;
    instance.name = "box " + std::to_string(scene.meshes.size());
    instance.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    scene.meshes.push_back(box);
    scene.instances.push_back(instance);
  }
  return scene;
}

GlassShot shot_of(render::SceneDescription scene, int size, calibrate::Vec3 from) {
  const auto sky = [](render::Vec3f to) { return to.z > 0 ? 1.0F : 0.1F; };
  GlassShot shot = glass_shot(std::move(scene), sky, size, 60, from);
  shot.job.lights = render::make_light_table(shot.environment, {});
  shot.job.effort = {};
  return shot;
}

// Within the trench.
double relative_rms(const capture::Image& picture, const capture::Image& truth) {
  double squares = 0, of_truth = 0;
  for (int y = 20; y < 60; ++y) {
    for (int x = 20; x < 44; ++x) {
      const auto t = static_cast<double>(truth.at(y, x, 1));
      const double error = static_cast<double>(picture.at(y, x, 1)) - t;
      squares += error * error, of_truth += t * t;
    }
  }
  return std::sqrt(squares / of_truth);
}

// By the ray in their middle alone lobes of the roughest plastic err by .48, and of grey by .11.
TEST(OpenLobes, SeeWhatLightTheirPointSees) {
  struct Case {
    float albedo, roughness;
    double error;
  };
  for (const auto& [albedo, roughness, error] :
       {Case{0.02F, 0.8F, 0.18}, {0.5F, 0.8F, 0.05}, {0.02F, 0.5F, 0.16}, {0.5F, 0.5F, 0.055}}) {
    const GlassShot shot = shot_of(trench(plastic(albedo, roughness)), 64, {0, -2.6, 1.2});
    EXPECT_LT(relative_rms(shot.kernel(), shot.reference(256)), error)
        << "albedo " << albedo << ", roughness " << roughness;
  }
}

// Nothing shines into a closed room: what it mirrors faintly is not the sky.
TEST(OpenLobes, AreDarkWhereNoLightComes) {
  const auto room = std::make_shared<render::Mesh>(*render::make_box({-1, -1, -1}, {1, 1, 1}));
  for (const float roughness : {0.1F, 0.7F}) {
    const GlassShot shot =
        shot_of(render::make_scene(room, plastic(0.3F, roughness, 0.1F)), 48, {0, -0.9, 0});
    const capture::Image shown = shot.kernel();
    float brightest = 0;
    for (int y = 0; y < shown.height; ++y) {
      for (int x = 0; x < shown.width; ++x) brightest = std::max(brightest, shown.at(y, x, 1));
    }
    EXPECT_LT(brightest, 1e-4F) << "roughness " << roughness;
  }
}

}  // namespace
}  // namespace compositing::open_lobes_test
