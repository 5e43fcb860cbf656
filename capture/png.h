// Pictures of 8 bits to PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "capture/frame.h"

namespace capture {

// Writes texels (height, width, channels), row by row, as they are: 1 = grey, 2 = grey and alpha,
// 3 = RGB, 4 = RGB and (unassociated) alpha. `pixel_aspect` is a pixel's width over its height.
// Replaces an existing file.
// Throws std::invalid_argument if sizes are below 1, above 65,535, or do not match the texels, or
// the aspect is none;
// std::runtime_error naming the path if it cannot be written.
void write_png(const std::filesystem::path& path,
               int width,
               int height,
               int channels,
               std::span<const std::uint8_t> texels,
               Rational pixel_aspect = {1, 1});

}  // namespace capture
