// Which pixels of a cell see which light.
#include "render/visibility_finder.h"

namespace render {

bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b) {
  return r.surface[a] == r.surface[b] &&
         r.nx[a] * r.nx[b] + r.ny[a] * r.ny[b] + r.nz[a] * r.nz[b] > alike_normals;
}

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
}

}  // namespace render
