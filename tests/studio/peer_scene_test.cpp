// Scenes as files for other renderers: what is written is what is rendered.
#include "studio/peer_scene.h"

#include <filesystem>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "capture/exr.h"
#include "render/load_mesh.h"

namespace studio::peer_scene_test {
namespace {

namespace fs = std::filesystem;
using render::Vec3f;

class PeerSceneTest : public testing::Test {
 protected:
  void SetUp() override {
    dir_ = fs::path(testing::TempDir()) / ("platelight_peer_" + std::to_string(getpid()));
  }
  void TearDown() override { fs::remove_all(dir_); }
  fs::path dir_;
};

TEST_F(PeerSceneTest, HoldsEveryTriangleOfTheSceneAndItsLight) {
  const PeerScene scene = make_peer_scene("glass", 64, 48);
  write_peer_scene(scene, dir_);
  nlohmann::json json;
  std::ifstream(dir_ / "scene.json") >> json;
  std::size_t triangles = 0;
  Vec3f lower{1e9F, 1e9F, 1e9F}, upper = -lower;
  bool has_glass = false;
  for (const auto& part : json["parts"]) {
    const render::LoadedModel model = render::load_model(dir_ / std::string(part["file"]));
    triangles += model.report.triangles;
    lower = {std::min(lower.x, model.report.lower.x), std::min(lower.y, model.report.lower.y),
             std::min(lower.z, model.report.lower.z)};
    upper = {std::max(upper.x, model.report.upper.x), std::max(upper.y, model.report.upper.y),
             std::max(upper.z, model.report.upper.z)};
    has_glass = has_glass || part["model"] == "glass";
  }
  EXPECT_TRUE(has_glass);
  EXPECT_EQ(triangles + 2, triangle_count(scene.shot.scene->description())) << "all but the floor";
  const render::Scene::Bounds bounds = scene.shot.scene->virtual_bounds();
  EXPECT_LT(length(lower - bounds.lower), 1e-4F);
  EXPECT_LT(length(upper - bounds.upper), 1e-4F);
  EXPECT_EQ(capture::read_exr(dir_ / std::string(json["light"])).pixels,
            scene.shot.environment.radiance.pixels);
  // In the open, the floor is as bright as the plate.
  const Vec3f open = render::irradiance_of(scene.shot.environment, {0, 0, 1});
  EXPECT_NEAR(float{json["floor_albedo"][1]} * open.y / std::numbers::pi_v<float>,
              scene.shot.plate.at(7, 9, 1), 1e-5);
}

TEST_F(PeerSceneTest, TurnsTrianglesToTheirNormals) {
  const PeerScene scene = make_peer_scene("paint", 64, 48);
  const render::SceneDescription& description = scene.shot.scene->description();
  std::size_t triangles = 0;
  for (std::uint32_t m = 0; m < description.materials.size(); ++m) {
    const render::Mesh mesh = triangles_of_material(description, m);
    triangles += mesh.triangles.size();
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vec3f outside = mesh.normals[a] + mesh.normals[b] + mesh.normals[c];
      ASSERT_GE(
          dot(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]),
              outside),
          0);
    }
  }
  EXPECT_EQ(triangles + 2, triangle_count(description));
}

TEST_F(PeerSceneTest, RefusesScenesThatThereAreNotAndFoldersThatCannotBe) {
  EXPECT_THROW(make_peer_scene("boat", 64, 48), std::invalid_argument);
  const PeerScene scene = make_peer_scene("matte", 64, 48);
  EXPECT_THROW(write_peer_scene(scene, "/proc/none"), std::runtime_error);
}

}  // namespace
}  // namespace studio::peer_scene_test
