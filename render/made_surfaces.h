// Made textures: what the grounds and things of made scenes look like from near.
#pragma once

#include <cstdint>

#include "render/mesh.h"

namespace render {

// Base colours, sRGB, with mip levels. `size` is the texels of a side. The same arguments give the
// same texels.

// Asphalt of a car park, court_m metres wide: grains, stains, cracks, a mended patch, worn white
// lines of bays along the top, an arrow. Does not repeat.
inline constexpr float court_m = 16;
Texture make_court_texture(int size, std::uint32_t seed);

// A mown lawn in summer; repeats.
Texture make_lawn_texture(int size, std::uint32_t seed);

// Concrete slabs, four to a side.
Texture make_paving_texture(int size, std::uint32_t seed);

// A cast concrete wall: panels with joints and holes, streaks of rain, a painted band.
Texture make_wall_texture(int size, std::uint32_t seed);

// Boards of wood, eight to a side, grain along u.
Texture make_board_texture(int size, std::uint32_t seed);

// Rough plain concrete.
Texture make_concrete_texture(int size, std::uint32_t seed);

// A woven carpet with a border; fills its square once.
Texture make_carpet_texture(int size, std::uint32_t seed);

// What a made television shows: a bright sunset over the sea, upright.
Texture make_screen_texture(int size);

}  // namespace render
