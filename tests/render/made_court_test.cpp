// The made court is a sound scene, and leaves room for the car.
#include "render/made_court.h"

#include <cmath>

#include <gtest/gtest.h>

#include "render/standard.h"

namespace render::made_court_test {
namespace {

MadeCourtSettings small() { return {.texture_size = 64}; }

TEST(MakeCourt, IsMadeOfStandardSurfacesThatRefersOnlyToWhatIsThere) {
  const SceneDescription court = make_court(small());
  for (const Instance& instance : court.instances) {
    ASSERT_LT(instance.mesh, court.meshes.size());
    const Mesh& mesh = *court.meshes[instance.mesh];
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size()) << instance.name;
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size()) << instance.name;
    for (const auto& triangle : mesh.triangles) {
      for (const auto corner : triangle) ASSERT_LT(corner, mesh.positions.size()) << instance.name;
    }
    ASSERT_EQ(mesh.materials.size(), 1U) << instance.name;
    const Material& material = court.materials.at(mesh.materials[0]);
    EXPECT_EQ(material.shader, "standard");
    EXPECT_NO_THROW(standard_parameters(material, court.textures.size())) << instance.name;
  }
}

TEST(MakeCourt, TurnsEveryTriangleTheWayOfItsNormals) {
  const SceneDescription court = make_court(small());
  for (const Instance& instance : court.instances) {
    const Mesh& mesh = *court.meshes[instance.mesh];
    for (const auto& t : mesh.triangles) {
      const Vec3f a = mesh.positions[t[0]];
      const Vec3f winding = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
      const Vec3f normal = mesh.normals[t[0]] + mesh.normals[t[1]] + mesh.normals[t[2]];
      ASSERT_GT(dot(winding, normal), 0) << instance.name;
    }
    for (const Vec3f n : mesh.normals) ASSERT_NEAR(length(n), 1, 1e-4) << instance.name;
  }
}

TEST(MakeCourt, IsFlatAndFreeAroundTheOriginButForACard) {
  const SceneDescription court = make_court(small());
  for (const Instance& instance : court.instances) {
    if (instance.name == "court" || instance.name == "grey card") continue;
    for (const Vec3f p : court.meshes[instance.mesh]->positions) {
      ASSERT_GT(std::hypot(p.x, p.y), 3.4F) << instance.name;
    }
  }
  for (const Vec3f p : court.meshes[court.instances[0].mesh]->positions) EXPECT_EQ(p.z, 0);
}

TEST(MakeCourt, RepeatsItself) {
  const SceneDescription once = make_court(small());
  const SceneDescription again = make_court(small());
  ASSERT_EQ(once.textures.size(), again.textures.size());
  for (std::size_t i = 0; i < once.textures.size(); ++i) {
    EXPECT_EQ(*once.textures[i], *again.textures[i]);
  }
  EXPECT_EQ(once.materials, again.materials);
}

}  // namespace
}  // namespace render::made_court_test
