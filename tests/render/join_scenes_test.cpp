// Joined scenes hold both, each with its own surfaces.
#include "render/join_scenes.h"

#include <gtest/gtest.h>

#include "render/standard.h"

namespace render::join_scenes_test {
namespace {

// One triangle with one texture of a grey of its own.
SceneDescription scene_of(std::uint8_t grey, const std::string& name) {
  SceneDescription scene;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.materials = {0};
  scene.meshes.push_back(std::make_shared<const Mesh>(mesh));
  scene.textures.push_back(std::make_shared<const Texture>(Texture{1, 1, 1, false, {grey}}));
  StandardParameters parameters;
  parameters.base_color_texture = parameters.alpha_texture = 0;
  scene.materials.push_back(make_standard_material(name, parameters));
  Instance instance;
  instance.name = name;
  scene.instances.push_back(instance);
  return scene;
}

TEST(Join, KeepsEveryInstanceItsOwnMeshMaterialAndTexture) {
  SceneDescription whole = scene_of(1, "first");
  join(whole, scene_of(2, "second"));
  Material other;
  other.shader = "stand_in";
  SceneDescription third = scene_of(3, "third");
  third.materials.push_back(other);
  join(whole, third);
  ASSERT_EQ(whole.instances.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const Instance& instance = whole.instances[i];
    const Material& material = whole.materials.at(whole.meshes.at(instance.mesh)->materials[0]);
    EXPECT_EQ(material.name, instance.name);
    const auto parameters = standard_parameters(material, whole.textures.size());
    const auto texture = static_cast<std::size_t>(parameters.base_color_texture);
    EXPECT_EQ(whole.textures.at(texture)->texels.at(0), i + 1);
    EXPECT_EQ(parameters.alpha_texture, parameters.base_color_texture);
  }
  EXPECT_EQ(whole.materials.back().shader, "stand_in");
}

TEST(Join, KeepsEveryScreenItsOwnVideo) {
  const auto screen_of = [](const std::string& video) {
    SceneDescription scene = scene_of(1, "screen");
    scene.videos = {"another", video};
    StandardParameters parameters;
    parameters.emission_video = 1;
    scene.materials = {make_standard_material("screen", parameters)};
    return scene;
  };
  SceneDescription whole = screen_of("first");
  join(whole, screen_of("second"));
  const auto video = standard_parameters(whole.materials.at(1), 2, 4).emission_video;
  EXPECT_EQ(whole.videos.at(static_cast<std::size_t>(video)), "second");
}

TEST(Join, LeavesATextureThatIsNoneNone) {
  SceneDescription whole = scene_of(1, "first");
  SceneDescription plain;
  plain.materials.push_back(make_standard_material("plain", {}));
  join(whole, plain);
  EXPECT_EQ(standard_parameters(whole.materials[1], 1).base_color_texture, -1);
}

}  // namespace
}  // namespace render::join_scenes_test
