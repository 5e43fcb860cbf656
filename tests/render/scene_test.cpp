// Scenes: what Embree's hits mean, instances, holes, damage.
#include "render/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "plain_shapes.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render::scene_test {
namespace {

std::shared_ptr<Mesh> square(float z, std::uint32_t material) {
  auto mesh = std::make_shared<Mesh>();
  mesh->positions = {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
  mesh->uvs = {{{0, 1}}, {{1, 1}}, {{1, 0}}, {{0, 0}}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {material};
  return mesh;
}

SceneDescription one_square(StandardParameters parameters = {}) {
  SceneDescription scene;
  scene.meshes.push_back(square(1, 0));
  scene.materials.push_back(make_standard_material("m", parameters));
  scene.instances.emplace_back().mesh = 0;
  return scene;
}

std::optional<TracedHit> look_down(const Scene& scene, Vec3f from) {
  return closest_hit(scene, from, {0, 0, -1}, 0, ~0U, RayKind::camera);
}

TEST(Scene, GivesPositionNormalAndTextureCoordinatesOfAHit) {
  const Scene scene(one_square());
  const auto hit = look_down(scene, {0.5F, -0.25F, 5});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 4, 1e-5F);
  const HitPoint point =
      scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u, hit->v, {0, 0, -1});
  EXPECT_NEAR(point.position.x, 0.5F, 1e-6F);
  EXPECT_NEAR(point.position.y, -0.25F, 1e-6F);
  EXPECT_NEAR(point.position.z, 1, 1e-6F);
  EXPECT_EQ(point.normal, (Vec3f{0, 0, 1}));
  EXPECT_NEAR(point.u, 0.75F, 1e-6F);
  EXPECT_NEAR(point.v, 0.625F, 1e-6F);
  EXPECT_NEAR(point.uv_per_metre, 0.5F, 1e-6F);
  EXPECT_NEAR(length(point.u_slope - Vec3f{0.5F, 0, 0}), 0, 1e-6F);
  EXPECT_NEAR(length(point.v_slope - Vec3f{0, -0.5F, 0}), 0, 1e-6F);
}

TEST(TurnOfNormal, IsOneOverTheRadiusOnASphereWhicheverWay) {
  for (const bool twice : {false, true}) {
    // Twice: through Embree's instances. The second one's scale makes the radius 6.
    SceneDescription description = make_scene(make_sphere(2, 96), {});
    if (twice) {
      description.instances.push_back(description.instances[0]);
      description.instances[0].set_from_object = {3, 0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0};
      description.instances[1].set_from_object[3] = 100;
    }
    const float radius = twice ? 6 : 2;
    const Scene scene(description);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(-0.6F, 0.6F);
    for (int i = 0; i < 50; ++i) {
      const Vec3f from{place(random) * radius, place(random) * radius, 20};
      const auto hit = look_down(scene, from);
      ASSERT_TRUE(hit);
      const HitPoint point =
          scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u, hit->v, {0, 0, -1});
      for (const Vec3f way : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{1, -1, 0}}) {
        const Vec3f step = normalize(cross(way, point.geometric_normal)) * 0.01F;
        EXPECT_LE(length(turn_of_normal(point, step) * radius - step), 0.05F * length(step));
      }
    }
  }
}

TEST(TurnOfNormal, IsNoneOnAFlatSurface) {
  const Scene scene(one_square());
  const auto hit = look_down(scene, {0.5F, -0.25F, 5});
  ASSERT_TRUE(hit);
  const HitPoint point =
      scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u, hit->v, {0, 0, -1});
  EXPECT_EQ(turn_of_normal(point, {1, 0, 0}), Vec3f{});
}

TEST(Scene, GivesTheSameHitPlacedOnceOrAsAnInstance) {
  SceneDescription once = one_square();
  once.instances[0].set_from_object = {0, -2, 0, 3, 1, 0, 0, 4, 0, 0, 3, 5};
  SceneDescription twice = once;
  twice.instances.push_back(once.instances[0]);
  twice.instances[1].set_from_object[3] = 100;
  const Scene a(once), b(twice);
  const auto hit_a = look_down(a, {3.2F, 4.1F, 20}), hit_b = look_down(b, {3.2F, 4.1F, 20});
  ASSERT_TRUE(hit_a && hit_b);
  const auto point = [](const Scene& scene, const TracedHit& h) {
    return scene.hit_point(h.geom_id, h.prim_id, h.inst_id, h.u, h.v, {0, 0, -1});
  };
  const HitPoint p = point(a, *hit_a), q = point(b, *hit_b);
  EXPECT_NEAR(length(p.position - q.position), 0, 1e-5F);
  EXPECT_NEAR(length(p.normal - q.normal), 0, 1e-6F);
  EXPECT_NEAR(p.u, q.u, 1e-5F);
  EXPECT_EQ(p.instance, q.instance);
  EXPECT_TRUE(look_down(b, {100, 4.1F, 20}));
}

TEST(Scene, MovesWhatIsToldToMoveWithoutBuildingAnew) {
  SceneDescription description = one_square();
  description.meshes.push_back(square(1, 0));
  description.instances.emplace_back().mesh = 1;
  description.instances[1].set_from_object[11] = 1;
  description.instances[1].moves = true;
  const Scene before(description);
  description.instances[1].set_from_object = {0, -1, 0, 30, 1, 0, 0, 0, 0, 0, 1, 2};
  const Scene cold(description), warm(description, before);
  EXPECT_NE(before.id(), warm.id());
  for (const float x : {-0.3F, 0.2F, 29.9F, 30.3F, 50.0F}) {
    const auto a = look_down(cold, {x, 0.1F, 20}), b = look_down(warm, {x, 0.1F, 20});
    ASSERT_EQ(a.has_value(), b.has_value()) << x;
    EXPECT_EQ(a.has_value(), x < 40) << x;
    if (!a) continue;
    EXPECT_EQ(a->distance, b->distance);
    const HitPoint p = cold.hit_point(a->geom_id, a->prim_id, a->inst_id, a->u, a->v, {0, 0, -1});
    const HitPoint q = warm.hit_point(b->geom_id, b->prim_id, b->inst_id, b->u, b->v, {0, 0, -1});
    EXPECT_EQ(p.position, q.position);
    EXPECT_EQ(p.instance, x > 10 ? 1U : 0U);
    EXPECT_EQ(q.instance, p.instance);
    EXPECT_NEAR(p.position.z, x > 10 ? 3 : 1, 1e-5F);
  }
  EXPECT_EQ(cold.bounds().upper, warm.bounds().upper);
  EXPECT_GT(warm.bounds().upper.x, 30);
  EXPECT_EQ(cold.blocker_boxes().size(), warm.blocker_boxes().size());
  // Whatever else differs is built anew.
  description.instances[0].set_from_object[3] = -50;
  EXPECT_FALSE(look_down(Scene(description, warm), {0, 0.1F, 20}));
}

TEST(Scene, LeavesOutTrianglesThatAreNotFiniteAndCountsThem) {
  SceneDescription scene = one_square();
  auto mesh = std::make_shared<Mesh>(*scene.meshes[0]);
  mesh->positions[3].x = std::numeric_limits<float>::quiet_NaN();
  scene.meshes[0] = mesh;
  const Scene compiled(scene);
  EXPECT_EQ(compiled.skipped_triangles(), 1U);
  EXPECT_TRUE(look_down(compiled, {0.5F, -0.5F, 5}));
  EXPECT_FALSE(look_down(compiled, {-0.5F, 0.5F, 5}));
}

TEST(Scene, TakesTrianglesWithoutAreaAndThousandInstances) {
  SceneDescription scene = one_square();
  auto mesh = std::make_shared<Mesh>(*scene.meshes[0]);
  mesh->triangles.push_back({0, 0, 0});
  scene.meshes[0] = mesh;
  for (int i = 1; i < 1000; ++i) {
    Instance instance = scene.instances[0];
    instance.set_from_object[3] = 3.0F * static_cast<float>(i);
    scene.instances.push_back(instance);
  }
  const Scene compiled(scene);
  EXPECT_TRUE(look_down(compiled, {3 * 500.0F, 0, 5}));
  EXPECT_EQ(triangle_count(scene), 3000U);
}

TEST(Scene, IsEmptyWithoutObjects) {
  const Scene scene(SceneDescription{});
  EXPECT_FALSE(look_down(scene, {0, 0, 5}));
}

TEST(Scene, LetsTintedLightThroughGlassAndNoneThroughPaint) {
  StandardParameters glass;
  glass.transmission = 1;
  glass.base_color[0] = 0.5F;
  const Scene through(one_square(glass));
  const Vec3f share = transmittance(through, {0.3F, 0.1F, 0}, {0, 0, 1}, 0, ray_far, ~0U);
  EXPECT_NEAR(share.x, 0.96F * 0.5F, 1e-4F) << "4 % are reflected, half of the red is absorbed";
  EXPECT_NEAR(share.y, 0.96F, 1e-4F);
  StandardParameters dark;
  std::fill_n(dark.base_color, 3, 0.0F);
  dark.opacity = 0.25F;
  const Scene dim(one_square(dark));
  const Vec3f passed = transmittance(dim, {0.3F, 0.1F, 0}, {0, 0, 1}, 0, ray_far, ~0U);
  EXPECT_NEAR(passed.x, 0.96F * 0.75F, 1e-4F);
  const Scene blocked(one_square());
  EXPECT_EQ(transmittance(blocked, {0.3F, 0.1F, 0}, {0, 0, 1}, 0, ray_far, ~0U), Vec3f{});
}

// Grey, or the alpha of a picture that has one; the base colour's counts for nothing then.
TEST(Scene, HasHolesWhereAMapOfAlphaSays) {
  StandardParameters p;
  p.alpha_cutoff = 0.5F;
  p.base_color_texture = 0;
  p.alpha_texture = 1;
  SceneDescription description = one_square(p);
  const auto clear = std::make_shared<const Texture>(Texture{1, 1, 4, true, {255, 255, 255, 0}});
  for (const auto& [map, solid] : {std::pair(Texture{1, 1, 1, false, {255}}, true),
                                   {Texture{1, 1, 3, false, {0, 255, 255}}, false},
                                   {Texture{1, 1, 4, false, {0, 0, 0, 255}}, true},
                                   {Texture{1, 1, 2, false, {255, 0}}, false}}) {
    description.textures = {clear, std::make_shared<const Texture>(map)};
    EXPECT_EQ(look_down(Scene(description), {0.5F, -0.25F, 5}).has_value(), solid) << map.channels;
  }
}

// A large square through the origin, however it leans: there coordinates are small, its own are
// not.
TEST(OffsetOrigin, LeavesALeaningTriangleAlsoNearTheOrigin) {
  std::mt19937 engine(9);
  std::normal_distribution<float> random;
  int met = 0;
  for (int trial = 0; trial < 50; ++trial) {
    SceneDescription description = one_square();
    const Vec3f z = normalize(Vec3f{random(engine), random(engine), random(engine)});
    const Vec3f x = normalize(cross(z, Vec3f{random(engine), random(engine), random(engine)}));
    const Vec3f y = cross(z, x);
    const float size = trial % 2 == 0 ? 1.0F : 30.0F;
    auto mesh = std::make_shared<Mesh>(*description.meshes[0]);
    for (Vec3f& p : mesh->positions) p = (x * p.x + y * p.y) * size;
    description.meshes[0] = mesh;
    const Scene scene(description);
    for (int i = 0; i < 50; ++i) {
      const Vec3f from = z * 2 + x * (0.01F * random(engine)), to = y * (0.01F * random(engine));
      const auto hit = closest_hit(scene, from, normalize(to - from), 0, ~0U, RayKind::camera);
      ASSERT_TRUE(hit);
      const HitPoint point = scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u,
                                             hit->v, normalize(to - from));
      Vec3f away = normalize(Vec3f{random(engine), random(engine), random(engine)});
      if (dot(away, point.geometric_normal) < 0) away = -away;
      const Vec3f origin = offset_origin(point, away);
      met += closest_hit(scene, origin, away, 0, ~0U, RayKind::reflection).has_value();
      EXPECT_LT(length(origin - point.position), 1e-4F);
    }
  }
  EXPECT_EQ(met, 0);
}

// What stands on a floor far from the set's origin is still met by rays that begin on the floor.
TEST(OffsetOrigin, IsSmallAndEnoughFarAway) {
  std::mt19937 engine(11);
  std::normal_distribution<float> random;
  int met = 0;
  for (const float far_m : {100.0F, 1000.0F, 10000.0F}) {
    for (int trial = 0; trial < 40; ++trial) {
      SceneDescription description = one_square();
      const Vec3f z = normalize(Vec3f{random(engine), random(engine), random(engine)});
      const Vec3f x = normalize(cross(z, Vec3f{random(engine), random(engine), random(engine)}));
      const Vec3f y = cross(z, x);
      const Vec3f at = normalize(Vec3f{random(engine), random(engine), random(engine)}) * far_m;
      const float size = trial % 2 == 0 ? 1.0F : 30.0F;
      auto mesh = std::make_shared<Mesh>(*description.meshes[0]);
      const bool placed = trial % 4 < 2;
      for (Vec3f& p : mesh->positions) p = (x * p.x + y * p.y) * size + (placed ? Vec3f{} : at);
      description.meshes[0] = mesh;
      if (placed) {
        description.instances[0].set_from_object = {1, 0, 0, at.x, 0, 1, 0, at.y, 0, 0, 1, at.z};
      }
      const Scene scene(description);
      for (int i = 0; i < 40; ++i) {
        const Vec3f to = at + (x * random(engine) + y * random(engine)) * (0.2F * size);
        const Vec3f from = at + (z * 2 + x * random(engine)) * size;
        const Vec3f direction = normalize(to - from);
        const auto hit = closest_hit(scene, from, direction, 0, ~0U, RayKind::camera);
        if (!hit) continue;
        const HitPoint point =
            scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u, hit->v, direction);
        Vec3f away = normalize(Vec3f{random(engine), random(engine), random(engine)});
        if (dot(away, point.geometric_normal) < 0) away = -away;
        // Half of them graze.
        if (i % 2 == 0) {
          away = normalize(away -
                           point.geometric_normal * (0.98F * dot(away, point.geometric_normal)));
        }
        const Vec3f origin = offset_origin(point, away);
        met += closest_hit(scene, origin, away, 0, ~0U, RayKind::reflection).has_value();
        EXPECT_LT(length(origin - point.position), 3e-6F * far_m + 4e-5F);
      }
    }
  }
  EXPECT_EQ(met, 0);
}

TEST(Scene, RefusesWhatDoesNotFitTogether) {
  const auto refuse = [](auto&& change) {
    SceneDescription scene = one_square();
    change(scene);
    EXPECT_THROW(Scene{scene}, std::invalid_argument);
  };
  refuse([](SceneDescription& s) { s.instances[0].mesh = 1; });
  refuse([](SceneDescription& s) { s.instances[0].set_from_object[0] = INFINITY; });
  refuse([](SceneDescription& s) { s.materials.clear(); });
  refuse([](SceneDescription& s) { s.materials[0].shader = "nothing"; });
  refuse([](SceneDescription& s) { s.materials[0].parameters.resize(3); });
  refuse([](SceneDescription& s) { s.background = "nothing"; });
  refuse([](SceneDescription& s) {
    auto mesh = std::make_shared<Mesh>(*s.meshes[0]);
    mesh->triangles[0][1] = 4;
    s.meshes[0] = mesh;
  });
}

}  // namespace
}  // namespace render::scene_test
