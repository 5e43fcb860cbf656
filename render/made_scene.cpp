// Scenes of made things.
#include "render/made_scene.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "render/standard.h"

namespace render {

std::int32_t MadeSceneBuilder::add(Texture texture) {
  scene_.textures.push_back(std::make_shared<const Texture>(std::move(texture)));
  return static_cast<std::int32_t>(scene_.textures.size()) - 1;
}

void MadeSceneBuilder::add(const std::string& name,
                           Mesh mesh,
                           std::array<float, 3> base,
                           float roughness,
                           std::int32_t texture,
                           float specular,
                           float metallic) {
  StandardParameters parameters;
  std::ranges::copy(base, parameters.base_color);
  parameters.roughness = roughness;
  parameters.metallic = metallic;
  parameters.specular = specular;
  parameters.base_color_texture = texture;
  add(name, std::move(mesh), make_standard_material(name, parameters));
}

void MadeSceneBuilder::add(const std::string& name, Mesh mesh, Material material) {
  mesh.materials = {static_cast<std::uint32_t>(scene_.materials.size())};
  scene_.materials.push_back(std::move(material));
  Instance instance;
  instance.name = name;
  instance.mesh = static_cast<std::uint32_t>(scene_.meshes.size());
  scene_.instances.push_back(std::move(instance));
  scene_.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
}

SceneDescription MadeSceneBuilder::take() {
  scene_.version = 1;
  return std::move(scene_);
}

}  // namespace render
