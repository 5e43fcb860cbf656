// What persons are judged among: a floor that catches their shadow, a mirror, a ball of glass.
#pragma once

#include <algorithm>
#include <array>
#include <memory>

#include "made_shot.h"
#include "render/glass.h"

namespace compositing {

// Adds them to a scene of one material, mesh and instance. The mirror stands behind, as far back as
// `mirror_y` at its left and right end.
inline void furnish(render::SceneDescription& scene,
                    std::array<float, 2> mirror_y,
                    render::Vec3f ball) {
  scene.materials.push_back(make_stand_in_material("floor", {}));
  render::StandardParameters silver;
  silver.metallic = 1;
  silver.roughness = 0;
  std::fill_n(silver.base_color, 3, 0.9F);
  scene.materials.push_back(make_standard_material("mirror", silver));
  scene.materials.push_back(render::make_glass_material("glass", {}));
  auto mirror = std::make_shared<render::Mesh>();
  mirror->positions = {{-1.6F, mirror_y[0], 0},
                       {1.6F, mirror_y[1], 0},
                       {1.6F, mirror_y[1], 2},
                       {-1.6F, mirror_y[0], 2}};
  mirror->triangles = {{0, 1, 2}, {0, 2, 3}};
  mirror->materials = {2};
  scene.meshes.push_back(made_floor(20, 1));
  scene.meshes.push_back(mirror);
  scene.meshes.push_back(made_ball(ball, 0.35F, 3));
  for (std::uint32_t mesh = 1; mesh < 4; ++mesh) scene.instances.emplace_back().mesh = mesh;
  scene.instances[1].kind = render::ObjectKind::stand_in;
  scene.instances[1].blocks_light = false;
}

}  // namespace compositing
