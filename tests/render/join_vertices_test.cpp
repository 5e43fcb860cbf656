// Joined vertices: the same surface, with fewer of them, and with normals.
#include "render/join_vertices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>

namespace render::join_vertices_test {
namespace {

// Every triangle with corners of its own.
Mesh soup_of(const Mesh& mesh) {
  Mesh soup;
  soup.materials = {0};
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.positions.size());
    for (const std::uint32_t corner : triangle) {
      soup.positions.push_back(mesh.positions[corner]);
      if (!mesh.uvs.empty()) soup.uvs.push_back(mesh.uvs[corner]);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

Mesh made_box() {
  Mesh mesh;
  for (unsigned i = 0; i < 8; ++i) {
    mesh.positions.push_back({i & 1U ? 1.0F : 0.0F, i & 2U ? 2.0F : 0.0F, i & 4U ? 3.0F : 0.0F});
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.materials = {0};
  return mesh;
}

Mesh made_ball(int rings, int around) {
  Mesh mesh;
  for (int r = 0; r <= rings; ++r) {
    for (int a = 0; a < around; ++a) {
      const double polar = std::numbers::pi * r / rings, turn = 2 * std::numbers::pi * a / around;
      const double radius = r == 0 || r == rings ? 0 : std::sin(polar);
      mesh.positions.push_back({static_cast<float>(radius * std::cos(turn)),
                                static_cast<float>(radius * std::sin(turn)),
                                static_cast<float>(std::cos(polar))});
    }
  }
  const auto at = [&](int r, int a) { return static_cast<std::uint32_t>(r * around + a % around); };
  for (int r = 0; r < rings; ++r) {
    for (int a = 0; a < around; ++a) {
      if (r > 0) mesh.triangles.push_back({at(r, a), at(r + 1, a), at(r, a + 1)});
      if (r + 1 < rings) mesh.triangles.push_back({at(r, a + 1), at(r + 1, a), at(r + 1, a + 1)});
    }
  }
  mesh.materials = {0};
  return mesh;
}

void expect_same_surface(const Mesh& a, const Mesh& b) {
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (std::size_t t = 0; t < a.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(a.positions[a.triangles[t][k]], b.positions[b.triangles[t][k]]);
      if (!a.uvs.empty()) {
        EXPECT_EQ(a.uvs[a.triangles[t][k]], b.uvs[b.triangles[t][k]]);
      }
    }
  }
}

TEST(JoinVertices, KeepsTheEdgesOfABox) {
  for (const Mesh& box : {made_box(), soup_of(made_box())}) {
    Mesh joined = box;
    join_vertices(joined);
    EXPECT_EQ(joined.positions.size(), 24U);
    expect_same_surface(box, joined);
    for (const auto& [a, b, c] : joined.triangles) {
      const Vec3f face = normalize(cross(joined.positions[b] - joined.positions[a],
                                         joined.positions[c] - joined.positions[a]));
      for (const std::uint32_t corner : {a, b, c}) {
        EXPECT_GT(dot(joined.normals[corner], face), 0.99999F);
      }
    }
  }
}

TEST(JoinVertices, SmoothsABallWhateverManySharesItsPoles) {
  for (const int around : {60, 400}) {
    const Mesh soup = soup_of(made_ball(30, around));
    Mesh ball = soup;
    join_vertices(ball);
    EXPECT_EQ(ball.positions.size(), static_cast<std::size_t>(29 * around + 2));
    expect_same_surface(soup, ball);
    for (std::size_t i = 0; i < ball.positions.size(); ++i) {
      EXPECT_GT(dot(ball.normals[i], ball.positions[i]), 0.998F);
    }
  }
}

TEST(JoinVertices, KeepsSeamsOfTextureAndGivenNormals) {
  Mesh mesh = soup_of(made_box());
  mesh.uvs.resize(mesh.positions.size());
  mesh.uvs[0] = {0.5F, 0.25F};
  mesh.normals.assign(mesh.positions.size(), {0, 0, 1});
  const Mesh before = mesh;
  join_vertices(mesh);
  EXPECT_EQ(mesh.positions.size(), 9U);  // eight corners, one of them on both sides of a seam
  expect_same_surface(before, mesh);
  for (const Vec3f& n : mesh.normals) EXPECT_EQ(n, (Vec3f{0, 0, 1}));
}

TEST(JoinVertices, GivesTrianglesWithoutAreaSomeNormal) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 3, 3}};
  mesh.materials = {0};
  join_vertices(mesh);
  ASSERT_FALSE(mesh.normals.empty());
  for (const Vec3f& n : mesh.normals) EXPECT_NEAR(length(n), 1, 1e-5);
  Mesh none;
  none.materials = {0};
  join_vertices(none);
  EXPECT_TRUE(none.positions.empty());
}

}  // namespace
}  // namespace render::join_vertices_test
