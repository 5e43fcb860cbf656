// Textures: mip levels made, texels filtered.
#include "render/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/area_cover.h"
#include "render/srgb_codes.h"

namespace render {
namespace {

const std::array<float, 256>& unit_of_code() {
  static const std::array<float, 256> units = [] {
    std::array<float, 256> of{};
    for (std::size_t i = 0; i < of.size(); ++i)
      of[i] = static_cast<float>(static_cast<double>(i) / 255);
    return of;
  }();
  return units;
}

void halve(const std::uint8_t* source,
           int width,
           int height,
           int channels,
           bool srgb,
           std::uint8_t* target,
           int target_width,
           int target_height) {
  const SrgbTables& tables = srgb_tables();
  const std::array<float, 256>& units = unit_of_code();
  const int colour_channels = !srgb ? 0 : channels >= 3 ? 3 : 1;
  std::vector<AreaCover> columns;
  for (int x = 0; x < target_width; ++x) columns.emplace_back(x, width, target_width);
  for (int y = 0; y < target_height; ++y) {
    const AreaCover rows(y, height, target_height);
    for (int x = 0; x < target_width; ++x) {
      const AreaCover& column = columns[static_cast<std::size_t>(x)];
      std::array<float, 4> sum{};
      for (int j = 0; j < rows.count; ++j) {
        const auto row = static_cast<std::size_t>(rows.first + j) * static_cast<std::size_t>(width);
        for (int i = 0; i < column.count; ++i) {
          const float weight = rows.weights[static_cast<std::size_t>(j)] *
                               column.weights[static_cast<std::size_t>(i)];
          const std::uint8_t* texel = source + (row + static_cast<std::size_t>(column.first + i)) *
                                                   static_cast<std::size_t>(channels);
          for (int c = 0; c < channels; ++c) {
            const auto& table = c < colour_channels ? tables.light_of_code : units;
            sum[static_cast<std::size_t>(c)] += weight * table[texel[c]];
          }
        }
      }
      for (int c = 0; c < channels; ++c) {
        const float value = std::clamp(sum[static_cast<std::size_t>(c)], 0.0F, 1.0F);
        *target++ = c < colour_channels ? tables.code(value)
                                        : static_cast<std::uint8_t>(value * 255 + 0.5F);
      }
    }
  }
}

struct Level {
  const std::uint8_t* texels;
  int width, height;
};

// Neighbours in a row or column of so many texels, the first -1 to `size`, brought into it.
void repeat_texels(int& first, int& second, int size) {
  if (first < 0) first += size;
  if (first >= size) first -= size;
  second = first + 1 == size ? 0 : first + 1;
}
void wrap_texels(Wrap wrap, int& first, int& second, int size) {
  if (wrap == Wrap::repeat) return repeat_texels(first, second, size);
  second = std::clamp(second, 0, size - 1);
  first = std::clamp(first, 0, size - 1);
}

// Bilinear; u and v in 0..1. Where the texture does not repeat, whether it is clamped or mirrored,
// the texel beyond an edge is the edge's own.
template <int channels, bool repeats>
std::array<float, channels> sample_level(const Level& level,
                                         const std::array<Wrap, 2>& wrap,
                                         float u,
                                         float v,
                                         const float* colour,
                                         const float* alpha) {
  const float x = u * static_cast<float>(level.width) - 0.5F;
  const float y = v * static_cast<float>(level.height) - 0.5F;
  const float floor_x = std::floor(x);
  const float floor_y = std::floor(y);
  const float fx = x - floor_x;
  const float fy = y - floor_y;
  int x0 = static_cast<int>(floor_x);
  int y0 = static_cast<int>(floor_y);
  int x1 = x0 + 1, y1 = y0 + 1;
  if constexpr (repeats) {
    repeat_texels(x0, x1, level.width);
    repeat_texels(y0, y1, level.height);
  } else {
    wrap_texels(wrap[0], x0, x1, level.width);
    wrap_texels(wrap[1], y0, y1, level.height);
  }
  const auto texel = [&](int column, int row) {
    return level.texels + (static_cast<std::size_t>(row) * static_cast<std::size_t>(level.width) +
                           static_cast<std::size_t>(column)) *
                              channels;
  };
  const std::uint8_t* t00 = texel(x0, y0);
  const std::uint8_t* t10 = texel(x1, y0);
  const std::uint8_t* t01 = texel(x0, y1);
  const std::uint8_t* t11 = texel(x1, y1);
  const float w00 = (1 - fx) * (1 - fy);
  const float w10 = fx * (1 - fy);
  const float w01 = (1 - fx) * fy;
  const float w11 = fx * fy;
  std::array<float, channels> result;
  for (std::size_t c = 0; c < channels; ++c) {
    const bool is_alpha = (channels == 2 || channels == 4) && c == channels - 1;
    const float* table = is_alpha ? alpha : colour;
    result[c] =
        w00 * table[t00[c]] + w10 * table[t10[c]] + w01 * table[t01[c]] + w11 * table[t11[c]];
  }
  return result;
}

float wrapped(float coordinate) {
  return std::abs(coordinate) <= 1e6F ? coordinate - std::floor(coordinate) : 0;
}
float wrapped(float coordinate, Wrap wrap) {
  if (wrap == Wrap::repeat) return wrapped(coordinate);
  if (!(std::abs(coordinate) <= 1e6F)) return 0;
  if (wrap == Wrap::clamp) return std::clamp(coordinate, 0.0F, 1.0F);
  const float twice = 2 * wrapped(coordinate / 2);
  return twice > 1 ? 2 - twice : twice;
}

template <int channels, bool repeats>
[[gnu::always_inline]] inline std::array<float, channels> sample_levels(
    const Texture& texture, float u, float v, const UvFootprint& footprint, TextureFilter filter) {
  const float* alpha = unit_of_code().data();
  const float* colour = texture.srgb ? srgb_tables().light_of_code.data() : alpha;
  const auto coarser = [](const Level& from) {
    return Level{from.texels + static_cast<std::size_t>(from.width) *
                                   static_cast<std::size_t>(from.height) * channels,
                 std::max(1, from.width / 2), std::max(1, from.height / 2)};
  };
  Level level{texture.texels.data(), texture.width, texture.height};
  const int longer = std::max(texture.width, texture.height);
  const int last = std::bit_width(static_cast<unsigned>(longer)) - 1;
  const auto inside = [&](float coordinate, std::size_t axis) {
    return repeats ? wrapped(coordinate) : wrapped(coordinate, texture.wrap[axis]);
  };
  std::array<float, channels> sum{};
  const auto add = [&](const Level& from, float at_u, float at_v, float weight) {
    const auto one = sample_level<channels, repeats>(from, texture.wrap, at_u, at_v, colour, alpha);
    for (std::size_t c = 0; c < channels; ++c) sum[c] += weight * one[c];
  };
  if (filter == TextureFilter::quick) {
    const FootprintGrid grid =
        footprint_grid(footprint, texture.width, texture.height, last, most_along_texture);
    for (int k = 0; k < grid.fine; ++k) level = coarser(level);
    const Level next = grid.fraction > 0 ? coarser(level) : level;
    const float share = 1 / static_cast<float>(grid.count());
    for (int i = 0; i < grid.count(); ++i) {
      const auto [du, dv] = grid.offset(i);
      const float at_u = inside(u + du, 0), at_v = inside(v + dv, 1);
      add(level, at_u, at_v, share * (1 - grid.fraction));
      if (grid.fraction > 0) add(next, at_u, at_v, share * grid.fraction);
    }
    return sum;
  }
  const DenseGrids dense = dense_grids(footprint, texture.width, texture.height, last);
  const auto add_all = [&](const Level& from, const FootprintGrid& grid, float weight) {
    const float share = weight / static_cast<float>(grid.count());
    for (int i = 0; i < grid.count(); ++i) {
      const auto [du, dv] = grid.offset(i);
      add(from, inside(u + du, 0), inside(v + dv, 1), share);
    }
  };
  for (int k = 0; k < dense.grid.fine; ++k) level = coarser(level);
  add_all(level, dense.grid, 1 - dense.share_of_next);
  if (dense.share_of_next > 0) add_all(coarser(level), dense.next, dense.share_of_next);
  return sum;
}

template <bool repeats>
[[gnu::always_inline]] inline std::array<float, 4> sample_wrapped(
    const Texture& texture, float u, float v, const UvFootprint& footprint, TextureFilter filter) {
  switch (texture.channels) {
    case 1: {
      const auto [grey] = sample_levels<1, repeats>(texture, u, v, footprint, filter);
      return {grey, grey, grey, 1};
    }
    case 2: {
      const auto [grey, alpha] = sample_levels<2, repeats>(texture, u, v, footprint, filter);
      return {grey, grey, grey, alpha};
    }
    case 3: {
      const auto [red, green, blue] = sample_levels<3, repeats>(texture, u, v, footprint, filter);
      return {red, green, blue, 1};
    }
    default:
      return sample_levels<4, repeats>(texture, u, v, footprint, filter);
  }
}

// Apart, so that textures that repeat pay nothing for the others.
[[gnu::noinline]] std::array<float, 4> sample_otherwise(
    const Texture& texture, float u, float v, const UvFootprint& footprint, TextureFilter filter) {
  return sample_wrapped<false>(texture, u, v, footprint, filter);
}

}  // namespace

std::size_t texture_bytes(int width, int height, int channels) {
  std::size_t bytes = 0;
  for (;;) {
    bytes += static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
             static_cast<std::size_t>(channels);
    if (width == 1 && height == 1) return bytes;
    width = std::max(1, width / 2);
    height = std::max(1, height / 2);
  }
}

Texture make_texture(int width,
                     int height,
                     int channels,
                     bool srgb,
                     std::span<const std::uint8_t> texels,
                     std::array<Wrap, 2> wrap) {
  if (width < 1 || height < 1 || width > max_texture_size || height > max_texture_size ||
      channels < 1 || channels > 4)
    throw std::invalid_argument("a texture of " + std::to_string(width) + "x" +
                                std::to_string(height) + " with " + std::to_string(channels) +
                                " channels; sizes go from 1 to " +
                                std::to_string(max_texture_size) + ", channels from 1 to 4");
  const auto level_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                           static_cast<std::size_t>(channels);
  if (texels.size() != level_bytes)
    throw std::invalid_argument("a texture needs " + std::to_string(level_bytes) +
                                " bytes of texels, not " + std::to_string(texels.size()));
  Texture texture{width, height, channels, srgb, {}, wrap};
  texture.texels.resize(texture_bytes(width, height, channels));
  std::copy(texels.begin(), texels.end(), texture.texels.begin());
  std::uint8_t* source = texture.texels.data();
  while (width > 1 || height > 1) {
    std::uint8_t* target = source + static_cast<std::size_t>(width) *
                                        static_cast<std::size_t>(height) *
                                        static_cast<std::size_t>(channels);
    const int target_width = std::max(1, width / 2);
    const int target_height = std::max(1, height / 2);
    halve(source, width, height, channels, srgb, target, target_width, target_height);
    source = target;
    width = target_width;
    height = target_height;
  }
  return texture;
}

std::array<float, 4> sample(
    const Texture& texture, float u, float v, const UvFootprint& footprint, TextureFilter filter) {
  if (texture.wrap != std::array<Wrap, 2>{})
    return sample_otherwise(texture, u, v, footprint, filter);
  return sample_wrapped<true>(texture, u, v, footprint, filter);
}

}  // namespace render
