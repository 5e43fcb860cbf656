// Caustics against closed forms, and what they must hold.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "plain_shapes.h"
#include "render/caustics.h"
#include "render/glass.h"

namespace render::caustics_test {
namespace {

using std::numbers::pi;

// A body of glass over a dull floor of half width 20 at z = 0.
SceneDescription over_floor(std::shared_ptr<const Mesh> body,
                            const GlassParameters& glass,
                            Vec3f position) {
  StandardParameters dull;
  dull.roughness = 1;
  dull.specular = 0;
  SceneDescription scene = make_scene(make_square(20), dull);
  auto mesh = std::make_shared<Mesh>(*body);
  mesh->materials = {1};
  scene.meshes.push_back(mesh);
  scene.materials.push_back(make_glass_material("glass", glass));
  Instance& instance = scene.instances.emplace_back();
  instance.mesh = 1;
  instance.moves = true;
  auto& m = instance.set_from_object;
  m[3] = position.x, m[7] = position.y, m[11] = position.z;
  return scene;
}

LightTable sun(Vec3f direction, float spread = 0, Vec3f irradiance = {1, 1, 1}) {
  LightTable table;
  table.lights = {{normalize(direction), irradiance, spread, 1}};
  return table;
}

PhotonSettings photons(int count, float accuracy = 0.999F) { return {count, accuracy}; }

Caustics find(const Scene& scene, const LightTable& table, const PhotonSettings& settings) {
  return {std::make_shared<Photons>(scene, table, settings), {}};
}

float irradiance(const Caustics& caustics, float x, float y) {
  if (caustics.photons().lights().empty()) return 0;  // no body has any extent
  return caustics.at(0, {x, y, 0}, {0, 0, 1}).x;
}

double fresnel_at(double sine, double index) {
  return fresnel(static_cast<float>(std::sqrt(1 - sine * sine)), static_cast<float>(1 / index));
}

// Of a ball of radius 1 whose middle is `height` over the floor, under the sun in the zenith: the
// share that gets through of light at a distance from the axis, and where it falls, to which side.
struct Through {
  double share, distance;
};
Through through_ball(double from_axis, double index, double height) {
  const double in = std::asin(from_axis), inside = std::asin(from_axis / index);
  const double mirrored = fresnel_at(from_axis, index);
  const double out = in + pi - 2 * inside, turn = 2 * (in - inside);  // from the zenith
  const double x = std::sin(out), z = std::cos(out) + height;
  return {(1 - mirrored) * (1 - mirrored), x - z * std::tan(turn)};
}

// Irradiance in rings of the floor, by many rays.
std::vector<double> rings_under_ball(double index, double height, double width, int rings) {
  std::vector<double> light(static_cast<std::size_t>(rings));
  constexpr int rays = 500'000;
  for (int i = 0; i < rays; ++i) {
    const double b = (i + 0.5) / rays;
    const Through through = through_ball(b, index, height);
    const auto ring = static_cast<int>(std::abs(through.distance) / width);
    if (ring < rings) light[static_cast<std::size_t>(ring)] += through.share * 2 * pi * b / rays;
  }
  for (int i = 0; i < rings; ++i) {
    light[static_cast<std::size_t>(i)] /= pi * width * width * (2 * i + 1);
  }
  return light;
}

double mean_in_ring(const Caustics& caustics, double width, int ring) {
  double sum = 0;
  constexpr int turns = 4, across = 400;
  for (int i = 0; i < across; ++i) {
    const double r = width * (ring + (i + 0.5) / across);
    for (int j = 0; j < turns; ++j) {
      const double turn = 2 * pi * (j + 0.37) / turns;
      sum += r * irradiance(caustics, static_cast<float>(r * std::cos(turn)),
                            static_cast<float>(r * std::sin(turn)));
    }
  }
  return sum / (across * turns) / (width * (ring + 0.5));
}

TEST(Caustics, UnderABallAreThoseOfGeometricalOptics) {
  for (const double index : {1.33, 1.5, 1.8}) {
    const double height = 1.3;
    const Scene scene(over_floor(make_sphere(1, 256), {.index = static_cast<float>(index)},
                                 {0, 0, static_cast<float>(height)}));
    const Caustics caustics = find(scene, sun({0, 0, 1}), photons(100'000));
    constexpr double width = 0.05;
    constexpr int rings = 12;
    const std::vector<double> truth = rings_under_ball(index, height, width, rings);
    double light = 0, error = 0;
    for (int i = 0; i < rings; ++i) {
      const double found = mean_in_ring(caustics, width, i);
      const double expected = truth[static_cast<std::size_t>(i)];
      light += expected * (2 * i + 1);
      error += std::abs(found - expected) * (2 * i + 1);
    }
    EXPECT_LT(error, 0.03 * light) << index;
  }
}

TEST(Caustics, TakeTheTintOfBothSurfaces) {
  const Scene scene(over_floor(make_sphere(1, 64), {.tint = {1, 0.5F, 0}}, {0, 0, 1.3F}));
  const Caustics caustics = find(scene, sun({0, 0, 1}), photons(10'000));
  const Vec3f light = caustics.at(0, {0, 0, 0}, {0, 0, 1});
  EXPECT_GT(light.x, 1);
  EXPECT_NEAR(light.y, 0.25 * light.x, 1e-3 * light.x);
  EXPECT_LT(light.z, 0.01 * light.x) << "mirrored off it alone";
}

TEST(Caustics, LetThroughASlabWhatItsSurfacesDo) {
  for (const float index : {1.0F, 1.33F, 1.5F, 2.0F}) {
    const Scene scene(
        over_floor(make_box({-1, -1, 0}, {1, 1, 0.1F}), {.index = index}, {0, 0, 0.5F}));
    const Caustics caustics = find(scene, sun({0, 0, 1}), photons(20'000, 1));
    const double once = 1 - fresnel(1, 1 / index);
    const double all = once / (2 - once);  // T / (2 - T): every reflection inside
    for (const float x : {-0.6F, 0.0F, 0.31F, 0.7F}) {
      EXPECT_NEAR(irradiance(caustics, x, 0.1F), all, 0.006) << index << " at " << x;
    }
  }
}

// Two halves of a slab, each with photons of its own, are as one.
TEST(Caustics, CountEveryPhotonOnce) {
  SceneDescription halves =
      over_floor(make_box({-1, -1, 0}, {0, 1, 0.1F}), {.index = 1.3F}, {0, 0, 0.5F});
  auto right = std::make_shared<Mesh>(*make_box({-0.2F, -1, 0.3F}, {1, 1, 0.4F}));
  right->materials = {1};
  halves.meshes.push_back(right);
  halves.instances.push_back(halves.instances.back());
  halves.instances.back().mesh = 2;
  const Scene scene(std::move(halves));
  const Caustics caustics = find(scene, sun({0, 0, 1}), photons(40'000, 1));
  const float once = 1 - fresnel(1, 1 / 1.3F), one = once / (2 - once);
  EXPECT_NEAR(irradiance(caustics, -0.6F, 0.1F), one, 0.006);
  EXPECT_NEAR(irradiance(caustics, 0.6F, 0.1F), one, 0.006);
  // Where one is over the other, all of both.
  const float mirrored = 1 - one, both = one * one / (1 - mirrored * mirrored);
  EXPECT_NEAR(irradiance(caustics, -0.1F, 0.1F), both, 0.008);
}

TEST(Caustics, FallNowhereThatIsInShadow) {
  SceneDescription shaded = over_floor(make_sphere(1, 64), {}, {0, 0, 1.3F});
  shaded.meshes.push_back(make_square(2, 5));
  shaded.instances.emplace_back().mesh = 2;
  const Scene scene(std::move(shaded));
  const auto landed = [&](const LightTable& table) {
    return Photons(scene, table, photons(1000)).landings()[0].size();
  };
  EXPECT_EQ(landed(sun({0, 0, 1})), 0U);
  EXPECT_GT(landed(sun({1, 0, 0.3F})), 100U);
}

TEST(Caustics, TakeTheBrightestLightsThatMatter) {
  const Scene scene(over_floor(make_sphere(1, 16), {}, {0, 0, 1.3F}));
  LightTable table;
  for (int i = 0; i < 100; ++i) {
    const float e = i % 4 == 0 ? 3.0F + static_cast<float>(i) : 0.1F;
    table.lights.push_back(
        {normalize(Vec3f{0.01F * static_cast<float>(i), 0, 1}), {e, e, e}, 0.1F});
  }
  const Photons caustics(scene, table, photons(1000));
  ASSERT_EQ(caustics.lights().size(), most_caustic_lights);
  for (const std::uint32_t light : caustics.lights()) {
    EXPECT_EQ(light % 4, 0U);
    EXPECT_TRUE(caustics.follows(light));
  }
  EXPECT_FALSE(caustics.follows(1));
  EXPECT_FALSE(caustics.follows(12345));
}

TEST(Caustics, AreFoundAnewOnlyWhereTheyMayChange) {
  SceneDescription description = over_floor(make_sphere(1, 32), {}, {0, 0, 1.3F});
  const Scene scene(description);
  CausticFollower follower;
  const LightTable table = sun({0, 0, 1});
  const auto follow = [&](const Scene& now, int count, const CausticView& view = {}) {
    return follower.follow(now, table, photons(count), view);
  };
  const auto first = follow(scene, 500);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(follow(scene, 500), first);
  EXPECT_NE(follow(scene, 600), first);
  const auto again = follow(scene, 500);
  EXPECT_EQ(again->key(), first->key());
  description.instances[1].set_from_object[3] = 0.5F;
  const Scene moved(description, scene);
  const auto after = follow(moved, 500);
  EXPECT_NE(after->key(), first->key());
  EXPECT_EQ(after->key(), find(moved, table, photons(500)).key());
  // Something dull that no photon meets, and then one does.
  description.meshes.push_back(make_square(0.1F));
  description.instances.push_back(description.instances[0]);
  description.instances[2].mesh = 2;
  description.instances[2].moves = true;
  description.instances[2].set_from_object[3] = 9;
  const Scene aside(description);
  const auto alone = follow(aside, 500);
  description.instances[2].set_from_object[3] = 9.5F;
  const Scene farther(description, aside);
  EXPECT_EQ(follow(farther, 500), alone);
  description.instances[2].set_from_object[3] = 0.5F;
  description.instances[2].set_from_object[11] = 3;
  const Scene above(description, farther);
  const auto shaded = follow(above, 500);
  EXPECT_NE(shaded->key(), alone->key());
  EXPECT_EQ(shaded->key(), find(above, table, photons(500)).key());
  // Another camera sees the same photons.
  const auto seen = follow(above, 500, {{3, 0, 2}, 0.01F});
  EXPECT_EQ(&seen->photons(), &shaded->photons());
  EXPECT_NE(seen->key(), shaded->key());
  EXPECT_EQ(follow(above, 0), nullptr);
}

// Glass that has few photons beside glass that has all lets light through; what lies under a board
// gets none.
TEST(Caustics, LeaveNoBodyWithoutPhotonsAndNoLightUnderABoard) {
  SceneDescription description =
      over_floor(make_box({-10, -10, 0}, {10, 10, 0.1F}), {.index = 1.2F}, {0, 0, 2});
  auto small = std::make_shared<Mesh>(*make_box({14, 0, 0.4F}, {14.1F, 0.1F, 0.41F}));
  small->materials = {1};
  description.meshes.push_back(small);
  description.instances.push_back(description.instances.back());
  description.instances.back().mesh = 2;
  auto board = std::make_shared<Mesh>(*make_box({-1, -1, 0.05F}, {1, 1, 0.06F}));
  description.meshes.push_back(board);
  description.instances.emplace_back().mesh = 3;
  const Scene scene(std::move(description));
  // One photon spreads its light over twice the distance to the next.
  EXPECT_GT(irradiance(find(scene, sun({0, 0, 1}), photons(500)), 14.05F, 0.05F), 0.2F);
  const Caustics fine = find(scene, sun({0, 0, 1}), photons(200'000));
  EXPECT_EQ(irradiance(fine, 0, 0), 0);
  EXPECT_GT(fine.at(0, {0, 0, 0.06F}, {0, 0, 1}).x, 0.9F);
}

// Jobs come by wire: their lights may be any finite numbers.
TEST(Caustics, TakeLightsOfAnyFiniteNumbers) {
  const Scene scene(over_floor(make_sphere(1, 16), {}, {0, 0, 1.3F}));
  for (const Vec3f other : {Vec3f{-100, -1, -1}, Vec3f{1e37F, 1e37F, 1e37F}, Vec3f{0, 0, 0}}) {
    LightTable table = sun({0, 0, 1});
    table.lights.push_back({{0, 1, 0}, other, 0.1F});
    table.lights.push_back({{0, 0.6F, 0.8F}, {1.9F, 0, 0}, 0.1F});
    table.lights.push_back({{0, -0.6F, 0.8F}, {-1.9F, 0, 0}, 0.1F});
    const Photons found(scene, table, photons(1000));
    EXPECT_FALSE(found.follows(3));
    EXPECT_LT(found.rays(), 200'000U);
  }
}

// A pane that is seen on edge, bodies in bodies: neither takes photons, or rays, without end.
TEST(Caustics, TakeNoMoreRaysThanTheyMay) {
  SceneDescription nested = over_floor(make_sphere(1, 24), {.index = 4}, {0, 0, 6});
  for (int i = 1; i < 40; ++i) {
    nested.instances.push_back(nested.instances.back());
    auto& m = nested.instances.back().set_from_object;
    m[0] = m[5] = m[10] = 1 - static_cast<float>(i) / 50;
    m[3] = static_cast<float>(i) / 40;
  }
  const Scene balls(std::move(nested));
  EXPECT_LT(Photons(balls, sun({0, 0.1F, 1}), photons(4000, 1)).rays(), 130U * 6000);
  const Scene pane(over_floor(make_box({-50, -1e-6F, 0}, {50, 1e-6F, 1e-6F}), {}, {0, 0, 2}));
  EXPECT_LT(Photons(pane, sun({0, 0, 1}), photons(4000)).rays(), 130U * 6000);
}

TEST(Caustics, StayFiniteWhateverTheBody) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  auto open = std::make_shared<Mesh>(*make_sphere(1, 16));
  open->triangles.resize(open->triangles.size() / 2);
  auto inside_out = std::make_shared<Mesh>(*make_sphere(1, 16));
  for (auto& [a, b, c] : inside_out->triangles) std::swap(a, b);
  for (Vec3f& n : inside_out->normals) n = -n;
  auto broken = std::make_shared<Mesh>(*make_sphere(1, 16));
  for (std::size_t i = 0; i < broken->positions.size(); i += 7) broken->positions[i].x = nan;
  auto twice = std::make_shared<Mesh>(*make_box({-1, -1, -1}, {1, 1, 1}));
  const std::size_t triangles = twice->triangles.size();
  for (std::size_t i = 0; i < triangles; ++i) twice->triangles.push_back(twice->triangles[i]);
  auto tiny = std::make_shared<Mesh>(*make_sphere(1e-3F, 16));
  auto nothing = std::make_shared<Mesh>(*make_box({0, 0, 0}, {0, 0, 0}));
  for (const auto& body : {open, inside_out, broken, twice, tiny, nothing}) {
    for (const float away : {0.0F, 1e4F}) {
      const Scene scene(over_floor(body, {.index = 1.5F}, {away, 0, 1.1F}));
      for (const Vec3f direction : {Vec3f{0, 0, 1}, Vec3f{1, 0, 0.001F}, Vec3f{0, 1, -1}}) {
        const Caustics caustics = find(scene, sun(direction, 0.01F), photons(800));
        for (float x = -2; x <= 2; x += 0.13F) {
          const float e = irradiance(caustics, away + x, 0.2F);
          ASSERT_TRUE(std::isfinite(e) && e >= 0) << e;
        }
      }
    }
  }
}

}  // namespace
}  // namespace render::caustics_test
