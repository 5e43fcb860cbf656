// Parts that glow: where they are cut, and which are small to a camera.
#include "render/glowing_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/render/plain_shapes.h"

namespace render::glowing_parts_test {
namespace {

constexpr std::array<float, 12> unmoved{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

void add_box(Mesh& mesh, Vec3f centre, float half, std::uint32_t material) {
  const auto box = make_box(centre - Vec3f{half, half, half}, centre + Vec3f{half, half, half});
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), box->positions.begin(), box->positions.end());
  for (const auto& [a, b, c] : box->triangles) {
    mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.materials.push_back(material);
  }
}

TEST(GlowingParts, AreApartWhereGapsAre) {
  Mesh mesh;
  for (int i = 0; i < 27; ++i) {
    const auto n = [](int k) { return static_cast<float>(k); };
    add_box(mesh, {n(i % 3), n(i / 3 % 3), n(i / 9)}, 0.1F, i % 2 == 0 ? 1U : 0U);
  }
  const std::vector<float> glow{0, 3};
  const auto parts = find_glowing_parts(mesh, {2, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0}, glow);
  ASSERT_EQ(parts.size(), 14U);
  for (const auto& [part, radiance] : parts) {
    EXPECT_EQ(radiance, 3);
    EXPECT_NEAR(part.upper.x - part.lower.x, 0.4F, 1e-5F);
    EXPECT_NEAR(part.upper.y - part.lower.y, 0.2F, 1e-5F);
    EXPECT_NEAR(std::remainder(0.5F * (part.lower.x + part.upper.x) - 5, 2), 0, 1e-5F);
  }
  EXPECT_TRUE(find_glowing_parts(mesh, unmoved, std::vector<float>{0, 0}).empty());
}

TEST(GlowingParts, AreOneWhereTheyTouchAndLeaveOutWhatIsNotFinite) {
  Mesh mesh;
  for (int i = 0; i < 5; ++i) add_box(mesh, {0.2F * static_cast<float>(i), 0, 0}, 0.1F, 0);
  add_box(mesh, {9, NAN, 0}, 0.1F, 0);
  const std::vector<float> glow{1};
  const auto parts = find_glowing_parts(mesh, unmoved, glow);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_NEAR(parts[0].bounds.upper.x, 0.9F, 1e-5F);
}

// A screen of very many lights must not make every frame wait.
TEST(GlowingParts, StayTogetherBeyondSoMany) {
  Mesh mesh;
  for (int i = 0; i < 100 * 100; ++i) {
    add_box(mesh, {static_cast<float>(i % 100), static_cast<float>(i / 100), 0}, 0.1F, 0);
  }
  const auto parts = find_glowing_parts(mesh, unmoved, std::vector<float>{1});
  EXPECT_LE(parts.size(), most_glowing_parts + 100);
}

TEST(SmallLights, AreLessThanTwoPixelsWide) {
  const std::vector<Scene::GlowingPart> parts{{{{-0.1F, 9.9F, -0.1F}, {0.1F, 10.1F, 0.1F}}, 5},
                                              {{{-1, 9, -1}, {1, 11, 1}}, 5},
                                              {{{-1, -1, -1}, {1, 1, 1}}, 5},
                                              {{{3e38F, 3e38F, 0}, {3e38F, 3e38F, 0}}, 5}};
  // The camera looks along y, with x to its right.
  CameraTurn turn;
  turn.set_from_cam = {1, 0, 0, 0, 0, 1, 0, -1, 0};
  const auto lights = find_small_lights(parts, {0, 0, 0}, turn, 0.02F);
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_NEAR(lights[0].direction.z, 1, 1e-6F);
  EXPECT_NEAR(lights[0].half_rad, 0.0173F, 1e-4F);
}

}  // namespace
}  // namespace render::glowing_parts_test
