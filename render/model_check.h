// PLY, STL and FBX files, checked before anything is built from them, and put in plainer words.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace render {

// Walks all rows of a PLY file, ascii or binary; returns what will not be shown as it is, in words.
// Throws std::runtime_error, naming the element and where it ends, if its header is damaged or
// promises more than there is, or if it has triangle strips, or anything before its vertices, which
// are not read.
//
// Turk, "The PLY Polygon File Format", 1994.
std::vector<std::string> check_ply(std::span<const std::byte> file_bytes);

// Whether a PLY file tells what its faces look like, by materials or a picture.
bool ply_has_paint(std::span<const std::byte> file_bytes);

// Throws std::runtime_error if a binary STL file is not as long as its count of triangles says.
void check_stl(std::span<const std::byte> file_bytes);

// Whether a binary STL file's header tells a colour.
bool stl_has_paint(std::span<const std::byte> file_bytes);

// The bytes of a PLY or STL file in a form that assimp reads as it is meant; nothing if they are so
// already. It takes a binary PLY's first bytes for further ends of its header where they are line
// feeds, and ascii STL only for such if "solid" stands first, in small letters.
std::optional<std::vector<std::byte>> mend_ply(std::span<const std::byte> file_bytes);
std::optional<std::vector<std::byte>> mend_stl(std::span<const std::byte> file_bytes);

// Whether an OBJ file gives colours to some of its vertices and not to others, which assimp then
// gives to the wrong ones.
bool obj_colours_some(std::span<const std::byte> file_bytes);

// Whether an FBX file, binary or ascii, hides anything by a Visibility of 0, which assimp does not
// tell. Anything may stand in the file.
bool hides_by_visibility(std::span<const std::byte> file_bytes);

// Whether it has textures that are clamped to the sides or up and down, which assimp does not tell.
bool fbx_clamps(std::span<const std::byte> file_bytes);

}  // namespace render
