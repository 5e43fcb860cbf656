// Stand-ins in the kernel as in the reference: what they hide, mirror, and how the lens dims.
#include "compositing/stand_in.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calibrate/vignetting.h"
#include "made_shot.h"
#include "render/reference.h"

namespace compositing::stand_in_test {
namespace {

using capture::float_from_half;

capture::Image by_kernel(const MadeShot& shot) {
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  return capture::to_float(result.rgba);
}

capture::Image by_reference(const MadeShot& shot, int samples) {
  return render_reference(shot.inputs(), shot.job, capture::to_float(shot.plate),
                          {.samples = samples});
}

render::Instance& add(render::SceneDescription& scene, std::shared_ptr<const render::Mesh> mesh) {
  scene.meshes.push_back(std::move(mesh));
  render::Instance& instance = scene.instances.emplace_back();
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  return instance;
}

// A ball half below the floor and one behind a wall, which is twice there: floor and the first wall
// may let them be seen.
MadeShot half_hidden(bool floor_occludes, bool wall_occludes) {
  render::SceneDescription scene = shot_scene(false);
  scene.instances[0].occludes = floor_occludes;
  add(scene, made_ball({0, 0, 0}, 0.7F, 1));
  add(scene, made_ball({-3, 3, 1}, 0.7F, 1));
  render::Instance& wall = add(scene, made_floor(0.8F, 0));
  wall.kind = render::ObjectKind::stand_in;
  wall.blocks_light = false;
  // Upright, across the view: x to the picture's right, normal towards the camera.
  constexpr float s = 0.70710678F;
  wall.set_from_object = {s, 0, s, -1.6F, s, 0, -s, 1.6F, 0, 1, 0, 0.8F};
  wall.occludes = wall_occludes;
  render::Instance again = wall;  // the same mesh again, so that both are Embree instances
  again.set_from_object[3] = 30;
  scene.instances.push_back(again);
  return made_shot(96, 72, std::move(scene));
}

double coverage(const capture::Image& rgba) {
  double sum = 0;
  for (std::size_t i = 3; i < rgba.pixels.size(); i += 4) {
    sum += static_cast<double>(rgba.pixels[i]);
  }
  return sum;
}

TEST(StandIn, HidesOrShowsWhatIsBehindItAsInTheReference) {
  std::array<double, 4> covered{};
  for (std::size_t which = 0; which < 4; ++which) {
    const MadeShot shot = half_hidden((which & 1) == 0, (which & 2) == 0);
    const capture::Image kernel = by_kernel(shot), reference = by_reference(shot, 16);
    covered[which] = coverage(kernel);
    EXPECT_NEAR(covered[which] / coverage(reference), 1, 0.02) << which;
    int differ = 0;
    for (std::size_t i = 3; i < kernel.pixels.size(); i += 4) {
      differ += std::abs(kernel.pixels[i] - reference.pixels[i]) > 0.5F;
    }
    EXPECT_EQ(differ, 0) << which;
  }
  EXPECT_GT(covered[1], 1.3 * covered[0]) << "more of the ball in the floor";
  EXPECT_GT(covered[2], 1.3 * covered[0]) << "the ball behind the wall";
  EXPECT_GT(covered[3], covered[1] + 0.9 * (covered[2] - covered[0]));
}

TEST(StandIn, CatchesShadowWhetherItOccludesOrNot) {
  render::SceneDescription scene = shot_scene();
  const MadeShot hiding = made_shot(160, 120, scene);
  scene.instances[0].occludes = false;
  const MadeShot catching = made_shot(160, 120, std::move(scene));
  // The balls stand on the floor: nothing is behind it.
  EXPECT_EQ(by_kernel(catching).pixels, by_kernel(hiding).pixels);
}

TEST(StandIn, IsSeenBehindAnotherThatDoesNotOcclude) {
  // A ball under the floor, with a plate between them that does occlude: all is as if the ball were
  // not there, but for light.
  render::SceneDescription scene = shot_scene(false);
  scene.instances[0].occludes = false;
  render::Instance& plate = add(scene, made_floor(3, 0));
  plate.kind = render::ObjectKind::stand_in;
  plate.blocks_light = false;
  plate.set_from_object[11] = -0.5F;
  add(scene, made_ball({0, 0, -1.5F}, 0.5F, 1));
  const MadeShot shot = made_shot(96, 64, std::move(scene));
  EXPECT_EQ(coverage(by_kernel(shot)), 0);
  EXPECT_EQ(coverage(by_reference(shot, 4)), 0);
}

// A black ball over a glossy floor under a bright sky, on a plate of a given darkness.
MadeShot dark_reflection(float plate) {
  render::SceneDescription scene = shot_scene(false);
  render::StandInParameters mirror;
  mirror.catches_shadow = 0;
  mirror.catches_reflection = 1;
  mirror.reflectance = 0.5F;
  scene.materials[0] = make_stand_in_material("floor", mirror);
  render::StandardParameters black;
  black.base_color[0] = black.base_color[1] = black.base_color[2] = 0;
  scene.materials[1] = render::make_standard_material("black", black);
  add(scene, made_ball({0, 0, 0.8F}, 0.5F, 1));
  MadeShot shot = made_shot(96, 72, std::move(scene));
  std::ranges::fill(shot.plate.pixels, capture::half_from_float(plate));
  return shot;
}

TEST(StandIn, TakesNoMoreLightFromThePlateThanItHas) {
  for (const float plate : {0.02F, 0.0F, -0.01F}) {
    const MadeShot shot = dark_reflection(plate);
    for (const capture::Image& picture : {by_kernel(shot), by_reference(shot, 16)}) {
      int darkened = 0;
      for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
        if (i % 4 == 3) continue;
        ASSERT_GE(picture.pixels[i], std::min(float_from_half(shot.plate.pixels[0]), 0.0F));
        darkened += picture.pixels[i] < 0.001F;
      }
      if (plate > 0) {
        EXPECT_GT(darkened, 100) << "the black ball is mirrored";
      }
    }
  }
}

TEST(StandIn, TakesAwayTheMirroredSkyWhereThePlateIsBrightEnough) {
  const MadeShot dim = dark_reflection(0.8F), bright = dark_reflection(1.6F);
  const capture::Image a = by_kernel(dim), b = by_kernel(bright);
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (i % 4 != 3 && a.pixels[i - i % 4 + 3] == 0) {
      ASSERT_NEAR(b.pixels[i] - a.pixels[i], 0.8F, 0.003F);
    }
  }
}

TEST(RenderFrame, DimsVirtualThingsAsTheLensDimsThePlate) {
  // A lamp over a floor that tells no albedo, and a glowing ball, through an even lens and another.
  render::SceneDescription scene = shot_scene(false);
  render::StandardParameters glow;
  glow.emission[0] = glow.emission[1] = glow.emission[2] = 2;
  scene.materials[1] = render::make_standard_material("glow", glow);
  add(scene, made_ball({0.6F, 0.6F, 0.5F}, 0.5F, 1));
  MadeShot shot = made_shot(96, 72, std::move(scene));
  std::ranges::fill(shot.plate.pixels, capture::Half{0});
  shot.job.lights.lamps.push_back({{-0.5F, -0.5F, 1}, {}, {1, 1, 1}});
  const capture::Image even = by_kernel(shot);
  const capture::Image even_reference = by_reference(shot, 16);
  calibrate::add_vignetting(std::vector<double>{-0.8}, shot.directions);
  const capture::Image dimmed = by_kernel(shot);
  const capture::Image dimmed_reference = by_reference(shot, 16);
  double least = 1;
  for (int y = 0; y < even.height; ++y) {
    for (int x = 0; x < even.width; ++x) {
      const float s = shot.directions.sensitivity[shot.directions.index(y, x)];
      least = std::min(least, static_cast<double>(s));
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(dimmed.at(y, x, c), s * even.at(y, x, c), 2e-3 * even.at(y, x, c) + 1e-4);
        ASSERT_NEAR(dimmed_reference.at(y, x, c), s * even_reference.at(y, x, c), 1e-4);
      }
      ASSERT_EQ(dimmed.at(y, x, 3), even.at(y, x, 3));
    }
  }
  EXPECT_LT(least, 0.8);
}

}  // namespace
}  // namespace compositing::stand_in_test
