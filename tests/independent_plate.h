// The plate by another way than our reader's: the ffmpeg program decodes to raw planes, and the
// arithmetic of capture/colour.md is done here once more, pixel by pixel, in 64-bit integers.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "capture/half.h"

namespace independent {

// Runs the ffmpeg program; the running test fails if that fails.
inline void ffmpeg(const std::string& arguments) {
  const std::string command = "ffmpeg -nostdin -v error -y " + arguments;
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

inline std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// All frames of a clip as raw planes, in `pixel_format`, which must be the clip's own.
inline std::vector<std::uint8_t> raw_planes(const std::filesystem::path& clip,
                                            const std::string& pixel_format,
                                            const std::filesystem::path& directory) {
  const std::filesystem::path raw = directory / (clip.filename().string() + ".raw");
  ffmpeg("-i '" + clip.string() + "' -map 0:v:0 -vsync passthrough -f rawvideo -pix_fmt " +
         pixel_format + " '" + raw.string() + "'");
  return read_bytes(raw);
}

struct Planes {
  int width = 0;
  int height = 0;
  int depth = 8;
  bool gbr = false;  // else Y'CbCr:
  int share_x = 1;   // luma samples per chroma sample
  int share_y = 1;
  double kr = 0.299;
  double kb = 0.114;
  bool full = false;
  bool centred = false;  // chroma across; down it is always in the middle

  int chroma_width() const { return (width + share_x - 1) / share_x; }
  int chroma_height() const { return (height + share_y - 1) / share_y; }
  std::size_t samples() const {
    const auto luma = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    return luma + 2 * (gbr ? luma
                           : static_cast<std::size_t>(chroma_width()) *
                                 static_cast<std::size_t>(chroma_height()));
  }
  std::size_t bytes() const { return samples() * (depth > 8 ? 2 : 1); }
};

// One sample of a plane; indices outside give the nearest inside.
inline std::int64_t sample(
    const std::uint8_t* plane, int width, int height, int depth, int x, int y) {
  const int inside_x = x < 0 ? 0 : x >= width ? width - 1 : x;
  const int inside_y = y < 0 ? 0 : y >= height ? height - 1 : y;
  const std::size_t i = static_cast<std::size_t>(inside_y) * static_cast<std::size_t>(width) +
                        static_cast<std::size_t>(inside_x);
  return depth > 8 ? plane[2 * i] + 256 * plane[2 * i + 1] : plane[i];
}

struct Weighted {
  int j;
  std::int64_t units;
  std::int64_t w;
};

// Section 2: between which chroma samples luma sample i lies. All distances doubled.
inline Weighted weigh(int i, int share, bool middle) {
  if (share == 1) return {i, 1, 0};
  const int doubled = 2 * i - (middle ? share - 1 : 0);
  const int j = static_cast<int>(std::floor(doubled / (2.0 * share)));
  return {j, 2 * share, doubled - 2 * share * j};
}

inline std::int64_t chroma_at(const Planes& p, const std::uint8_t* plane, int x, int y) {
  const Weighted across = weigh(x, p.share_x, p.centred);
  const Weighted down = weigh(y, p.share_y, true);
  const auto at = [&](int dx, int dy) {
    return sample(plane, p.chroma_width(), p.chroma_height(), p.depth, across.j + dx, down.j + dy);
  };
  const std::int64_t upper = (across.units - across.w) * at(0, 0) + across.w * at(1, 0);
  const std::int64_t lower = (across.units - across.w) * at(0, 1) + across.w * at(1, 1);
  return (down.units - down.w) * upper + down.w * lower;
}

// Non-linear R'G'B' of one pixel: sections 2 and 3.
inline void values_at(const Planes& p, const std::uint8_t* frame, int x, int y, double rgb[3]) {
  const std::size_t word = p.depth > 8 ? 2 : 1;
  const std::size_t luma_bytes =
      static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height) * word;
  const std::int64_t first = sample(frame, p.width, p.height, p.depth, x, y);
  if (p.gbr) {
    const double top = (1 << p.depth) - 1;
    rgb[1] = static_cast<double>(first) / top;
    rgb[2] =
        static_cast<double>(sample(frame + luma_bytes, p.width, p.height, p.depth, x, y)) / top;
    rgb[0] =
        static_cast<double>(sample(frame + 2 * luma_bytes, p.width, p.height, p.depth, x, y)) / top;
    return;
  }
  const std::size_t chroma_bytes = static_cast<std::size_t>(p.chroma_width()) *
                                   static_cast<std::size_t>(p.chroma_height()) * word;
  const std::int64_t n =
      (p.share_x == 1 ? 1 : 2 * p.share_x) * (p.share_y == 1 ? 1 : 2 * p.share_y);
  const std::int64_t scale = std::int64_t{1} << (p.depth - 8);
  const double luma_span = static_cast<double>(p.full ? 256 * scale - 1 : 219 * scale);
  const double chroma_span = static_cast<double>(p.full ? 256 * scale - 1 : 224 * scale);
  const int f = p.depth == 8 ? 28 : 44;
  const int g = p.depth == 8 ? 14 : 16;
  const double one = std::pow(2.0, f);
  const double kg = 1 - p.kr - p.kb;
  const double cn = chroma_span * static_cast<double>(n);
  const std::int64_t k_y = std::llround(one / luma_span);
  const std::int64_t k_r = std::llround(one * 2 * (1 - p.kr) / cn);
  const std::int64_t k_b = std::llround(one * 2 * (1 - p.kb) / cn);
  const std::int64_t k_gb = std::llround(-one * 2 * (1 - p.kb) * p.kb / (kg * cn));
  const std::int64_t k_gr = std::llround(-one * 2 * (1 - p.kr) * p.kr / (kg * cn));
  const std::int64_t luma = first - (p.full ? 0 : 16 * scale);
  const std::int64_t b = chroma_at(p, frame + luma_bytes, x, y) - n * 128 * scale;
  const std::int64_t r = chroma_at(p, frame + luma_bytes + chroma_bytes, x, y) - n * 128 * scale;
  const std::int64_t sums[3] = {k_y * luma + k_r * r, k_y * luma + k_gb * b + k_gr * r,
                                k_y * luma + k_b * b};
  for (int c = 0; c < 3; ++c) {
    const std::int64_t h = std::int64_t{1} << (f - g - 1);
    std::int64_t step = (sums[c] + h) / (2 * h);
    if (step * 2 * h > sums[c] + h) --step;  // division rounds to zero, the rule down
    const std::int64_t half = std::int64_t{1} << (g - 1);
    step = step < -half ? -half : step > 3 * half ? 3 * half : step;
    rgb[c] = static_cast<double>(step) / static_cast<double>(2 * half);
  }
}

// Section 4 for Rec.1886, then half.
inline capture::Half half_of_rec1886(double value) {
  const double light = value < 0 ? -std::pow(-value, 2.4) : std::pow(value, 2.4);
  return capture::half_from_float(static_cast<float>(light));
}

// (height, width, 3) halves of the linearised frame.
inline std::vector<capture::Half> linear_halves(const Planes& p, const std::uint8_t* frame) {
  std::vector<capture::Half> halves;
  for (int y = 0; y < p.height; ++y) {
    for (int x = 0; x < p.width; ++x) {
      double rgb[3];
      values_at(p, frame, x, y, rgb);
      for (const double value : rgb) halves.push_back(half_of_rec1886(value));
    }
  }
  return halves;
}

}  // namespace independent
