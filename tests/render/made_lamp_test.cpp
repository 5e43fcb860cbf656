// The made lamp: its lights are those of its disc.
#include "render/made_lamp.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/photograph_view.h"

namespace render::made_lamp_test {
namespace {

Environment darkness() {
  Environment dark;
  dark.radiance = capture::make_image(8, 16);
  dark.seen.assign(8 * 16, 1);
  return dark;
}

// A white floor with the lamp on it, and the pixel that looks at (x, y) of the floor from above.
double floor_radiance(double x, double y, std::span<const LocalLight> lights, int samples) {
  MadeSceneBuilder builder;
  builder.add("floor", make_rectangle({-9, -9, 0}, {18, 0, 0}, {0, 18, 0}, 1), {1, 1, 1}, 1, -1, 0);
  SceneDescription description = builder.take();
  join(description, made_lamp());
  const Scene scene(std::move(description));
  const auto directions = calibrate::make_direction_table({"pinhole", 2, 2, {200, 200, 0.5, 0.5}});
  const auto camera = calibrate::look_at({x, y - 0.7, 0.8}, {x, y, 0}, 0);
  const Environment dark = darkness();
  PhotographView view;
  view.lamps = lights;
  const capture::Image seen =
      photograph({&scene, &directions, &dark}, camera,
                 {.samples = samples, .max_depth = 3, .bounces = true}, view);
  double mean = 0;
  for (std::size_t i = 1; i < seen.pixels.size(); i += 3) mean += seen.pixels[i] / 4;
  return mean;
}

// Paths that meet the disc by chance say the same as its lights do.
TEST(LightsOfMadeLamp, LightTheFloorAsTheDiscDoes) {
  const std::vector<LocalLight> lights = lights_of_made_lamp(as_it_stands, 16);
  for (const double away : {0.0, 0.8}) {
    const double by_lights = floor_radiance(0.35 + away, -0.2, lights, 64);
    const double by_disc = floor_radiance(0.35 + away, -0.2, {}, 1 << 16);
    EXPECT_NEAR(by_lights / by_disc, 1, 0.05) << away;
  }
}

TEST(LightsOfMadeLamp, HaveTheDiscsPowerWhateverTheirNumber) {
  const Placement stands = placed({1, 2, 0}, 0.7F);
  for (const int count : {1, 7, 64}) {
    Vec3f sum;
    for (const LocalLight& light : lights_of_made_lamp(stands, count)) {
      sum += light.intensity;
      EXPECT_NEAR(light.normal.z, -1, 1e-6);
      EXPECT_NEAR(length(light.position -
                         Vec3f{1 + 0.35F * std::cos(0.7F), 2 + 0.35F * std::sin(0.7F), 1.098F}),
                  0, lamp_disc_radius_m);
    }
    const float area = std::numbers::pi_v<float> * lamp_disc_radius_m * lamp_disc_radius_m;
    EXPECT_NEAR(sum.x, lamp_disc_radiance[0] * area, 1e-4F);
  }
  EXPECT_THROW(lights_of_made_lamp(stands, 0), std::invalid_argument);
}

}  // namespace
}  // namespace render::made_lamp_test
