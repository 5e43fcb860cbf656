// Where the pixels of a cell show one smooth surface. Private to the kernel.
#pragma once

#include <cstddef>

#include "render/light_gather.h"

namespace render {

// Whether two pixels show the same surface, and it is nearly flat between them.
bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b);

// Sides of a block.
inline constexpr unsigned ends_left = 1, ends_right = 2, ends_above = 4, ends_below = 8;
inline constexpr unsigned both_ends = ends_left | ends_right;

// Finds the smooth surfaces of a cell's 4x4 blocks, where they end, and which 2x2 blocks are one.
void find_smooth_blocks(const Receivers& r, GatherWorkspace& w);

}  // namespace render
