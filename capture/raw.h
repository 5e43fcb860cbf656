// Sensors' own codes, as cameras pack them, and colour from a Bayer mosaic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/crop.h"
#include "capture/image.h"

namespace capture {

// How codes lie in memory, row by row.
enum class Packing {
  bytes,   // 8 bits each
  words,   // 9 to 16 bits each, in the low bits of little-endian words
  mipi10,  // 4 in 5 bytes: their upper 8 bits, and then the lower 2 of all, the first one's lowest
  mipi12,  // 2 in 3 bytes: their upper 8 bits, and then the lower 4 of both
};

// The colours of the first two sites of the first two rows.
enum class BayerPattern { none, rggb, grbg, gbrg, bggr };  // none = grey

struct RawLayout {
  BayerPattern pattern = BayerPattern::none;
  Packing packing = Packing::bytes;
  int bits = 8;
};

// Bytes that a row takes, without what pads it. Throws std::invalid_argument unless width > 0.
std::size_t packed_row_bytes(Packing packing, int width);

// Codes of a row, one for each of `to`, each 0 .. 2^bits - 1: bits above are left out. `from` holds
// at least packed_row_bytes; else, and for bits that the packing has not, throws
// std::invalid_argument.
void unpack_row(Packing packing,
                int bits,
                std::span<const std::byte> from,
                std::span<std::uint16_t> to);

// One value per site, with a margin of two sites all around.
struct Mosaic {
  static constexpr int margin = 2;
  int width = 0;
  int height = 0;
  std::vector<float> sites;  // (height + 4, width + 4)

  // Throws std::invalid_argument if a side is under 4.
  void resize(int new_width, int new_height);
  std::ptrdiff_t stride() const { return width + std::ptrdiff_t{2} * margin; }
  float* row(int y) { return sites.data() + (y + margin) * stride() + margin; }
  const float* row(int y) const { return sites.data() + (y + margin) * stride() + margin; }
};

// The colour of a site, as in Image: 0 red, 1 green, 2 blue. `pattern` is not none.
int colour_of_site(BayerPattern pattern, int y, int x);

// Colour of a part of a mosaic, into `image`: (crop.height, crop.width, 3). A site's own colour
// stays as it is; the others are clamped, so that nothing is brighter than what saturates, 1, or
// darker than black, 0, or the darkest site: noise at black has no colour.
// Fills the margin by reflection about the outer sites, which keeps the pattern. Exact, inside, for
// colours that change linearly across the picture.
//
// Malvar, He and Cutler, "High-Quality Linear Interpolation for Demosaicing of Bayer-Patterned
// Color Images", ICASSP 2004, figure 2: bilinear interpolation, corrected by the Laplacian of the
// colour that the site has.
//
// Throws std::invalid_argument if `crop` reaches beyond the mosaic, or `pattern` is none.
void demosaic(Mosaic& mosaic, BayerPattern pattern, const Crop& crop, Image& image);

// Sets colours to NaN that demosaic() took from sites among which some have `saturation` or more,
// and some less, up to two rows and columns away: they are darker than the light was. What a
// pixel's own site measured stays; so does what comes of nothing but saturated sites, and is
// saturated. `image` is what demosaic() made of `mosaic` with this `crop`.
void mark_saturated(
    const Mosaic& mosaic, BayerPattern pattern, float saturation, const Crop& crop, Image& image);

}  // namespace capture
