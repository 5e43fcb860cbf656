// PLY and STL files, checked before anything is built from them.
#pragma once

#include <cstddef>
#include <span>

namespace render {

// Walks all rows of a PLY file, ascii or binary. Throws std::runtime_error, naming the element and
// where it ends, if its header is damaged or promises more than there is.
//
// Turk, "The PLY Polygon File Format", 1994.
void check_ply(std::span<const std::byte> file_bytes);

// Throws std::runtime_error if a binary STL file is not as long as its count of triangles says.
void check_stl(std::span<const std::byte> file_bytes);

}  // namespace render
