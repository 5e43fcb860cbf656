// Frames decoded by format, mip levels made, light filtered.
#include "render/video_texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include "capture/half.h"
#include "capture/rgbe.h"
#include "render/area_cover.h"
#include "render/cell_transport.h"
#include "render/environment.h"

namespace render {
namespace {

// Light of codes: 0..31, 0..63 and 0..255 are all of a full range.
struct CodeTables {
  std::array<float, 32> five;
  std::array<float, 64> six;
  std::array<float, 256> eight;

  explicit CodeTables(capture::Transfer transfer) {
    const auto fill = [transfer](auto& table) {
      const auto top = static_cast<double>(table.size() - 1);
      for (std::size_t i = 0; i < table.size(); ++i) {
        table[i] = static_cast<float>(capture::decode(transfer, static_cast<double>(i) / top));
      }
    };
    fill(five), fill(six), fill(eight);
  }
};

std::uint16_t word_at(const std::byte* at) {
  std::uint16_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}
std::uint8_t code_at(const std::byte* at) { return static_cast<std::uint8_t>(*at); }

// One texel to light.
using Decoder = void (*)(const std::byte* from, const CodeTables& tables, float* to);

struct FormatEntry {
  std::size_t bytes;  // of a texel
  int channels;
  Decoder decode;
};

void decode_rgb565(const std::byte* from, const CodeTables& tables, float* to) {
  const unsigned word = word_at(from);
  to[0] = tables.five[word >> 11], to[1] = tables.six[word >> 5 & 63],
  to[2] = tables.five[word & 31];
}
void decode_rgb8(const std::byte* from, const CodeTables& tables, float* to) {
  for (int c = 0; c < 3; ++c) to[c] = tables.eight[code_at(from + c)];
}
void decode_rgba8(const std::byte* from, const CodeTables& tables, float* to) {
  to[3] = static_cast<float>(code_at(from + 3)) / 255;
  for (int c = 0; c < 3; ++c) to[c] = tables.eight[code_at(from + c)] * to[3];
}
void decode_rgbe(const std::byte* from, const CodeTables&, float* to) {
  const auto radiance = capture::radiance_from_rgbe(
      {code_at(from), code_at(from + 1), code_at(from + 2), code_at(from + 3)});
  std::ranges::copy(radiance, to);
}
template <int channels>
void decode_half(const std::byte* from, const CodeTables&, float* to) {
  for (int c = 0; c < channels; ++c) to[c] = capture::float_from_half(word_at(from + 2 * c));
}

// In the order of VideoFormat.
constexpr std::array<FormatEntry, video_formats> formats{{
    {2, 3, decode_rgb565},
    {3, 3, decode_rgb8},
    {4, 4, decode_rgba8},
    {4, 3, decode_rgbe},
    {6, 3, decode_half<3>},
    {8, 4, decode_half<4>},
}};

void size_image(capture::Image& image, int height, int width, int channels) {
  image.height = height;
  image.width = width;
  image.channels = channels;
  image.pixels.resize(static_cast<std::size_t>(height) * static_cast<std::size_t>(width) *
                      static_cast<std::size_t>(channels));
}

// Of even sides: means of four, in the order of halve().
template <std::size_t channels>
void halve_even(const capture::Image& from, capture::Image& to) {
  for (int y = 0; y < to.height; ++y) {
    const float* upper = &from.pixels[from.index(2 * y, 0)];
    const float* lower = &from.pixels[from.index(2 * y + 1, 0)];
    float* target = &to.pixels[to.index(y, 0)];
    for (int x = 0; x < to.width; ++x, upper += 2 * channels, lower += 2 * channels) {
      for (std::size_t c = 0; c < channels; ++c) {
        const float left = upper[c] + lower[c];
        const float right = upper[c + channels] + lower[c + channels];
        *target++ = 0.25F * (left + right);
      }
    }
  }
}

void halve(const capture::Image& from, capture::Image& to) {
  size_image(to, std::max(1, from.height / 2), std::max(1, from.width / 2), from.channels);
  if (from.width % 2 == 0 && from.height % 2 == 0) {
    return from.channels == 3 ? halve_even<3>(from, to) : halve_even<4>(from, to);
  }
  std::vector<AreaCover> columns;
  for (int x = 0; x < to.width; ++x) columns.emplace_back(x, from.width, to.width);
  const auto channels = static_cast<std::size_t>(from.channels);
  std::vector<float> row(static_cast<std::size_t>(from.width) * channels);
  for (int y = 0; y < to.height; ++y) {
    const AreaCover rows(y, from.height, to.height);
    std::ranges::fill(row, 0.0F);
    for (int j = 0; j < rows.count; ++j) {
      const float weight = rows.weights[static_cast<std::size_t>(j)];
      const float* texels = &from.pixels[from.index(rows.first + j, 0)];
      for (std::size_t i = 0; i < row.size(); ++i) row[i] += weight * texels[i];
    }
    float* target = &to.pixels[to.index(y, 0)];
    for (const AreaCover& column : columns) {
      const float* texel = &row[static_cast<std::size_t>(column.first) * channels];
      for (std::size_t c = 0; c < channels; ++c) {
        float sum = 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(column.count); ++i) {
          sum += column.weights[i] * texel[i * channels + c];
        }
        *target++ = sum;
      }
    }
  }
}

// What no light can be is 0; then the other levels.
void finish(VideoTexture& texture) {
  std::int64_t numbers = 0;
  for (float& value : texture.levels.front().pixels) {
    const bool is_number = std::abs(value) <= std::numeric_limits<float>::max();
    value = is_number ? std::clamp(value, -brightest_radiance, brightest_radiance) : 0;
    numbers += is_number;
  }
  texture.not_numbers = std::ssize(texture.levels.front().pixels) - numbers;
  std::size_t count = 1;
  while (texture.levels[count - 1].width > 1 || texture.levels[count - 1].height > 1) {
    if (texture.levels.size() == count) texture.levels.emplace_back();
    halve(texture.levels[count - 1], texture.levels[count]);
    ++count;
  }
  texture.levels.resize(count);
}

}  // namespace

void check_video_size(int width, int height) {
  const auto good = [](int side) { return side >= 1 && side <= largest_video_side; };
  if (!good(width) || !good(height)) {
    throw std::invalid_argument("a video frame of " + std::to_string(width) + "x" +
                                std::to_string(height) + "; sides go from 1 to " +
                                std::to_string(largest_video_side));
  }
}

void make_video_texture(const capture::Image& frame, VideoTexture& texture) {
  check_video_size(frame.width, frame.height);
  if (frame.channels != 3 && frame.channels != 4) {
    throw std::invalid_argument("a video texture has 3 or 4 channels, not " +
                                std::to_string(frame.channels));
  }
  if (texture.levels.empty()) texture.levels.emplace_back();
  texture.levels.front() = frame;
  finish(texture);
}

VideoTexture make_video_texture(const capture::Image& frame) {
  VideoTexture texture;
  make_video_texture(frame, texture);
  return texture;
}

VideoTexture make_video_texture(const PackedFrame& frame) {
  check_video_size(frame.width, frame.height);
  const FormatEntry& format = formats.at(static_cast<std::size_t>(frame.format));
  const auto count = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (frame.texels.size() != count * format.bytes) {
    throw std::invalid_argument("a video frame of " + std::to_string(count) + " texels needs " +
                                std::to_string(count * format.bytes) + " bytes, not " +
                                std::to_string(frame.texels.size()));
  }
  const CodeTables tables(frame.transfer);
  VideoTexture texture;
  capture::Image& whole = texture.levels.emplace_back();
  size_image(whole, frame.height, frame.width, format.channels);
  const std::byte* from = frame.texels.data();
  float* to = whole.pixels.data();
  for (std::size_t i = 0; i < count; ++i, from += format.bytes, to += format.channels) {
    format.decode(from, tables, to);
  }
  finish(texture);
  return texture;
}

UvFootprint undistorted_square(int width, int height, float width_uv) {
  const float root = std::sqrt(static_cast<float>(height) / static_cast<float>(width));
  return {{width_uv * root, 0}, {0, width_uv / root}};
}

std::size_t find_video_samples(int width,
                               int height,
                               float u,
                               float v,
                               const UvFootprint& footprint,
                               float blur_uv,
                               std::array<VideoSample, most_video_samples>& samples) {
  const auto unit = [](float value) {
    return std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : 0;
  };
  std::size_t count = 0;
  const auto add = [&](int level, float at_u, float at_v, float share) {
    const auto w = static_cast<float>(std::max(1, width >> level));
    const auto h = static_cast<float>(std::max(1, height >> level));
    samples[count++] = {static_cast<std::uint32_t>(level), unit(at_u) * w - 0.5F,
                        unit(at_v) * h - 0.5F, share};
  };
  int last = 0;
  while (std::max(width, height) >> last > 1) ++last;
  const auto& [a, b] = footprint;
  const float texels = std::sqrt(static_cast<float>(width) * static_cast<float>(height));
  const float blur_texels = std::min(blur_uv * texels, 1e6F);
  const bool blurred = blur_texels > 1 && blur_uv >= std::sqrt(std::abs(a[0] * b[1] - a[1] * b[0]));
  FootprintGrid grid;
  if (blurred) {
    grid.set_level(blur_texels, last);
  } else {
    grid = footprint_grid(footprint, width, height, last, most_along_video);
  }
  const float share = 1 / static_cast<float>(grid.count());
  for (int i = 0; i < grid.count(); ++i) {
    const auto [du, dv] = grid.offset(i);
    add(grid.fine, u + du, v + dv, share * (1 - grid.fraction));
    if (grid.fraction > 0) add(grid.fine + 1, u + du, v + dv, share * grid.fraction);
  }
  return count;
}

Vec3f sample(const VideoTexture& texture, float u, float v, float footprint_uv) {
  std::array<VideoSample, most_video_samples> samples;
  const std::size_t count = find_video_samples(
      texture.width(), texture.height(), u, v,
      undistorted_square(texture.width(), texture.height(), footprint_uv), 0, samples);
  Vec3f sum;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [level, x, y, share] = samples[i];
    sum += plate_at(texture.levels[level], x, y) * share;
  }
  return sum;
}

Vec3f mean_over(const VideoTexture& texture, float u0, float v0, float u1, float v1) {
  constexpr float fewest_texels = 4;
  std::size_t k = 0;
  while (k + 1 < texture.levels.size() &&
         (u1 - u0) * static_cast<float>(texture.levels[k + 1].width) >= fewest_texels &&
         (v1 - v0) * static_cast<float>(texture.levels[k + 1].height) >= fewest_texels) {
    ++k;
  }
  const capture::Image& level = texture.levels[k];
  const auto covered = [](float from, float to, int i) {
    return std::min(to, static_cast<float>(i + 1)) - std::max(from, static_cast<float>(i));
  };
  const float x0 = u0 * static_cast<float>(level.width), x1 = u1 * static_cast<float>(level.width);
  const float y0 = v0 * static_cast<float>(level.height),
              y1 = v1 * static_cast<float>(level.height);
  Vec3f sum;
  float area = 0;
  for (int y = std::max(0, static_cast<int>(y0)); y < level.height && static_cast<float>(y) < y1;
       ++y) {
    for (int x = std::max(0, static_cast<int>(x0)); x < level.width && static_cast<float>(x) < x1;
         ++x) {
      const float weight = covered(y0, y1, y) * covered(x0, x1, x);
      sum += Vec3f{level.at(y, x, 0), level.at(y, x, 1), level.at(y, x, 2)} * weight;
      area += weight;
    }
  }
  return area > 0 ? sum * (1 / area) : Vec3f{};
}

}  // namespace render
