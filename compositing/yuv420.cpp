// Display RGB of 8 bits to the Y'CbCr 4:2:0 that video files hold.
#include "compositing/yuv420.h"

#include <stdexcept>
#include <string>

namespace compositing {
namespace {

// Luma weights of BT.709, and what they imply for chroma.
constexpr double red_weight = 0.2126;
constexpr double blue_weight = 0.0722;
constexpr double green_weight = 1 - red_weight - blue_weight;

constexpr int luma_bits = 16;
constexpr int chroma_bits = 13;  // its input is 8 times as large: two rows, 1-2-1 across

constexpr std::int32_t fixed(double value, int bits) {
  const double scaled = value * (1 << bits);
  return static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
}
constexpr std::int32_t luma(double weight) { return fixed(weight * 219 / 255, luma_bits); }
constexpr std::int32_t chroma(double weight) { return fixed(weight * 224 / 255, chroma_bits); }

constexpr std::int32_t luma_offset = fixed(16.5, luma_bits);
constexpr std::int32_t chroma_offset = fixed(128.5, chroma_bits + 3);

// Widths are arguments here, not members: bytes may alias members, and loops would not vectorise.
void separate(
    const std::uint8_t* rgb, std::size_t width, std::uint8_t* r, std::uint8_t* g, std::uint8_t* b) {
  for (std::size_t x = 0; x < width; ++x) {
    r[x] = rgb[x * 3];
    g[x] = rgb[x * 3 + 1];
    b[x] = rgb[x * 3 + 2];
  }
}

void write_luma(const std::uint8_t* r,
                const std::uint8_t* g,
                const std::uint8_t* b,
                std::size_t width,
                std::uint8_t* out) {
  for (std::size_t x = 0; x < width; ++x) {
    out[x] = static_cast<std::uint8_t>((r[x] * luma(red_weight) + g[x] * luma(green_weight) +
                                        b[x] * luma(blue_weight) + luma_offset) >>
                                       luma_bits);
  }
}

// Columns of r, g, b begin one before the picture's, so that the three about column 2x start at 2x.
void write_chroma(const std::uint16_t* r,
                  const std::uint16_t* g,
                  const std::uint16_t* b,
                  std::size_t pairs,
                  std::uint8_t* cb,
                  std::uint8_t* cr) {
  constexpr double cb_scale = 0.5 / (1 - blue_weight);
  constexpr double cr_scale = 0.5 / (1 - red_weight);
  constexpr int bits = chroma_bits + 3;
  for (std::size_t x = 0; x < pairs; ++x) {
    const std::int32_t red = r[2 * x] + 2 * r[2 * x + 1] + r[2 * x + 2];
    const std::int32_t green = g[2 * x] + 2 * g[2 * x + 1] + g[2 * x + 2];
    const std::int32_t blue = b[2 * x] + 2 * b[2 * x + 1] + b[2 * x + 2];
    cb[x] = static_cast<std::uint8_t>((red * chroma(-red_weight * cb_scale) +
                                       green * chroma(-green_weight * cb_scale) +
                                       blue * chroma(0.5) + chroma_offset) >>
                                      bits);
    cr[x] =
        static_cast<std::uint8_t>((red * chroma(0.5) + green * chroma(-green_weight * cr_scale) +
                                   blue * chroma(-blue_weight * cr_scale) + chroma_offset) >>
                                  bits);
  }
}

// sum = first + second, one column to the right; column 0 repeats the edge.
void add_rows(const std::uint8_t* first,
              const std::uint8_t* second,
              std::size_t width,
              std::uint16_t* sum) {
  for (std::size_t x = 0; x < width; ++x) {
    sum[x + 1] = static_cast<std::uint16_t>(first[x] + second[x]);
  }
  sum[0] = sum[1];
}

}  // namespace

Yuv420Converter::Yuv420Converter(int width, int height) {
  if (width < 2 || height < 2 || width % 2 != 0 || height % 2 != 0) {
    throw std::invalid_argument("4:2:0 video needs an even width and height, not " +
                                std::to_string(width) + " x " + std::to_string(height));
  }
  width_ = static_cast<std::size_t>(width);
  height_ = static_cast<std::size_t>(height);
  rows_.resize(6 * width_);
  sums_.resize(3 * (width_ + 1));
}

void Yuv420Converter::convert(std::span<const std::uint8_t> rgb, const Yuv420Planes& planes) {
  if (rgb.size() != width_ * height_ * 3) {
    throw std::invalid_argument("the picture has " + std::to_string(rgb.size()) + " values, not " +
                                std::to_string(width_ * height_ * 3));
  }
  const std::size_t width = width_;
  for (std::size_t y = 0; y < height_; ++y) {
    std::uint8_t* const r = rows_.data() + y % 2 * 3 * width;
    std::uint8_t* const g = r + width;
    std::uint8_t* const b = g + width;
    separate(rgb.data() + y * width * 3, width, r, g, b);
    write_luma(r, g, b, width, planes.y + static_cast<std::ptrdiff_t>(y) * planes.y_stride);
    if (y % 2 == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint8_t* const row = rows_.data() + c * width;
      add_rows(row, row + 3 * width, width, sums_.data() + c * (width + 1));
    }
    const std::uint16_t* const red = sums_.data();
    const auto chroma_row = static_cast<std::ptrdiff_t>(y / 2);
    write_chroma(red, red + width + 1, red + 2 * (width + 1), width / 2,
                 planes.cb + chroma_row * planes.cb_stride,
                 planes.cr + chroma_row * planes.cr_stride);
  }
}

}  // namespace compositing
