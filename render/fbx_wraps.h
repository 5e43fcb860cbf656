// Whether an FBX file has textures that do not repeat, which assimp does not tell.
#pragma once

#include <cstddef>
#include <span>

namespace render {

// True if a texture of the file, binary or ascii, is clamped to the sides or up and down.
bool fbx_clamps(std::span<const std::byte> file_bytes);

}  // namespace render
