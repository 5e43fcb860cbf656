// What of a scene glows, part by part: small ones shine between the rays of pixels' centres.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/camera_turn.h"
#include "render/mesh.h"
#include "render/scene.h"

namespace render {

// What glows of a mesh that stands at `set_from_object`, in the set, one for each part that is
// apart from the others along some axis. `glow`: by material, as Shader::glow(). Triangles that are
// not finite are left out. Beyond `most_glowing_parts`, and in shapes that take many cuts, parts
// stay together.
inline constexpr std::size_t most_glowing_parts = 4096;
std::vector<Scene::GlowingPart> find_glowing_parts(const Mesh& mesh,
                                                   const std::array<float, 12>& set_from_object,
                                                   std::span<const float> glow);

// One that is less than two pixels wide in a frame, as the camera sees it.
struct SmallLight {
  Vec3f direction;     // unit, in the camera's frame
  float half_rad = 0;  // of the cone about it that holds the part
  float radiance = 0;
};
// By the first coordinate of their directions.
std::vector<SmallLight> find_small_lights(std::span<const Scene::GlowingPart> parts,
                                          Vec3f camera,
                                          const CameraTurn& turn,
                                          float pixel_angle);

}  // namespace render
