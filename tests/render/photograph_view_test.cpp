// What is photographed behind virtual objects: the ground in their shadow, and nothing of them.
#include "render/photograph_view.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "render/made_scene.h"
#include "render/made_shapes.h"

namespace render::photograph_view_test {
namespace {

// A grey floor, and a box over its middle.
SceneDescription floor_and_box() {
  MadeSceneBuilder builder;
  builder.add("floor", make_rectangle({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 1), {0.5F, 0.5F, 0.5F},
              1, -1, 0);
  builder.add("box", make_box({-1, -1, 0.3F}, {1, 1, 1.3F}, 0, 1), {0.1F, 0.9F, 0.1F}, 1, -1, 0);
  SceneDescription scene = builder.take();
  scene.instances[0].kind = ObjectKind::stand_in;
  return scene;
}

Environment even_light() {
  Environment light;
  light.radiance = capture::make_image(16, 32);
  std::ranges::fill(light.radiance.pixels, 1.0F);
  light.seen.assign(16 * 32, 1);
  return light;
}

TEST(PhotographView, ShowsTheFloorInTheShadowOfWhatItLooksThrough) {
  const Scene scene(floor_and_box());
  const Environment light = even_light();
  const auto directions =
      calibrate::make_direction_table({"pinhole", 32, 32, {40, 40, 15.5, 15.5}});
  const auto camera = calibrate::look_at({0, 0, 6}, {0, 0, 0}, 0);
  // So few that photograph() gives every pixel as many.
  const ReferenceSettings settings{.samples = 31, .bounces = true};
  const FrameInputs inputs{&scene, &directions, &light};
  const capture::Image behind = photograph(inputs, camera, settings, {.behind_virtual = true});
  const capture::Image before = photograph(inputs, camera, settings);
  // In the corner the box is not seen: the same paths.
  for (int c = 0; c < 3; ++c) EXPECT_EQ(behind.at(1, 1, c), before.at(1, 1, c));
  EXPECT_NEAR(behind.at(1, 1, 1), 0.5, 0.05);
  // In the middle the floor gets little light, and what there is has become greener on its way.
  EXPECT_LT(behind.at(16, 16, 0), 0.15);
  EXPECT_GT(behind.at(16, 16, 0), 0.01);
  EXPECT_GT(behind.at(16, 16, 1), behind.at(16, 16, 0));
  EXPECT_GT(before.at(16, 16, 1), 0.6);
}

TEST(PhotographView, RefusesNothingToLookAt) {
  const Scene scene(floor_and_box());
  const Environment light = even_light();
  EXPECT_THROW(photograph({&scene, nullptr, &light}, {}, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace render::photograph_view_test
