// The cones of samples: how rays part at curved surfaces, and what wide ones see.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "render/glass.h"
#include "render/shader.h"
#include "render/trace.h"
#include "tests/render/plain_shapes.h"
#include "tests/render/sun_and_sky.h"

namespace render::ray_cones_test {
namespace {

struct Pushed final : RaySink {
  std::vector<NewRay> rays;
  void push(const ShadePoint&, const NewRay& ray) override { rays.push_back(ray); }
};

struct Ray {
  Vec3f origin, direction;
  Spread steps, turns;
  Media media;
};

// The ray after a surface of glass: refracted, or mirrored.
std::optional<Ray> next(const Scene& scene, const Ray& ray, bool refracted) {
  const auto hit = closest_hit(scene, ray.origin, ray.direction, 0, ~0U, RayKind::camera);
  if (!hit) return std::nullopt;
  ShadePoint p{};
  p.hit = scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u, hit->v, ray.direction);
  p.incoming = ray.direction;
  p.throughput = {1, 1, 1};
  p.media = ray.media;
  arrive(p, ray.steps, ray.turns, hit->distance);
  ShadePoint* const point = &p;
  Pushed pushed;
  find_shader("glass")->shade({&scene.description(), &scene}, {&point, 1}, pushed);
  if (pushed.rays.size() != 2) return std::nullopt;  // beyond the critical angle
  const NewRay& chosen = pushed.rays[refracted ? 1 : 0];
  return Ray{chosen.origin, chosen.direction, p.steps, chosen.spread,
             chosen.media.value_or(Media())};
}

// In, mirrored inside so often, and out.
std::optional<Ray> through_ball(const Scene& scene, Ray ray, int mirrored) {
  for (int k = 0; k < mirrored + 2; ++k) {
    const auto after = next(scene, ray, k == 0 || k == mirrored + 1);
    if (!after) return std::nullopt;
    ray = *after;
  }
  return ray;
}

TEST(RayCone, IsWhatNeighbouringRaysOfABallOfGlassPartBy) {
  SceneDescription description;
  description.meshes = {make_sphere(1, 192)};
  description.materials = {make_glass_material("glass", {})};
  description.instances.resize(1);
  const Scene scene(description);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-0.7F, 0.7F);
  constexpr float apart = 2e-3F;
  int compared = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Vec3f from{place(random), -4, place(random)};
    const Vec3f direction = normalize(Vec3f{place(random), 0, place(random)} - from);
    const Vec3f a = normalize(cross(direction, {0, 0, 1})), b = cross(direction, a);
    for (int mirrored = 0; mirrored < 3; ++mirrored) {
      const Spread turns{a * apart, b * apart};
      const auto middle = through_ball(scene, {from, direction, {}, turns, {}}, mirrored);
      for (const bool first : {true, false}) {
        const Vec3f turned = normalize(direction + (first ? turns.a : turns.b));
        const auto other = through_ball(scene, {from, turned, {}, turns, {}}, mirrored);
        ASSERT_TRUE(middle && other);
        const Vec3f parted = other->direction - middle->direction;
        const Vec3f told = first ? middle->turns.a : middle->turns.b;
        EXPECT_LE(length(parted - told), 0.12F * length(parted) + 0.1F * apart)
            << "trial " << trial << ", mirrored " << mirrored << " times";
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 240);
}

// Its diameters may be any two that are conjugate: those of rays that went through glass lean.
TEST(RayCone, SeesTheSameByAnyOfItsDiameters) {
  Environment env = make_sun_and_sky({.sun_radius_rad = 0.03F}, 256);
  smooth_for_reflections(env);
  const Vec3f sun = sun_direction({});
  const Vec3f a = normalize(cross(sun, {0, 0, 1})), b = cross(sun, a);
  for (const float away : {0.0F, 0.05F, 0.1F}) {
    const Vec3f d = normalize(sun + a * away);
    const Spread cone{a * 0.25F, b * 0.05F};
    const float straight = radiance_of(env, d, 0, cone).y;
    for (int i = 0; i < 12; ++i) {
      const float angle = 0.5F * static_cast<float>(i), c = std::cos(angle), s = std::sin(angle);
      const Spread leaning{cone.a * c + cone.b * s, cone.b * c - cone.a * s};
      EXPECT_NEAR(radiance_of(env, d, 0, leaning).y / straight, 1, 0.01) << away << ", " << angle;
    }
  }
}

}  // namespace
}  // namespace render::ray_cones_test
