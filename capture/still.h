// Still pictures in memory to texels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace capture {

// (height, width, channels), row by row: 3 = RGB, 4 = RGB and unassociated alpha; the file's own
// codes 0 to 255, no colour change.
struct Still8 {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> texels;
};

// Decodes a PNG or JPEG file held in memory (textures of meshes). Grey becomes RGB; deeper codes
// are rounded to 8 bits; JPEG's YCbCr is read as BT.601, full range. `name` is for error messages.
// Throws std::runtime_error naming `name` and the reason if the bytes are neither, are damaged or
// truncated, or the picture is larger than 16,384 a side.
Still8 decode_still8(std::span<const std::byte> file_bytes, const std::string& name);

}  // namespace capture
