// Levels of keyed frames, and look-ups.
#include "compositing/keyed_texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "capture/half.h"
#include "render/area_cover.h"
#include "render/texture.h"
#include "render/video_texture.h"

namespace compositing {
namespace {

using capture::Half, capture::HalfImage;

// A pixel's red, green, blue and alpha.
using Four [[gnu::vector_size(16)]] = float;

// Those of two.
using Eight [[gnu::vector_size(32)]] = float;

Four load(const Half* at) {
#if defined(__F16C__)
  return _mm_cvtph_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at)));
#else
  return Four{capture::float_from_half(at[0]), capture::float_from_half(at[1]),
              capture::float_from_half(at[2]), capture::float_from_half(at[3])};
#endif
}

Eight load_two(const Half* at) {
#if defined(__F16C__)
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)));
#else
  Eight two;
  for (int c = 0; c < 8; ++c) two[c] = capture::float_from_half(at[c]);
  return two;
#endif
}

void store(Half* at, Four four) {
#if defined(__F16C__)
  _mm_storel_epi64(reinterpret_cast<__m128i*>(at), _mm_cvtps_ph(four, _MM_FROUND_TO_NEAREST_INT));
#else
  for (int c = 0; c < 4; ++c) at[c] = capture::half_from_float(four[c]);
#endif
}

void size_level(HalfImage& level, int height, int width) {
  level.height = height, level.width = width, level.channels = 4;
  level.pixels.resize(4 * static_cast<std::size_t>(height) * static_cast<std::size_t>(width));
}

// `count` pixels of a level, from twice as many of two rows of the one before.
void halve_rows(const Half* upper, const Half* lower, Half* to, int count) {
  for (int i = 0; i < count; ++i, upper += 8, lower += 8, to += 4) {
    const Four sum = (load(upper) + load(upper + 4)) + (load(lower) + load(lower + 4));
    store(to, sum * 0.25F);
  }
}

// The first level, of a frame with even sides: most of it is bare.
void halve_frame(const KeyedFrame& frame, HalfImage& to) {
  constexpr int run = KeyedFrame::run;
  const HalfImage& from = frame.image();
  for (int y = 0; y < to.height; ++y) {
    for (int x = 0; x < from.width; x += run) {
      const int count = std::min(run, from.width - x) / 2;
      Half* target = &to.pixels[to.index(y, x / 2)];
      if (frame.has_any(2 * y, x) || frame.has_any(2 * y + 1, x)) {
        halve_rows(&from.pixels[from.index(2 * y, x)], &from.pixels[from.index(2 * y + 1, x)],
                   target, count);
      } else {
        std::fill_n(target, 4 * count, Half{0});
      }
    }
  }
}

void halve_odd(const HalfImage& from, HalfImage& to) {
  for (int y = 0; y < to.height; ++y) {
    const render::AreaCover rows(y, from.height, to.height);
    for (int x = 0; x < to.width; ++x) {
      const render::AreaCover columns(x, from.width, to.width);
      Four sum{};
      for (int j = 0; j < rows.count; ++j) {
        for (int i = 0; i < columns.count; ++i) {
          sum += load(&from.pixels[from.index(rows.first + j, columns.first + i)]) *
                 (rows.weights[static_cast<std::size_t>(j)] *
                  columns.weights[static_cast<std::size_t>(i)]);
        }
      }
      store(&to.pixels[to.index(y, x)], sum);
    }
  }
}

Four bilinear(const HalfImage& level, float x, float y) {
  const auto x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const std::size_t right = x0 + 1 < level.width ? 4 : 0;
  const Half* upper = &level.pixels[level.index(y0, x0)];
  const Half* lower = &level.pixels[level.index(std::min(y0 + 1, level.height - 1), x0)];
  const Four above = load(upper) + (load(upper + right) - load(upper)) * fx;
  const Four below = load(lower) + (load(lower + right) - load(lower)) * fx;
  return above + (below - above) * fy;
}

// The mean of two linear look-ups along one side of a level, as weights of the texels from `first`
// on.
struct Taps {
  int first;
  alignas(32) std::array<float, 8> weights;
};

// In texels, `from` no more than `to`; at most `reach` texels have a weight.
Taps taps_of(int size, int reach, float from, float to) {
  Taps taps{std::clamp(static_cast<int>(from), 0, std::max(size - reach, 0)), {}};
  const Eight texel = Eight{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<float>(taps.first);
  const auto hat = [&](float at) {
    const Eight before = 1 + (texel - at), behind = 1 - (texel - at);
    const Eight least = before < behind ? before : behind;
    return least > 0 ? least : Eight{};
  };
  const Eight weights = (hat(from) + hat(to)) * 0.5F;
  std::memcpy(taps.weights.data(), &weights, sizeof weights);
  return taps;
}

// The mean of four bilinear look-ups, at the corners of a rectangle of less than reach - 2 texels.
template <int reach>
Four filtered_in(const HalfImage& level, float left, float right, float top, float bottom) {
  static_assert(reach % 2 == 0 && reach <= 8);
  const Taps across = taps_of(level.width, reach, left, right);
  const Taps down = taps_of(level.height, reach, top, bottom);
  const int rows = std::min(reach, level.height);
  const Half* row = &level.pixels[level.index(down.first, across.first)];
  const auto stride = 4 * static_cast<std::ptrdiff_t>(level.width);
  const auto weight = [](const Taps& taps, int i) {
    return taps.weights[static_cast<std::size_t>(i)];
  };
  if (level.width < reach) {
    Four sum{};
    for (int j = 0; j < rows; ++j, row += stride) {
      for (int i = 0; i < level.width; ++i) {
        sum +=
            load(row + 4 * static_cast<std::ptrdiff_t>(i)) * (weight(across, i) * weight(down, j));
      }
    }
    return sum;
  }
  std::array<Eight, reach / 2> columns;
  for (int i = 0; i < reach / 2; ++i) {
    const float a = weight(across, 2 * i), b = weight(across, 2 * i + 1);
    columns[static_cast<std::size_t>(i)] = Eight{a, a, a, a, b, b, b, b};
  }
  Eight sum{};
  for (int j = 0; j < rows; ++j, row += stride) {
    Eight of_row{};
    for (std::size_t i = 0; i < columns.size(); ++i) of_row += load_two(row + 8 * i) * columns[i];
    sum += of_row * weight(down, j);
  }
  return Four{sum[0], sum[1], sum[2], sum[3]} + Four{sum[4], sum[5], sum[6], sum[7]};
}

}  // namespace

// Distances on a grid where steps go to all eight neighbours: exact in two passes (Rosenfeld and
// Pfaltz, Journal of the ACM 13, 1966).
void KeyedTexture::find_bare() {
  constexpr int run = KeyedFrame::run;
  const int rows = (height() + run - 1) / run, columns = (width() + run - 1) / run;
  const auto at = [&](int row, int column) -> std::uint8_t& {
    return bare_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(column)];
  };
  bare_.resize(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  const auto nearer = [&](int row, int column, std::initializer_list<std::array<int, 2>> steps) {
    int least = at(row, column);
    for (const auto& [down, right] : steps) {
      const int y = row + down, x = column + right;
      if (y < 0 || y >= rows || x < 0 || x >= columns) continue;
      least = std::min(least, at(y, x) + 1);
    }
    at(row, column) = static_cast<std::uint8_t>(least);
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      at(row, column) = frame_.has_any_in_block(row, column) ? 0 : 255;
      nearer(row, column, {{-1, -1}, {-1, 0}, {-1, 1}, {0, -1}});
    }
  }
  bare_everywhere_ = std::ranges::all_of(bare_, [](std::uint8_t away) { return away == 255; });
  for (int row = rows - 1; row >= 0 && !bare_everywhere_; --row) {
    for (int column = columns - 1; column >= 0; --column) {
      nearer(row, column, {{1, 1}, {1, 0}, {1, -1}, {0, 1}});
    }
  }
}

bool KeyedTexture::is_clear(float u, float v, float footprint_uv) const {
  constexpr int run = KeyedFrame::run;
  const int columns = (width() + run - 1) / run;
  const auto block = [](float place, int size) {
    const float at = std::clamp(place, 0.0F, 1.0F) * static_cast<float>(size);
    return std::min(static_cast<int>(at), size - 1) / run;
  };
  if (!(std::abs(u) < 1e6F && std::abs(v) < 1e6F)) return false;
  const std::size_t here =
      static_cast<std::size_t>(block(v, height())) * static_cast<std::size_t>(columns) +
      static_cast<std::size_t>(block(u, width()));
  const float side = std::sqrt(static_cast<float>(width()) * static_cast<float>(height()));
  // Look-ups reach no further from their middle: a quarter of the footprint to their places, and
  // from there one and a half texels of a level, less than .7 of it, or of odd sizes 1.4.
  const float reach = 1.5F + 2.5F * std::max(footprint_uv, 0.0F) * side;
  return static_cast<float>((bare_[here] - 1) * run) >= reach;
}

void KeyedTexture::finish() {
  find_bare();
  std::size_t k = 0;
  for (; level(k).width > 1 || level(k).height > 1; ++k) {
    if (coarser_.size() == k) coarser_.emplace_back();
    const HalfImage& from = level(k);
    HalfImage& to = coarser_[k];
    size_level(to, std::max(1, from.height / 2), std::max(1, from.width / 2));
    const bool even = from.width % 2 == 0 && from.height % 2 == 0;
    if (!even) {
      halve_odd(from, to);
    } else if (k == 0) {
      halve_frame(frame_, to);
    } else {
      for (int y = 0; y < to.height; ++y) {
        halve_rows(&from.pixels[from.index(2 * y, 0)], &from.pixels[from.index(2 * y + 1, 0)],
                   &to.pixels[to.index(y, 0)], to.width);
      }
    }
  }
  coarser_.resize(k);
}

void KeyedTexture::take(const capture::Image& frame) {
  render::check_video_size(frame.width, frame.height);
  if (frame.channels != 3 && frame.channels != 4) {
    throw std::invalid_argument("a person's picture has 3 or 4 channels, not " +
                                std::to_string(frame.channels));
  }
  frame_.set(frame);
  finish();
}

std::array<float, 4> KeyedTexture::filtered(float u, float v, float footprint_uv) const {
  const auto unit = [](float value) {
    return std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : 0.0F;
  };
  const auto width = static_cast<float>(this->width()), height = static_cast<float>(this->height());
  const float footprint = std::min(footprint_uv * std::sqrt(width * height), 1e6F);  // texels
  const auto texels = [](float place, int size) {
    const auto n = static_cast<float>(size);
    return std::clamp(place * n - 0.5F, 0.0F, n - 1);
  };
  const auto answer = [](Four sum) { return std::array{sum[0], sum[1], sum[2], sum[3]}; };
  if (!(footprint > 1)) {
    const HalfImage& at = level(0);
    return answer(bilinear(at, texels(unit(u), at.width), texels(unit(v), at.height)));
  }
  // Four interpolated texels this far from the middle spread as far as a square of texels does.
  const float apart =
      footprint < 2 ? std::sqrt((footprint * footprint - 1) / 12) : 0.25F * footprint;
  const float level_of = std::max(0.0F, std::log2(render::trilinear_texel * 0.5F * footprint));
  const auto fine = std::min(static_cast<std::size_t>(level_of), coarser_.size());
  const float share = fine < coarser_.size() ? level_of - static_cast<float>(fine) : 0;
  const float left = unit(u - apart / width), right = unit(u + apart / width);
  const float top = unit(v - apart / height), bottom = unit(v + apart / height);
  const auto look = [&]<int reach>(std::size_t k) {
    const HalfImage& at = level(k);
    return filtered_in<reach>(at, texels(left, at.width), texels(right, at.width),
                              texels(top, at.height), texels(bottom, at.height));
  };
  // The four places are less than three texels of the finer level from each other.
  Four sum = look.operator()<6>(fine);
  if (share > 0) sum += (look.operator()<4>(fine + 1) - sum) * share;
  return answer(sum);
}

std::shared_ptr<const KeyedTexture> make_keyed_texture(const capture::Image& frame) {
  auto texture = std::make_shared<KeyedTexture>();
  texture->take(frame);
  return texture;
}

}  // namespace compositing
