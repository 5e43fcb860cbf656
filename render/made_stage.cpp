// The made stage, piece by piece.
#include "render/made_stage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "render/glass.h"
#include "render/made_person.h"
#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/made_surfaces.h"
#include "render/standard.h"

namespace render {
namespace {

constexpr float stage_left = -4.2F, stage_right = 4.2F, stage_back = 3.4F, stage_front = -6.5F,
                stage_height = 4.6F, wing = 0.8F;
constexpr int person_texels = 512;

Material polished(const std::string& name, std::array<float, 3> base, std::int32_t texture) {
  StandardParameters p;
  std::ranges::copy(base, p.base_color);
  p.base_color_texture = texture;
  p.roughness = 0.8F;
  p.specular = 0;
  p.clearcoat = 1;
  return make_standard_material(name, p);
}

void add_walls(MadeSceneBuilder& stage) {
  const auto slabs = stage.add(make_paving_texture(512, 4));
  stage.add("floor",
            make_rectangle({stage_left, stage_front, 0}, {stage_right - stage_left, 0, 0},
                           {0, stage_back - stage_front, 0}, 4.2F),
            polished("floor", {0.62F, 0.66F, 0.80F}, slabs));
  Mesh walls = make_rectangle({stage_left, stage_back, 0}, {stage_right - stage_left, 0, 0},
                              {0, 0, stage_height}, 1);
  append(walls,
         make_rectangle({stage_left, wing, 0}, {0, stage_back - wing, 0}, {0, 0, stage_height}, 1));
  append(walls, make_rectangle({stage_right, stage_back, 0}, {0, wing - stage_back, 0},
                               {0, 0, stage_height}, 1));
  stage.add("walls", std::move(walls), {0.16F, 0.20F, 0.34F}, 1, -1, 0);
  // Strips of light along the back wall.
  Mesh strips;
  for (const float x : {-3.3F, -1.1F, 1.1F, 3.3F}) {
    append(strips, make_box_faces({x - 0.06F, stage_back - 0.05F, 0.3F},
                                  {x + 0.06F, stage_back, 3.2F}, "-x +x -y -z +z", 1));
  }
  StandardParameters glow;
  std::fill_n(glow.base_color, 3, 0.2F);
  std::ranges::copy(std::array<float, 3>{0.75F, 0.95F, 1.25F}, glow.emission);
  stage.add("light strips", std::move(strips), make_standard_material("light strips", glow));
}

void add_columns(MadeSceneBuilder& stage) {
  constexpr int around = 16;
  constexpr std::array<std::array<float, 2>, 4> shape{
      {{0.24F, 0.16F}, {0.19F, 0.26F}, {0.165F, 2.75F}, {0.25F, 2.9F}}};
  Mesh round, square;
  for (const float x : {-2.3F, 2.3F}) {
    append(round, make_lathe(shape, around, 1), {x, 2.2F, 0});
    append(square,
           make_box_faces({x - 0.27F, 1.93F, 0}, {x + 0.27F, 2.47F, 0.16F}, "-x +x -y +y +z", 1));
    append(square, make_box_faces({x - 0.28F, 1.92F, 2.9F}, {x + 0.28F, 2.48F, 3.05F},
                                  "-x +x -y +y -z +z", 1));
  }
  stage.add("columns", std::move(round), {0.72F, 0.68F, 0.60F}, 1, -1, 0);
  stage.add("plinths", std::move(square), {0.62F, 0.58F, 0.50F}, 1, -1, 0);
}

void add_podium(MadeSceneBuilder& stage) {
  constexpr int around = 26;
  constexpr std::array<std::array<float, 2>, 3> step{{{1.7F, 0}, {1.7F, 0.14F}, {0, 0.14F}}};
  Mesh podium;
  append(podium, make_lathe(step, around, 1), {0, 1.7F, 0});
  stage.add("podium", std::move(podium), {0.42F, 0.07F, 0.06F}, 1, -1, 0);
  const Vec3f foot{glass_sphere_middle.x, glass_sphere_middle.y, 0};
  const float top = glass_sphere_middle.z - glass_sphere_radius_m;
  Mesh pedestal =
      make_box_faces(Vec3f{-0.17F, -0.17F, 0}, {0.17F, 0.17F, top - 0.05F}, "-x +x -y +y", 1);
  append(pedestal, make_box_faces({-0.22F, -0.22F, top - 0.05F}, {0.22F, 0.22F, top},
                                  "-x +x -y +y -z +z", 1));
  Mesh placed;
  append(placed, pedestal, foot, 0.3F);
  stage.add("pedestal", std::move(placed), {0.55F, 0.55F, 0.57F}, 1, -1, 0);
}

void add_mirror(MadeSceneBuilder& stage) {
  // Turned so that the viewer sees the persons in it from the side.
  constexpr Vec3f foot{-2.3F, 0.75F, 0};
  constexpr float yaw = 0.8F, half = 0.7F, z0 = 0.08F, z1 = 2.25F, rim = 0.06F;
  Mesh glass;
  append(glass, make_rectangle({-half, 0, z0}, {2 * half, 0, 0}, {0, 0, z1 - z0}, 0), foot, yaw);
  StandardParameters silver;
  std::fill_n(silver.base_color, 3, 0.9F);
  silver.metallic = 1;
  silver.roughness = 0;
  stage.add("mirror", std::move(glass), make_standard_material("mirror", silver));
  Mesh bars;
  const auto bar = [&](float xa, float za, float xb, float zb, const char* faces) {
    append(bars, make_box_faces({xa, -0.03F, za}, {xb, 0.02F, zb}, faces, 1), foot, yaw);
  };
  bar(-half - rim, 0, -half, z1 + rim, "-x +x -y +y +z");
  bar(half, 0, half + rim, z1 + rim, "-x +x -y +y +z");
  bar(-half, z1, half, z1 + rim, "-y +y -z +z");
  bar(-half, 0, half, z0, "-y +y +z");
  append(bars, make_rectangle({half, 0.015F, z0}, {-2 * half, 0, 0}, {0, 0, z1 - z0}, 1), foot,
         yaw);
  stage.add("mirror frame", std::move(bars), {0.75F, 0.55F, 0.22F}, 0, -1, 1, 1);
}

void add_person(
    MadeSceneBuilder& stage, int number, const MadePerson& person, Vec3f feet, float yaw) {
  const std::string name = "person_" + std::to_string(number);
  StandardParameters p;
  p.base_color_texture = stage.add(make_person_texture(person, person_texels));
  p.alpha_cutoff = 0.5F;
  p.roughness = 1;
  p.specular = 0;
  Mesh card;
  append(card,
         make_rectangle({-made_person_width_m / 2, 0, 0}, {made_person_width_m, 0, 0},
                        {0, 0, made_person_height_m}, 0),
         feet, yaw);
  stage.add(name, std::move(card), make_standard_material(name, p));
}

}  // namespace

SceneDescription make_stage() {
  MadeSceneBuilder stage;
  add_walls(stage);
  add_columns(stage);
  add_podium(stage);
  add_mirror(stage);
  MadePerson first;
  first.raised_arm = 1;
  add_person(stage, 1, first, {-0.78F, -0.35F, 0}, 0.12F);
  MadePerson second;
  second.skin = {0.60F, 0.42F, 0.33F};
  second.hair = {0.30F, 0.14F, 0.05F};
  second.top = {0.46F, 0.05F, 0.09F};
  second.legs = {0.10F, 0.09F, 0.14F};
  second.hair_m = 0.16F;
  second.skirt = 1;
  second.sleeve = 0.35F;
  second.height_share = 0.95F;
  add_person(stage, 2, second, {0.86F, 0.1F, 0}, -0.1F);
  return stage.take();
}

SceneDescription make_glass_sphere() {
  constexpr int around = 20, rings = 11;
  static_assert(2 * around * (rings - 1) == glass_sphere_triangles);
  std::array<std::array<float, 2>, rings + 1> profile{};
  for (int i = 0; i <= rings; ++i) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(i) / rings;
    profile[static_cast<std::size_t>(i)] = {i % rings == 0 ? 0 : std::sin(angle), -std::cos(angle)};
  }
  Mesh sphere = make_turned(profile, around);
  for (std::size_t i = 0; i < sphere.positions.size(); ++i) {
    const Vec3f out = normalize(sphere.positions[i]);
    sphere.normals[i] = out;
    sphere.positions[i] = glass_sphere_middle + out * glass_sphere_radius_m;
  }
  MadeSceneBuilder scene;
  scene.add("glass sphere", std::move(sphere),
            make_glass_material("glass sphere", {.index = 1.5F}));
  return scene.take();
}

}  // namespace render
