// Which pixels of a cell see which light.
#include "render/visibility_finder.h"

namespace render {

bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b) {
  return r.surface[a] == r.surface[b] &&
         r.nx[a] * r.nx[b] + r.ny[a] * r.ny[b] + r.nz[a] * r.nz[b] > alike_normals;
}

namespace {

constexpr std::size_t side = 4;  // of a block
using Region = GatherWorkspace::Region;

// Sides on which the surface of a whole block ends.
std::uint8_t find_ends(const Receivers& r, std::size_t bx, std::size_t by) {
  const std::size_t corner = by * cell_size + bx;
  // Along a side, from a corner on by `step`: whether it goes on at pixels that are `across`
  // away.
  const auto goes_on = [&](std::size_t from, std::size_t step, std::size_t across) {
    for (std::size_t i = 0; i < side; ++i) {
      const std::size_t k = from + i * step, beside = k + across;
      if (!in(r.active, beside) || !is_one_surface(r, k, beside)) return false;
    }
    return true;
  };
  constexpr auto back = [](std::size_t step) { return ~step + 1; };
  const std::size_t last_column = corner + side - 1;
  const std::size_t last_row = corner + (side - 1) * cell_size;
  const bool left = bx > 0 && goes_on(corner, cell_size, back(1));
  const bool right = bx + side < cell_size && goes_on(last_column, cell_size, 1);
  const bool above = by > 0 && goes_on(corner, 1, back(cell_size));
  const bool below = by + side < cell_size && goes_on(last_row, 1, cell_size);
  return static_cast<std::uint8_t>((left ? 0 : ends_left) | (right ? 0 : ends_right) |
                                   (above ? 0 : ends_above) | (below ? 0 : ends_below));
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

std::uint64_t bit_at(std::size_t k) { return std::uint64_t{1} << (k % 64); }

// Of a region, the pixels beside which there is another surface, or the end of the cell.
std::uint64_t find_outermost(const Receivers& r, const Region& region) {
  std::uint64_t outermost = 0;
  for (std::uint64_t left = region.pixels; left != 0; left &= left - 1) {
    const std::size_t k = region.word * 64U + static_cast<std::size_t>(std::countr_zero(left));
    const std::size_t x = k % cell_size, y = k / cell_size;
    const auto goes_on = [&](bool inside, std::size_t beside) {
      return inside && in(r.active, beside) && is_one_surface(r, k, beside);
    };
    if (!goes_on(x > 0, k - 1) || !goes_on(x + 1 < cell_size, k + 1) ||
        !goes_on(y > 0, k - cell_size) || !goes_on(y + 1 < cell_size, k + cell_size)) {
      outermost |= bit_at(k);
    }
  }
  return outermost;
}

void find_regions(const Receivers& r, GatherWorkspace& w) {
  w.region_count = 0;
  for (std::size_t by = 0; by < cell_size; by += side) {
    for (std::size_t bx = 0; bx < cell_size; bx += side) {
      const std::size_t word = by / 4;
      std::uint64_t left = r.active[word] & block4 << bx;
      const bool whole = is_smooth_block(r, w.same2, bx, by);
      while (left != 0) {
        Region& region = w.regions[w.region_count++];
        region.word = static_cast<std::uint8_t>(word),
        region.column = static_cast<std::uint8_t>(bx);
        region.whole = whole;
        if (whole) {
          region.pixels = left;
          region.outermost = 0;
          region.ends = find_ends(r, bx, by);
        } else {
          const std::size_t first = word * 64 + static_cast<std::size_t>(std::countr_zero(left));
          region.pixels = 0;
          for (std::uint64_t others = left; others != 0; others &= others - 1) {
            const std::size_t k = word * 64 + static_cast<std::size_t>(std::countr_zero(others));
            if (is_one_surface(r, first, k) && is_flat_between(r, first, k)) {
              region.pixels |= bit_at(k);
            }
          }
          region.ends = 0;
          region.outermost = find_outermost(r, region);
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
  const auto alike = [&r](std::size_t a, std::size_t b) { return is_one_surface(r, a, b); };
  w.same2 = {};
  for (int by = 0; by < cell_size; by += 2) {
    for (int bx = 0; bx < cell_size; bx += 2) {
      const auto k = static_cast<std::size_t>(by * cell_size + bx);
      const std::uint64_t bits = block2 << bit_of(bx, by);
      if ((r.active[k / 64] & bits) != bits) continue;
      if (alike(k, k + 1) && alike(k, k + cell_size) && alike(k, k + cell_size + 1)) {
        w.same2[k / 64] |= bits;
      }
    }
  }
  find_regions(r, w);
  find_neighbours(r, w);
}

}  // namespace render
