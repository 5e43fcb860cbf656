// Rays that are cut: what is taken for what they would have met.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "render/light_table.h"
#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"

namespace compositing::cut_rays_test {
namespace {

// A room of varnished walls, open towards the camera only, under an even light. What its walls
// mirror is less than the default effort follows.
render::SceneDescription made_room() {
  auto room = std::make_shared<render::Mesh>(*render::make_box({-1, -1, -1}, {1, 1, 1}));
  std::erase_if(room->triangles, [&](const auto& triangle) {
    return std::ranges::all_of(triangle, [&](auto i) { return room->positions[i].y < 0; });
  });
  render::StandardParameters varnish;
  varnish.roughness = 0.2F;
  varnish.specular = 0.4F;
  for (float& channel : varnish.base_color) channel = 0.15F;
  return render::make_scene(room, varnish);
}

double mean_of(const capture::Image& picture) {
  double sum = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) sum += static_cast<double>(picture.at(y, x, 1));
  return sum / (picture.height * picture.width);
}

GlassShot shot_of(render::SceneDescription scene) {
  GlassShot shot =
      glass_shot(std::move(scene), [](render::Vec3f) { return 1.0F; }, 48, 70, {0, -2.5, 0});
  shot.job.lights = render::make_light_table(shot.environment, {});
  shot.job.effort = {};
  return shot;
}

TEST(CutRays, DoNotSeeTheSkyThroughWalls) {
  GlassShot shot = shot_of(made_room());
  const double truth = mean_of(shot.reference(512));
  // A fifth more, if they did.
  EXPECT_NEAR(mean_of(shot.kernel()), truth, 0.025 * truth);
  shot.job.effort.accuracy = 0.999F;
  EXPECT_NEAR(mean_of(shot.kernel()), truth, 0.007 * truth) << "nearly all are followed";
}

}  // namespace
}  // namespace compositing::cut_rays_test
