// Which pixels of a cell see which light.
#include "render/visibility_finder.h"

namespace render {

bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b) {
  return r.surface[a] == r.surface[b] &&
         r.nx[a] * r.nx[b] + r.ny[a] * r.ny[b] + r.nz[a] * r.nz[b] > alike_normals;
}

namespace {

// Where the surfaces of whole blocks end.
void find_ends(const Receivers& r, GatherWorkspace& w) {
  constexpr std::size_t side = 4;
  w.ends = {};
  for (std::size_t block = 0; block < w.ends.size(); ++block) {
    const std::size_t bx = block % side * side, by = block / side * side;
    const std::size_t corner = by * cell_size + bx;
    if (!in(w.same4, corner)) continue;
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
    w.ends[block] = static_cast<std::uint8_t>((left ? 0 : ends_left) | (right ? 0 : ends_right) |
                                              (above ? 0 : ends_above) | (below ? 0 : ends_below));
  }
}

}  // namespace

void find_smooth_blocks(const Receivers& r, GatherWorkspace& w) {
  const auto alike = [&r](std::size_t a, std::size_t b) { return is_one_surface(r, a, b); };
  w.same4 = w.same2 = {};
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
  for (int by = 0; by < cell_size; by += 4) {
    for (int bx = 0; bx < cell_size; bx += 4) {
      const auto k = static_cast<std::size_t>(by * cell_size + bx);
      const std::uint64_t bits = block4 << bx;
      if ((w.same2[k / 64] & bits) != bits) continue;
      if (alike(k, k + 3) && alike(k, k + 3 * cell_size) && alike(k, k + 3 * cell_size + 3) &&
          alike(k, k + cell_size + 2)) {
        w.same4[k / 64] |= bits;
      }
    }
  }
  find_ends(r, w);
}

}  // namespace render
