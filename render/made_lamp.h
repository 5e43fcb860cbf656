// A made lamp: a low one, as beside paths, that shines on the ground.
#pragma once

#include <string_view>
#include <vector>

#include "render/join_scenes.h"
#include "render/light_table.h"
#include "render/scene.h"

namespace render {

// The material of what glows.
inline constexpr std::string_view lamp_glow = "lamp glow";

// Where its glowing disc is, in the lamp's own frame, and how it shines: downwards, at this
// radiance.
inline constexpr Vec3f lamp_disc_middle{0.35F, 0, 1.1F};
inline constexpr float lamp_disc_radius_m = 0.1F;
inline constexpr float lamp_disc_radiance[3] = {130, 105, 70};

// A post at the origin with an arm towards +x and a shade with the disc under it. Its materials are
// of the shader "standard".
SceneDescription made_lamp(float emission_gain = 1);

// What the disc sends to surfaces far from it against its radius: `count` (at least 1) equal
// lights, evenly over it and just below, for a lamp that stands so.
std::vector<LocalLight> lights_of_made_lamp(const Placement& set_from_lamp, int count);

}  // namespace render
