// Sensors' own codes, and colour from them.
#include "capture/raw.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

int byte_at(std::span<const std::byte> bytes, std::size_t i) {
  return std::to_integer<int>(bytes[i]);
}

// Where red is in each 2 by 2 sites.
struct RedSite {
  int y;
  int x;
};

RedSite red_site(BayerPattern pattern) {
  switch (pattern) {
    case BayerPattern::rggb:
      return {0, 0};
    case BayerPattern::grbg:
      return {0, 1};
    case BayerPattern::gbrg:
      return {1, 0};
    case BayerPattern::bggr:
      return {1, 1};
    case BayerPattern::none:
      break;
  }
  throw std::invalid_argument("a grey sensor has no colours");
}

void fill_margin(Mosaic& mosaic) {
  for (int y = 0; y < mosaic.height; ++y) {
    float* const row = mosaic.row(y);
    for (int i = 1; i <= Mosaic::margin; ++i) {
      row[-i] = row[i];
      row[mosaic.width - 1 + i] = row[mosaic.width - 1 - i];
    }
  }
  const auto copy = [&](int from, int to) {
    std::copy_n(mosaic.row(from) - Mosaic::margin, mosaic.stride(),
                mosaic.row(to) - Mosaic::margin);
  };
  for (int i = 1; i <= Mosaic::margin; ++i) {
    copy(i, -i);
    copy(mosaic.height - 1 - i, mosaic.height - 1 + i);
  }
}

// That of the darkest site, but not above 0: noise at black has either sign.
float darkest(const Mosaic& mosaic) {
  constexpr int lanes = 8;
  std::array<float, lanes> least{};
  for (int y = 0; y < mosaic.height; ++y) {
    const float* const row = mosaic.row(y);
    int x = 0;
    for (; x + lanes <= mosaic.width; x += lanes) {
      for (int i = 0; i < lanes; ++i) {
        float& its = least[static_cast<std::size_t>(i)];
        its = std::min(its, row[x + i]);
      }
    }
    for (; x < mosaic.width; ++x) least[0] = std::min(least[0], row[x]);
  }
  return *std::ranges::min_element(least);
}

// Sums of a site's neighbours, and itself.
struct Neighbours {
  Neighbours(const float* site, std::ptrdiff_t down, float darkest)
      : least(darkest),
        own(site[0]),
        beside(site[-1] + site[1]),
        above(site[-down] + site[down]),
        diagonal(site[-down - 1] + site[-down + 1] + site[down - 1] + site[down + 1]),
        far_beside(site[-2] + site[2]),
        far_above(site[-2 * down] + site[2 * down]) {}

  float green() const {
    return limited((4 * own + 2 * (beside + above) - (far_beside + far_above)) / 8);
  }
  // The colour of the sites left and right of a green one, and of those above and below.
  float colour_beside() const {
    return limited((5 * own + 4 * beside - diagonal - far_beside + far_above / 2) / 8);
  }
  float colour_above() const {
    return limited((5 * own + 4 * above - diagonal - far_above + far_beside / 2) / 8);
  }
  // Blue at red, red at blue.
  float opposite() const {
    return limited((6 * own + 2 * diagonal - 1.5F * (far_beside + far_above)) / 8);
  }

  float limited(float light) const { return std::clamp(light, least, 1.0F); }

  float least, own, beside, above, diagonal, far_beside, far_above;
};

}  // namespace

std::size_t packed_row_bytes(Packing packing, int width) {
  if (width < 1) throw std::invalid_argument("a row without sites");
  const auto sites = static_cast<std::size_t>(width);
  switch (packing) {
    case Packing::words:
      return 2 * sites;
    case Packing::mipi10:
      return (sites + 3) / 4 * 5;
    case Packing::mipi12:
      return (sites + 1) / 2 * 3;
    case Packing::bytes:
      break;
  }
  return sites;
}

void unpack_row(Packing packing,
                int bits,
                std::span<const std::byte> from,
                std::span<std::uint16_t> to) {
  const bool fits = packing == Packing::bytes    ? bits == 8
                    : packing == Packing::mipi10 ? bits == 10
                    : packing == Packing::mipi12 ? bits == 12
                                                 : bits > 8 && bits <= 16;
  if (!fits || from.size() < packed_row_bytes(packing, static_cast<int>(to.size()))) {
    throw std::invalid_argument("a row of codes that is too short, or packed otherwise");
  }
  const int mask = (1 << bits) - 1;
  const auto fill = [&](auto code_at) {
    for (std::size_t x = 0; x < to.size(); ++x) to[x] = static_cast<std::uint16_t>(code_at(x));
  };
  switch (packing) {
    case Packing::bytes:
      return fill([&](std::size_t x) { return byte_at(from, x); });
    case Packing::words:
      return fill([&](std::size_t x) {
        return (byte_at(from, 2 * x) | byte_at(from, 2 * x + 1) << 8) & mask;
      });
    case Packing::mipi10:
      return fill([&](std::size_t x) {
        const std::size_t group = x / 4 * 5;
        const int low = byte_at(from, group + 4) >> (2 * (x % 4)) & 3;
        return byte_at(from, group + x % 4) << 2 | low;
      });
    case Packing::mipi12:
      return fill([&](std::size_t x) {
        const std::size_t group = x / 2 * 3;
        const int low = byte_at(from, group + 2) >> (4 * (x % 2)) & 15;
        return byte_at(from, group + x % 2) << 4 | low;
      });
  }
}

void Mosaic::resize(int new_width, int new_height) {
  if (new_width < 2 * margin || new_height < 2 * margin) {
    throw std::invalid_argument("a mosaic needs 4 sites a side");
  }
  width = new_width;
  height = new_height;
  sites.resize(static_cast<std::size_t>(stride()) *
               (static_cast<std::size_t>(height) + 2 * static_cast<std::size_t>(margin)));
}

int colour_of_site(BayerPattern pattern, int y, int x) {
  const RedSite red = red_site(pattern);
  const bool red_row = y % 2 == red.y;
  const bool red_column = x % 2 == red.x;
  if (red_row != red_column) return 1;
  return red_row ? 0 : 2;
}

void demosaic(Mosaic& mosaic, BayerPattern pattern, const Crop& crop, Image& image) {
  const RedSite red = red_site(pattern);
  if (crop.x < 0 || crop.y < 0 || crop.width < 1 || crop.height < 1 ||
      crop.x > mosaic.width - crop.width || crop.y > mosaic.height - crop.height) {
    throw std::invalid_argument("a part that reaches beyond the mosaic");
  }
  fill_margin(mosaic);
  image.height = crop.height;
  image.width = crop.width;
  image.channels = 3;
  image.pixels.resize(static_cast<std::size_t>(crop.height) * static_cast<std::size_t>(crop.width) *
                      3);
  const std::ptrdiff_t down = mosaic.stride();
  const float least = darkest(mosaic);
  for (int y = crop.y; y < crop.y + crop.height; ++y) {
    // What a row has beside green.
    const bool red_row = y % 2 == red.y;
    const int own = red_row ? 0 : 2;
    const int own_column = red_row ? red.x : 1 - red.x;
    const float* const sites = mosaic.row(y);
    float* to = image.pixels.data() + image.index(y - crop.y, 0);
    for (int x = crop.x; x < crop.x + crop.width; ++x, to += 3) {
      const Neighbours near(sites + x, down, least);
      if (x % 2 == own_column) {
        to[own] = near.own;
        to[1] = near.green();
        to[2 - own] = near.opposite();
      } else {
        to[own] = near.colour_beside();
        to[1] = near.own;
        to[2 - own] = near.colour_above();
      }
    }
  }
}

void mark_saturated(
    const Mosaic& mosaic, BayerPattern pattern, float saturation, const Crop& crop, Image& image) {
  constexpr int reach = Mosaic::margin;
  constexpr std::uint8_t side = 2 * reach + 1;
  const auto width = static_cast<std::size_t>(crop.width);
  std::vector<std::uint8_t> above(width + 2 * reach);  // columns from crop.x - reach on
  std::vector<std::uint8_t> near(above.size() - 2 * reach);
  for (int y = crop.y; y < crop.y + crop.height; ++y) {
    // Saturated sites among the rows that count, by column; then within reach of each site.
    std::ranges::fill(above, std::uint8_t{0});
    for (int from = y - reach; from <= y + reach; ++from) {
      const float* row = mosaic.row(from) + crop.x - reach;
      for (std::size_t x = 0; x < above.size(); ++x) {
        above[x] = static_cast<std::uint8_t>(above[x] + (row[x] >= saturation ? 1 : 0));
      }
    }
    std::uint8_t any = 0;
    for (const std::uint8_t one : above) any |= one;
    if (any == 0) continue;
    std::ranges::fill(near, std::uint8_t{0});
    for (std::size_t i = 0; i < side; ++i) {
      for (std::size_t x = 0; x < width; ++x) {
        near[x] = static_cast<std::uint8_t>(near[x] + above[x + i]);
      }
    }
    const std::array own{colour_of_site(pattern, y, crop.x),
                         colour_of_site(pattern, y, crop.x + 1)};
    float* to = image.pixels.data() + image.index(y - crop.y, 0);
    for (std::size_t x = 0; x < width; ++x, to += 3) {
      if (near[x] == 0 || near[x] == side * side) continue;
      for (int c = 0; c < 3; ++c) {
        if (c != own[x % 2]) to[c] = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
}

}  // namespace capture
