// What rays meet after the first surface, against the reference: things inside coloured glass, a
// glass that stands in the floor; and edges and normal maps of things that are turned or mirrored.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "calibrate/pose.h"
#include "compositing/stand_in.h"
#include "render/glass.h"
#include "render/join_scenes.h"
#include "render/reference.h"
#include "render/renderer.h"
#include "render/standard.h"
#include "render/texture.h"
#include "render/trace.h"
#include "tests/compositing/made_shot.h"

namespace compositing::rays_onward_test {
namespace {

using namespace render;

constexpr int width = 64, height = 48;

class RaysOnward : public testing::Test {
 protected:
  static void SetUpTestSuite() { register_shaders(); }
};

Material red_glass() {
  GlassParameters glass;
  glass.absorption[0] = 0.5F;
  glass.absorption[1] = 2;
  return make_glass_material("glass", glass);
}

// Means of a few pixels in the picture's middle.
std::array<double, 3> middle_of(const std::function<float(int, int, int)>& at) {
  std::array<double, 3> mean{};
  for (int y = height / 2 - 4; y < height / 2 + 4; ++y) {
    for (int x = width / 2 - 4; x < width / 2 + 4; ++x) {
      for (int c = 0; c < 3; ++c) mean[static_cast<std::size_t>(c)] += at(y, x, c) / 64.0;
    }
  }
  return mean;
}

// As the kernel and as the reference have the picture's middle.
void expect_as_reference(MadeShot& shot, const char* what) {
  shot.job.effort.accuracy = 0.9999F;
  const calibrate::Lens lens{
      "pinhole", width, height, {1.1 * width, 1.1 * width, (width - 1) / 2.0, (height - 1) / 2.0}};
  FrameInputs inputs = shot.inputs();
  inputs.lens = &lens;
  FrameResult result;
  render_frame(inputs, shot.job, shot.plate, result);
  ReferenceSettings settings;
  settings.samples = 128;
  const capture::Image truth =
      render_reference(inputs, shot.job, capture::to_float(shot.plate), settings);
  const auto ours = middle_of([&](int y, int x, int c) {
    return capture::float_from_half(result.rgba.pixels[result.rgba.index(y, x, c)]);
  });
  const auto theirs = middle_of([&](int y, int x, int c) { return truth.at(y, x, c); });
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(ours[c], theirs[c], 0.04 * theirs[2]) << what << c;
}

// Light goes through the glass before such a thing and after it.
TEST_F(RaysOnward, GoThroughTheGlassThatTheyAreIn) {
  StandardParameters mirror, pane;
  mirror.metallic = 1;
  mirror.roughness = 0;
  pane.transmission = 1;
  pane.roughness = 0;
  pane.specular = 0;
  for (const auto& [what, inside] : {std::pair("mirror ", mirror), std::pair("pane ", pane)}) {
    SceneDescription scene;
    scene.background = "plate";
    scene.materials = {red_glass(), make_standard_material("inside", inside)};
    auto square = std::make_shared<Mesh>();
    square->positions = {
        {-0.3F, 0.05F, -0.3F}, {0.3F, 0.05F, -0.3F}, {0.3F, 0.05F, 0.3F}, {-0.3F, 0.05F, 0.3F}};
    square->triangles = {{0, 1, 2}, {0, 2, 3}};
    square->materials = {1};
    scene.meshes = {made_ball({0, 0, 0}, 0.5F, 0), square};
    scene.instances.resize(2);
    scene.instances[1].mesh = 1;
    MadeShot shot = made_shot(width, height, scene, 64);
    shot.job.cam_from_set = calibrate::look_at({0, -3, 0.3}, {0, 0, 0}, 0);
    expect_as_reference(shot, what);
  }
}

TEST_F(RaysOnward, LoseLightInGlassUpToTheStandInThatEndsThem) {
  SceneDescription scene;
  scene.background = "plate";
  scene.materials = {make_stand_in_material("floor", {}), red_glass()};
  scene.meshes = {made_floor(20, 0), made_ball({0, 0, 0}, 0.5F, 1)};
  scene.instances.resize(2);
  scene.instances[0].kind = ObjectKind::stand_in;
  scene.instances[0].blocks_light = false;
  scene.instances[1].mesh = 1;
  MadeShot shot = made_shot(width, height, scene, 16);
  shot.job.cam_from_set = calibrate::look_at({0, -2, 3}, {0, 0, 0}, 0);
  for (capture::Half& value : shot.plate.pixels) value = capture::half_from_float(0.5F);
  expect_as_reference(shot, "floor ");
}

// A dark slat before a light one, of one textured material, turned towards the camera: pixels of
// its edges that are neither.
int pixels_between(bool moves, int aa_samples) {
  constexpr int side = 96;
  auto slats = std::make_shared<Mesh>();
  const auto add = [&](float size, float z, float tilt, float u) {
    const auto first = static_cast<std::uint32_t>(slats->positions.size());
    for (const auto& [x, y] :
         {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      slats->positions.push_back(
          {size * static_cast<float>(x), size * static_cast<float>(y) + (x > 0 ? tilt : 0), z});
      slats->uvs.push_back({u, 0.5F});
    }
    slats->triangles.push_back({first, first + 1, first + 2});
    slats->triangles.push_back({first, first + 2, first + 3});
  };
  add(1, 0, 0, 0.25F);
  add(0.5F, 0.5F, 0.1F, 0.75F);
  slats->materials = {0};
  StandardParameters shining;
  shining.specular = 0;
  for (float& of_base : shining.base_color) of_base = 0;
  for (float& emitted : shining.emission) emitted = 1;
  shining.emission_texture = 0;
  const std::vector<std::uint8_t> texels{20, 20, 20, 250, 250, 250};
  SceneDescription scene;
  scene.background = "plate";
  scene.meshes = {slats};
  scene.textures = {std::make_shared<Texture>(make_texture(2, 1, 3, true, texels))};
  scene.materials = {make_standard_material("shining", shining)};
  scene.instances.resize(1);
  scene.instances[0].set_from_object = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0};
  scene.instances[0].moves = moves;
  MadeShot shot = made_shot(side, side, scene, 8);
  shot.job.cam_from_set = calibrate::look_at({0, -4, 0}, {0, 0, 0}, 0);
  shot.job.effort.aa_samples = aa_samples;
  FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  int between = 0;
  for (int y = 30; y < 70; ++y) {
    for (int x = 30; x < 70; ++x) {
      const float v = capture::float_from_half(result.rgba.pixels[result.rgba.index(y, x, 0)]);
      between += v > 0.05F && v < 0.9F ? 1 : 0;
    }
  }
  return between;
}

TEST_F(RaysOnward, EdgesOfThingsThatMoveAreSmoothedAsThoseThatDoNot) {
  const int still = pixels_between(false, 16);
  EXPECT_GT(still, 40);
  EXPECT_NEAR(pixels_between(true, 16), still, 0.1 * still);
}

// The normal that a map gives a square's middle; the map leans it to +u and up.
Vec3f mapped_normal_of(const Placement& placement, bool moves, Vec3f from, Vec3f direction) {
  auto square = std::make_shared<Mesh>();
  square->positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  square->normals.assign(4, {0, 0, 1});
  square->uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  square->tangents.assign(4, {1, 0, 0, 1});
  square->triangles = {{0, 1, 2}, {0, 2, 3}};
  square->materials = {0};
  StandardParameters mapped;
  mapped.normal_texture = 0;
  const std::vector<std::uint8_t> leaning{167, 217, 230};
  SceneDescription description;
  description.meshes = {square};
  description.textures = {std::make_shared<Texture>(make_texture(1, 1, 3, false, leaning))};
  description.materials = {make_standard_material("mapped", mapped)};
  description.instances.resize(1);
  description.instances[0].set_from_object = placement;
  description.instances[0].moves = moves;
  const Scene scene(description);
  const auto met = closest_hit(scene, from, direction, 0, mask_virtual, RayKind::camera);
  if (!met) return {};
  const HitPoint hit =
      scene.hit_point(met->geom_id, met->prim_id, met->inst_id, met->u, met->v, direction);
  return standard_surface(mapped, description, hit).normal;
}

TEST_F(RaysOnward, NormalMapsLeanTheSameWayFromBehindAndMirrored) {
  constexpr Placement as_it_is{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  constexpr Placement mirrored{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  constexpr Vec3f before{0.2F, 0.1F, 3}, behind{0.2F, 0.1F, -3}, in{0, 0, -1}, out{0, 0, 1};
  for (const bool moves : {false, true}) {
    const Vec3f n = mapped_normal_of(as_it_is, moves, before, in);
    EXPECT_GT(n.x, 0.2F);
    EXPECT_GT(n.y, 0.5F);
    EXPECT_LT(length(mapped_normal_of(as_it_is, moves, behind, out) + n), 1e-5F);
    const Vec3f other_way{-n.x, n.y, n.z};
    EXPECT_LT(length(mapped_normal_of(mirrored, moves, before, in) - other_way), 1e-5F);
    EXPECT_LT(length(mapped_normal_of(mirrored, moves, behind, out) + other_way), 1e-5F);
  }
}

}  // namespace
}  // namespace compositing::rays_onward_test
