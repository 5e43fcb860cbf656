// Pictures of 8 bits to PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace capture {

// Writes texels (height, width, channels), row by row, as they are: 1 = grey, 2 = grey and alpha,
// 3 = RGB, 4 = RGB and (unassociated) alpha. Replaces an existing file.
// Throws std::invalid_argument if sizes are below 1, above 65,535, or do not match the texels;
// std::runtime_error naming the path if it cannot be written.
void write_png(const std::filesystem::path& path,
               int width,
               int height,
               int channels,
               std::span<const std::uint8_t> texels);

}  // namespace capture
