// Glowing surfaces as lights: a grid of small lamps on them, by their texture coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/light_table.h"
#include "render/scene.h"
#include "render/video_texture.h"

namespace render {

// The part of a glowing surface that one lamp stands for.
struct AreaSample {
  Vec3f position, normal;  // in the set; the normal unit, on the side that it shines to
  float area_m2 = 0;
  float u0 = 0, v0 = 0, u1 = 0, v1 = 0;  // of the picture on it
};

struct AreaLight {
  std::vector<AreaSample> samples;
  std::uint32_t instance = no_instance, material = 0;  // that glow
};

// Most samples along a side.
inline constexpr int most_area_samples = 64;

// Cuts the picture on a surface, texture coordinates 0..1, into columns x rows parts, and puts a
// sample where the middle of each lies on the surface, or, where it does not, in the middle of what
// does. Areas add up to that of all triangles of the instance that have `material` (front sides
// shine), as far as they lie in 0..1; parts that show nowhere are left out. Throws
// std::invalid_argument if nothing is left, they have no texture coordinates, or samples are not 1
// to most_area_samples a side.
AreaLight sample_area_light(const SceneDescription& scene,
                            std::uint32_t instance,
                            std::uint32_t material,
                            std::array<int, 2> samples);

// How a light follows its video.
struct VideoGlow {
  Vec3f gain{1, 1, 1};  // radiance of the video's white
  // Share of the sphere of directions that shows the mean of the surface as well, from wherever one
  // looks: what walls send back. 0 = none.
  float ambient = 0;
};

// The lamps of a frame: each of the mean radiance of its part, planned as if the video were an even
// grey, so that nothing is decided anew while it runs. Light below 0 counts as none. After them,
// where asked for, one of ambient light.
//
// Pomi, Marmitt, Wald and Slusallek, "Streaming Video Textures for Mixed Reality Applications in
// Interactive Ray Tracing Environments", VMV 2003, section 5.2, take 5x5 points in front of the
// screen; ours are on it, weighted by the cosine to its normal, and exact in their sum.
std::vector<LocalLight> lamps_of(const AreaLight& light,
                                 const VideoTexture& video,
                                 const VideoGlow& glow);

}  // namespace render
