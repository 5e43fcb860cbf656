// Indices moved up.
#include "render/join_scenes.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "render/standard.h"

namespace render {

Placement product(const Placement& a, const Placement& b) {
  Placement c{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      float sum = column == 3 ? a[row * 4 + 3] : 0;
      for (std::size_t k = 0; k < 3; ++k) sum += a[row * 4 + k] * b[k * 4 + column];
      c[row * 4 + column] = sum;
    }
  }
  return c;
}

Placement placed(Vec3f position, float yaw_rad) {
  const float c = std::cos(yaw_rad);
  const float s = std::sin(yaw_rad);
  return {c, -s, 0, position.x, s, c, 0, position.y, 0, 0, 1, position.z};
}

void join(SceneDescription& whole, const SceneDescription& part, const Placement& set_from_part) {
  const auto first_mesh = static_cast<std::uint32_t>(whole.meshes.size());
  const auto first_texture = static_cast<std::int32_t>(whole.textures.size());
  const auto first_video = static_cast<std::int32_t>(whole.videos.size());
  const auto first_material = static_cast<std::uint32_t>(whole.materials.size());
  for (const auto& mesh : part.meshes) {
    if (first_material == 0) {  // nothing moves up: shared, since meshes may be large
      whole.meshes.push_back(mesh);
      continue;
    }
    Mesh moved = *mesh;
    for (std::uint32_t& material : moved.materials) material += first_material;
    whole.meshes.push_back(std::make_shared<const Mesh>(std::move(moved)));
  }
  whole.textures.insert(whole.textures.end(), part.textures.begin(), part.textures.end());
  whole.videos.insert(whole.videos.end(), part.videos.begin(), part.videos.end());
  for (const Material& material : part.materials) {
    if (material.shader != "standard") {
      whole.materials.push_back(material);
      continue;
    }
    StandardParameters parameters =
        standard_parameters(material, part.textures.size(), part.videos.size());
    for (std::int32_t* texture :
         {&parameters.base_color_texture, &parameters.metallic_roughness_texture,
          &parameters.normal_texture, &parameters.clearcoat_texture,
          &parameters.transmission_texture, &parameters.emission_texture,
          &parameters.clearcoat_roughness_texture, &parameters.alpha_texture}) {
      if (*texture >= 0) *texture += first_texture;
    }
    for (std::int32_t* video : {&parameters.emission_video, &parameters.base_color_video})
      if (*video >= 0) *video += first_video;
    whole.materials.push_back(make_standard_material(material.name, parameters));
  }
  for (Instance instance : part.instances) {
    instance.mesh += first_mesh;
    instance.set_from_object = product(set_from_part, instance.set_from_object);
    whole.instances.push_back(std::move(instance));
  }
}

}  // namespace render
