// Textures: mip levels made, texels filtered.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "render/area_footprint.h"
#include "render/mesh.h"

namespace render {

// Widest and highest texture that is accepted, texels.
inline constexpr int max_texture_size = 16384;

// Bytes of all mip levels: level k is max(1, width >> k) by max(1, height >> k), down to 1x1.
std::size_t texture_bytes(int width, int height, int channels);

// A texture with its mip levels, from the texels of level 0, (height, width, channels), row 0 on
// top. Levels are area averages; colour (`srgb`) is averaged in linear light, alpha as it is.
// `wrap`: beyond the edges to the sides, and up and down.
// Throws std::invalid_argument if sizes are not 1..max_texture_size, channels not 1..4, or the
// number of texels does not fit.
Texture make_texture(int width,
                     int height,
                     int channels,
                     bool srgb,
                     std::span<const std::uint8_t> texels,
                     std::array<Wrap, 2> wrap = {});

// Red, green, blue, alpha at (u, v), 0..1, colour in linear light; u to the right, v down from the
// texture's top edge, beyond its edges by its modes. One channel is grey, two are grey and alpha;
// alpha is 1 where there is none. What is wanted is the mean of the footprint: by dense_grids(),
// or, where few camera rays are taken, whose own errors hide the difference, by footprint_grid()
// with up to so many look-ups along the longer side. Coordinates that are not finite, or beyond a
// million, count as 0.
enum class TextureFilter : std::uint8_t { dense, quick };
inline constexpr int most_along_texture = 12;
std::array<float, 4> sample(const Texture& texture,
                            float u,
                            float v,
                            const UvFootprint& footprint,
                            TextureFilter filter = TextureFilter::dense);

}  // namespace render
