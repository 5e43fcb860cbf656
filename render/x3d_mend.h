// X3D files, put in the words that assimp understands.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace render {

// The file with the url of every ImageTexture as a bare name, and without Inline nodes: assimp 5.2
// refuses a list of one name in quotes, which is how most programs write both. Of several names the
// first is kept. A file in other words stays as it is.
//
// X3D (ISO/IEC 19775-1), 18.4.1 ImageTexture and 9.4.2 Inline, and its XML encoding (ISO/IEC
// 19776-1), 4.3.
std::vector<std::byte> mend_x3d(std::span<const std::byte> file_bytes);

// What of the file is not shown, in words: Inline nodes and instances of prototypes.
std::vector<std::string> left_out_of_x3d(std::span<const std::byte> file_bytes);

}  // namespace render
