// The smooth surfaces of a cell.
#include "render/smooth_blocks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "render/lanes.h"

namespace render {

bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b) {
  return r.surface[a] == r.surface[b] &&
         r.nx[a] * r.nx[b] + r.ny[a] * r.ny[b] + r.nz[a] * r.nz[b] > alike_normals;
}

namespace {

constexpr std::size_t side = 4;  // of a block
using Region = GatherWorkspace::Region;

std::uint64_t bit_at(std::size_t k) { return std::uint64_t{1} << (k % 64); }

// Pixels of one surface with the next one to the right, below, and diagonally below.
struct AlikePixels {
  CellMask right{}, below{}, diagonal{};

  explicit AlikePixels(const Receivers& r) {
    // With room behind them, for those below the last row.
    constexpr std::size_t beyond = cell_size + 8;
    std::array<float, cell_pixels + beyond> nx{}, ny{}, nz{};
    std::array<std::int32_t, cell_pixels + beyond> surface{};
    std::ranges::copy(r.nx, nx.begin()), std::ranges::copy(r.ny, ny.begin());
    std::ranges::copy(r.nz, nz.begin());
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      surface[k] = in(r.active, k) ? static_cast<std::int32_t>(r.surface[k]) : -1;
    }
    using Numbers = std::int32_t __attribute__((vector_size(32)));
    const auto numbers = [&surface](std::size_t k) {
      Numbers v;
      std::memcpy(&v, &surface[k], sizeof v);
      return v;
    };
    for (std::size_t k = 0; k < cell_pixels; k += 8) {
      const Eight x = load_eight(&nx[k]), y = load_eight(&ny[k]), z = load_eight(&nz[k]);
      const Numbers here = numbers(k);
      const auto alike = [&](std::size_t to) {
        const Eight cosine =
            x * load_eight(&nx[k + to]) + y * load_eight(&ny[k + to]) + z * load_eight(&nz[k + to]);
        return std::uint64_t{
                   bits_of((here >= 0) & (here == numbers(k + to)) & (cosine > alike_normals))}
               << (k % 64);
      };
      right[k / 64] |= alike(1), below[k / 64] |= alike(cell_size);
      diagonal[k / 64] |= alike(cell_size + 1);
    }
    constexpr std::uint64_t last_column = 0x8000800080008000ULL, last_row = 0xFFFFULL << 48;
    for (std::size_t word = 0; word < 4; ++word) {
      right[word] &= ~last_column, diagonal[word] &= ~last_column;
    }
    below[3] &= ~last_row, diagonal[3] &= ~last_row;
  }

  // Those that are of one surface with the one to the left, and above.
  std::uint64_t left_of(std::size_t word) const { return right[word] << 1; }
  std::uint64_t above_of(std::size_t word) const {
    return below[word] << cell_size | (word > 0 ? below[word - 1] >> 48 : 0);
  }
  // Those beside which there is another surface, or the end of the cell.
  std::uint64_t outermost(std::size_t word) const {
    return ~(right[word] & left_of(word) & below[word] & above_of(word));
  }
};

// Sides on which the surface of a whole block ends.
std::uint8_t find_ends(const AlikePixels& alike, std::size_t word, std::size_t bx) {
  constexpr std::uint64_t column = 0x0001000100010001ULL, row = 0xF;
  const auto ends = [bx](std::uint64_t goes_on, std::uint64_t edge, unsigned which) {
    return (goes_on & edge << bx) == edge << bx ? 0U : which;
  };
  return static_cast<std::uint8_t>(ends(alike.left_of(word), column, ends_left) |
                                   ends(alike.right[word], column << 3, ends_right) |
                                   ends(alike.above_of(word), row, ends_above) |
                                   ends(alike.below[word], row << 48, ends_below));
}

bool is_smooth_block(const Receivers& r, const CellMask& same2, std::size_t bx, std::size_t by) {
  const std::size_t k = by * cell_size + bx;
  const std::uint64_t bits = block4 << bx;
  const auto alike = [&](std::size_t b) { return is_one_surface(r, k, b); };
  return (same2[by / 4] & bits) == bits && alike(k + 3) && alike(k + 3 * cell_size) &&
         alike(k + 3 * cell_size + 3) && alike(k + cell_size + 2);
}

// Whether a surface goes on from one pixel to another: not where a part of it stands before
// another that looks the same way.
bool is_flat_between(const Receivers& r, std::size_t a, std::size_t b) {
  constexpr float steep = 0.5F;
  const Vec3f way{r.px[b] - r.px[a], r.py[b] - r.py[a], r.pz[b] - r.pz[a]};
  const float height = r.gx[a] * way.x + r.gy[a] * way.y + r.gz[a] * way.z;
  return height * height <= steep * steep * dot(way, way);
}

void find_regions(const Receivers& r, const AlikePixels& alike, GatherWorkspace& w) {
  w.region_count = 0;
  for (std::size_t by = 0; by < cell_size; by += side) {
    for (std::size_t bx = 0; bx < cell_size; bx += side) {
      const std::size_t word = by / 4;
      std::uint64_t left = r.active[word] & block4 << bx;
      const bool whole = is_smooth_block(r, w.same2, bx, by);
      while (left != 0) {
        Region& region = w.regions[w.region_count++];
        region.word = static_cast<std::uint8_t>(word);
        region.column = static_cast<std::uint8_t>(bx);
        region.whole = whole;
        if (whole) {
          region.pixels = left;
          region.outermost = 0;
          region.ends = find_ends(alike, word, bx);
        } else {
          const std::size_t first = word * 64 + static_cast<std::size_t>(std::countr_zero(left));
          region.pixels = bit_at(first);  // even if its normal is none
          for (std::uint64_t others = left; others != 0; others &= others - 1) {
            const std::size_t k = word * 64 + static_cast<std::size_t>(std::countr_zero(others));
            if (is_one_surface(r, first, k) && is_flat_between(r, first, k)) {
              region.pixels |= bit_at(k);
            }
          }
          region.ends = 0;
          region.outermost = region.pixels & alike.outermost(word);
        }
        left &= ~region.pixels;
      }
    }
  }
}

// Which regions are of one surface.
void find_neighbours(const Receivers& r, GatherWorkspace& w) {
  const std::size_t count = w.region_count;
  const auto surface = [&](const Region& region) {
    return r.surface[region.word * 64U + static_cast<std::size_t>(std::countr_zero(region.pixels))];
  };
  for (std::size_t a = 0; a < count; ++a) w.regions[a].beside = w.regions[a].alike = CellMask{};
  for (std::size_t a = 0; a < count; ++a) {
    Region& one = w.regions[a];
    for (std::size_t b = a; b < count; ++b) {
      Region& other = w.regions[b];
      if (surface(one) != surface(other)) continue;
      one.alike[b / 64] |= bit_at(b), other.alike[a / 64] |= bit_at(a);
      if (other.word - one.word > 1 || std::abs(one.column - other.column) > 4) continue;
      one.beside[b / 64] |= bit_at(b), other.beside[a / 64] |= bit_at(a);
    }
  }
}

}  // namespace

void find_smooth_blocks(const Receivers& r, GatherWorkspace& w) {
  constexpr std::uint64_t corners = 0x0000555500005555ULL;  // top left, of 2x2 blocks
  const AlikePixels alike(r);
  for (std::size_t word = 0; word < 4; ++word) {
    std::uint64_t same = alike.right[word] & alike.below[word] & alike.diagonal[word] & corners;
    same |= same << 1;
    w.same2[word] = same | same << cell_size;
  }
  find_regions(r, alike, w);
  find_neighbours(r, w);
}

}  // namespace render
