// Light between dull surfaces as lamps: against closed forms, and what it must hold.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "plain_shapes.h"
#include "render/bounced_light.h"

namespace render::bounce_lamps_test {
namespace {

using std::numbers::pi;

StandardParameters matte(float r, float g, float b) {
  StandardParameters p;
  p.base_color[0] = r, p.base_color[1] = g, p.base_color[2] = b;
  p.roughness = 1;
  p.specular = 0;
  return p;
}

// A coloured square of 2x2 m on the ground, and a black one of that size at `height`, which takes
// all light from it and sends none back. Each has a mesh and a material of its own.
SceneDescription floor_and_lid(const StandardParameters& floor,
                               float height,
                               const StandardParameters& lid = matte(0, 0, 0)) {
  SceneDescription scene = make_scene(make_square(1), floor);
  auto above = std::make_shared<Mesh>(*make_square(1, height));
  above->materials = {1};
  scene.meshes.push_back(above);
  scene.materials.push_back(make_standard_material("lid", lid));
  scene.instances.emplace_back().mesh = 1;
  return scene;
}

// Light that comes in under the lid, 80 degrees from above.
LightTable low_sun(Vec3f irradiance) {
  LightTable table;
  table.lights = {{normalize(Vec3f{0, 0.985F, 0.174F}), irradiance, 0.01F}};
  return table;
}

Vec3f sum_of(const std::vector<LocalLight>& lamps) {
  Vec3f sum;
  for (const LocalLight& lamp : lamps) sum += lamp.intensity;
  return sum;
}

Vec3f irradiance(const std::vector<LocalLight>& lamps, Vec3f position, Vec3f normal) {
  Vec3f sum;
  for (const LocalLight& lamp : lamps) {
    const auto ray = ray_to_lamp({position, normal, normal}, lamp);
    if (ray) sum += lamp.intensity * ray->per_intensity;
  }
  return sum;
}

// Irradiance on a point that faces the middle of a parallel square of radiance 1 (Howell, "A
// Catalog of Radiation Heat Transfer Configuration Factors", B-3, four times).
double under_square(double side, double distance) {
  const double x = side / 2 / distance, root = std::sqrt(1 + x * x);
  return 4 * x / root * std::atan(x / root);
}

constexpr double sine = 0.174;  // of the sun's height

TEST(BounceLamps, KeepAllLightWhateverTheirNumber) {
  const Scene scene(floor_and_lid(matte(0.8F, 0.4F, 0.1F), 1));
  const LightTable table = low_sun({10, 20, 30});
  for (const int lamps : {1, 7, 64, 1024}) {
    const BouncedLight bounced(scene, table, {.lamps = lamps});
    EXPECT_EQ(bounced.lamps(table).size(), static_cast<std::size_t>(lamps));
    const Vec3f sum = sum_of(bounced.lamps(table));
    const double per_albedo = sine * 4 / pi;  // 4 square metres
    EXPECT_NEAR(sum.x / (0.8 * 10 * per_albedo), 1, 0.02) << lamps;
    EXPECT_NEAR(sum.y / (0.4 * 20 * per_albedo), 1, 0.02) << lamps;
    EXPECT_NEAR(sum.z / (0.1 * 30 * per_albedo), 1, 0.02) << lamps;
  }
}

TEST(BounceLamps, NearTheIrradianceOverALitSquareTheMoreTheyAre) {
  for (const float height : {0.5F, 1.0F, 3.0F}) {
    const Scene scene(floor_and_lid(matte(0.5F, 0.5F, 0.5F), height));
    const LightTable table = low_sun({10, 10, 10});
    const double truth = 0.5 * 10 * sine / pi * under_square(2, height);
    double error = 0;
    for (const int lamps : {16, 64, 256}) {
      const BouncedLight bounced(scene, table, {.lamps = lamps, .points = 16384});
      const double e = irradiance(bounced.lamps(table), {0, 0, height}, {0, 0, -1}).x;
      error = std::abs(e / truth - 1);
      EXPECT_LT(error, 0.06) << height << " " << lamps;
    }
    EXPECT_LT(error, 0.02) << height;
  }
}

// What a lamp in the middle of a sphere sends to its wall comes from there once, and again: in all
// 1 / (1 - albedo) of it (the integrating sphere).
TEST(BounceLamps, HoldAllBouncesOfAnIntegratingSphere) {
  LightTable table;
  table.lamps = {{{0, 0, 0}, {}, {1, 1, 1}}};
  for (const float albedo : {0.2F, 0.5F, 0.8F}) {
    const Scene scene(make_scene(make_sphere(2, 40), matte(albedo, albedo, albedo)));
    const BouncedLight bounced(scene, table, {.lamps = 128});
    const std::vector<LocalLight> lamps = bounced.lamps(table);
    const double twelve = 1 - std::pow(albedo, 12);  // bounces
    const double truth = 4 * albedo / (1 - albedo) * twelve;
    EXPECT_NEAR(sum_of(lamps).x / truth, 1, albedo > 0.5F ? 0.06 : 0.03) << albedo;
    const double wall = albedo / (1 - albedo) * twelve / 4;
    for (const Vec3f n : {Vec3f{0, 0, 1}, Vec3f{0.6F, 0, 0.8F}, Vec3f{0, -0.8F, 0.6F}}) {
      EXPECT_NEAR(irradiance(lamps, n * 1.99F, -n).x / wall, 1, 0.1) << albedo;
    }
  }
}

TEST(BounceLamps, NeverSendMoreThanWhiteWallsGet) {
  LightTable table;
  table.lamps = {{{0, 0, 0}, {}, {1, 1, 1}}};
  const Scene white(make_scene(make_sphere(2, 40), matte(1, 1, 1)));
  for (const int lamps : {1, 3, 16, 200}) {
    const BouncedLight bounced(white, table, {.lamps = lamps, .points = 512});
    const float sum = sum_of(bounced.lamps(table)).x;
    EXPECT_GT(sum, 4) << lamps;
    EXPECT_LT(sum, 4 * 12 * 1.03) << lamps;
  }
}

TEST(BounceLamps, FollowTheLightWithoutARay) {
  const Scene scene(floor_and_lid(matte(0.5F, 0.5F, 0.5F), 1));
  LightTable table = low_sun({10, 10, 10});
  table.lamps = {{{0, 0, 0.5F}, {}, {1, 2, 3}}};
  const BouncedLight bounced(scene, table, {.lamps = 16});
  const auto before = bounced.lamps(table);
  EXPECT_GT(bounced.rays(), 1000U);
  LightTable brighter = table;
  brighter.lights[0].irradiance *= 3;
  brighter.lamps[0].intensity *= 3;
  const auto after = bounced.lamps(brighter);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].position, before[i].position);
    EXPECT_EQ(after[i].planned, before[i].planned);
    EXPECT_EQ(after[i].bounced, 1U);
    EXPECT_NEAR(after[i].intensity.x, 3 * before[i].intensity.x, 1e-5F);
    EXPECT_NEAR(before[i].intensity.y, before[i].planned.y, 1e-5F);
  }
  LightTable other = table;
  other.lights.push_back(other.lights[0]);
  EXPECT_THROW(bounced.lamps(other), std::invalid_argument);
}

TEST(BounceLamps, DoNotStandWhereLightLeavesTheSet) {
  const Scene alone(make_scene(make_square(1), matte(0.5F, 0.5F, 0.5F)));
  const LightTable table = low_sun({10, 10, 10});
  EXPECT_TRUE(BouncedLight(alone, table, {}).empty());
  // The lid's upper side is lit as well.
  const Scene both(floor_and_lid(matte(0.5F, 0.5F, 0.5F), 1, matte(0.5F, 0.5F, 0.5F)));
  for (const LocalLight& lamp : BouncedLight(both, table, {}).lamps(table)) {
    EXPECT_TRUE(lamp.position.z < 0.5F || lamp.normal.z < 0);
  }
}

TEST(BounceLamps, StandOnTheLitSideHoweverTrianglesAreWound) {
  SceneDescription turned = floor_and_lid(matte(0.5F, 0.5F, 0.5F), 1);
  auto mesh = std::make_shared<Mesh>(*turned.meshes[0]);
  for (auto& [a, b, c] : mesh->triangles) std::swap(b, c);
  turned.meshes[0] = mesh;
  const LightTable table = low_sun({10, 10, 10});
  const float plain =
      sum_of(BouncedLight(Scene(floor_and_lid(matte(0.5F, 0.5F, 0.5F), 1)), table, {}).lamps(table))
          .x;
  const BouncedLight bounced(Scene(turned), table, {});
  EXPECT_NEAR(sum_of(bounced.lamps(table)).x / plain, 1, 0.02);
  for (const LocalLight& lamp : bounced.lamps(table)) EXPECT_GT(lamp.normal.z, 0.99F);
}

TEST(BounceLamps, AreFiniteWhateverTheSceneIs) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  SceneDescription broken = floor_and_lid(matte(0.5F, 0.5F, 0.5F), 1);
  auto mesh = std::make_shared<Mesh>(*broken.meshes[0]);
  mesh->positions.push_back({nan, 0, 1e30F});
  mesh->positions.push_back({1e-30F, 0, 0});
  mesh->triangles.push_back({0, 1, 4});
  mesh->triangles.push_back({0, 0, 0});
  mesh->triangles.push_back({0, 5, 1});
  mesh->normals.assign(mesh->positions.size(), {nan, 0, 0});
  broken.meshes[0] = mesh;
  LightTable table = low_sun({10, 10, 10});
  for (const float bad : {nan, -1.0F, std::numeric_limits<float>::infinity(), 1e38F}) {
    LightTable odd = table;
    odd.lights.push_back({{0, 0, 1}, {bad, 0, 0}, 0.1F});
    const BouncedLight bounced(Scene(broken), odd, {.lamps = 8});
    for (const LocalLight& lamp : bounced.lamps(table.lights.size() == 1 ? odd : table)) {
      EXPECT_TRUE(std::isfinite(length(lamp.position)));
      EXPECT_NEAR(length(lamp.normal), 1, 1e-4);
    }
  }
  for (const LocalLight& lamp : BouncedLight(Scene(broken), table, {.lamps = 8}).lamps(table)) {
    EXPECT_TRUE(std::isfinite(length(lamp.intensity)) && lamp.area_m2 > 0);
  }
  EXPECT_TRUE(BouncedLight(Scene(SceneDescription{}), table, {}).empty());
  EXPECT_TRUE(BouncedLight(Scene(broken), {}, {}).empty());
  EXPECT_TRUE(BouncedLight(Scene(broken), table, {.lamps = 0}).empty());
  EXPECT_THROW(BouncedLight(Scene(broken), table, {.lamps = -1}), std::invalid_argument);
  EXPECT_THROW(BouncedLight(Scene(broken), table, {.lamps = most_lights + 1}),
               std::invalid_argument);
  EXPECT_THROW(BouncedLight(Scene(broken), table, {.points = 0}), std::invalid_argument);
  EXPECT_THROW(BouncedLight(Scene(broken), table, {.points = most_bounce_points + 1}),
               std::invalid_argument);
}

TEST(BounceLamps, AreFoundAnewWhereSomethingMovesOrThePlanChanges) {
  SceneDescription description = floor_and_lid(matte(0.5F, 0.5F, 0.5F), 1);
  description.instances[1].moves = true;
  const Scene still(description);
  LightTable table = low_sun({10, 10, 10});
  table.lights[0].planned = {10, 10, 10};
  const BounceSettings settings{.lamps = 16};
  BounceFollower follower;
  const auto first = follower.follow(still, table, settings);
  EXPECT_EQ(first, BouncedLight(still, table, settings).lamps(table));

  LightTable brighter = table;
  brighter.lights[0].irradiance *= 2;
  const auto live = follower.follow(still, brighter, settings);
  ASSERT_EQ(live.size(), first.size());
  EXPECT_EQ(live[3].position, first[3].position);
  EXPECT_EQ(live[3].planned, first[3].planned);
  EXPECT_GT(live[3].intensity.x, 1.9F * first[3].intensity.x);

  description.instances[1].set_from_object[11] = 0.5F;
  const Scene moved(description, still);
  EXPECT_EQ(follower.follow(moved, table, settings),
            BouncedLight(moved, table, settings).lamps(table));
  // Or where what deforms has another shape.
  auto shape = std::make_shared<Mesh>(*description.meshes[1]);
  shape->rest = std::make_shared<const std::vector<Vec3f>>(shape->positions);
  description.meshes[1] = shape;
  const Scene at_rest(description, moved);
  follower.follow(at_rest, table, settings);
  auto bent = std::make_shared<Mesh>(*shape);
  for (Vec3f& p : bent->positions) p.z += 0.3F * p.x;
  description.meshes[1] = bent;
  const Scene deformed(description, at_rest);
  EXPECT_EQ(follower.follow(deformed, table, settings),
            BouncedLight(deformed, table, settings).lamps(table));

  LightTable planned = table;
  planned.lights[0].planned = planned.lights[0].irradiance = {1, 10, 20};
  EXPECT_EQ(follower.follow(moved, planned, settings),
            BouncedLight(moved, planned, settings).lamps(planned));
  EXPECT_TRUE(follower.follow(moved, table, {.lamps = 0}).empty());
  EXPECT_EQ(follower.follow(still, table, settings), first);
  // A table that is full has no room for more.
  LightTable full = table;
  full.lamps.assign(most_lights - 3, {{0, 0, 0.5F}, {}, {1e-3F, 0, 0}});
  EXPECT_EQ(follower.follow(still, full, {.lamps = 16, .points = 64}).size(), 3U);
}

}  // namespace
}  // namespace render::bounce_lamps_test
