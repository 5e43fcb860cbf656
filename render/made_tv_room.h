// A made living room with a television set.
#pragma once

#include <cstddef>
#include <vector>

#include "render/light_table.h"
#include "render/scene.h"

namespace render {

// As many triangles as the TV room of Pomi et al. (VMV 2003, table 1).
inline constexpr std::size_t made_tv_room_triangles = 7237;

// The room is open to -y, where the viewer stands, and above its front half. On the far wall is the
// screen: the instance "tv", a rectangle of the material "screen" that faces -y, its picture
// upright over texture coordinates 0..1. A polished table, a metal vase and a mirror show it again.
// All materials are of the shader "standard".
SceneDescription make_tv_room(bool lamp_on = true);

// The screen's size: as wide to high as the paper's video of 130x100.
inline constexpr float tv_screen_width_m = 0.91F, tv_screen_height_m = 0.70F;
inline constexpr Vec3f tv_screen_middle{0, 1.68F, 0.99F};

// Light of the standard lamp in the corner, when it is on.
std::vector<LocalLight> lights_of_tv_room();

}  // namespace render
