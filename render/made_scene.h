// Puts made things together to a scene.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "render/scene.h"

namespace render {

// Gathers things, most of them of standard surfaces; each becomes an instance with a mesh and a
// material of its own.
class MadeSceneBuilder {
 public:
  // Returns the texture's index, for things that wear it.
  std::int32_t add(Texture texture);

  // A thing of one material: a textured one if `texture` is not -1.
  void add(const std::string& name,
           Mesh mesh,
           std::array<float, 3> base,
           float roughness,
           std::int32_t texture = -1,
           float specular = 1,
           float metallic = 0);
  // A thing of any one material, of the shader that it names.
  void add(const std::string& name, Mesh mesh, Material material);

  SceneDescription take();

 private:
  SceneDescription scene_;
};

}  // namespace render
