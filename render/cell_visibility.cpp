// The light that a cell's centres get.
#include "render/cell_visibility.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "render/lanes.h"

namespace render {
namespace {

constexpr std::uint16_t whole_window = 0xFFFF;

using Plane = std::array<float, cell_pixels>;

unsigned bits_at(const CellMask& mask, std::size_t k) {
  return static_cast<unsigned>(mask[k / 64] >> (k % 64)) & ((1U << lanes) - 1);
}

// The lights that shine on any of a cell's centres: those that no window shares, those that are
// shared, and those that are hidden near some centres and shared by the others.
class LightsOfCell {
 public:
  LightsOfCell(std::span<const DirectionalLight> lights, const CellVisibility& visibility) {
    const bool shares = !visibility.windows.empty();
    const std::size_t count =
        std::min({lights.size(), visibility.lit.size(), std::size_t{most_lights}});
    for (std::size_t i = 0; i < count; ++i) {
      if (visibility.lit[i] == CellMask{}) continue;
      const bool soft = shares && SoftLights::has_parts(lights[i]);
      List& list = !soft ? own_ : visibility.near[i] == CellMask{} ? shared_ : both_;
      list.lights[list.count++] = static_cast<std::uint16_t>(i);
    }
  }
  std::span<const std::uint16_t> own() const { return own_.span(); }
  std::span<const std::uint16_t> shared() const { return shared_.span(); }
  std::span<const std::uint16_t> both() const { return both_.span(); }

 private:
  struct List {
    std::array<std::uint16_t, most_lights> lights;
    std::size_t count = 0;
    std::span<const std::uint16_t> span() const { return std::span(lights).first(count); }
  };
  List own_, shared_, both_;
};

struct LaneNormals {
  Lanes x, y, z;
};

// Of some centres beside each other.
struct LaneSums {
  Lanes open_r = all(0), open_g = all(0), open_b = all(0);
  Lanes lost_r = all(0), lost_g = all(0), lost_b = all(0);

  // A light that shines on these centres, and from which of them it is hidden.
  void add_light(const LaneNormals& n, const DirectionalLight& l, unsigned lit, unsigned hidden) {
    if (!lit) return;
    const Lanes cosine = both(dot(n.x, n.y, n.z, l.direction), mask_of(lit));
    const Lanes r = multiply(cosine, all(l.irradiance.x));
    const Lanes g = multiply(cosine, all(l.irradiance.y));
    const Lanes b = multiply(cosine, all(l.irradiance.z));
    open_r = add(open_r, r), open_g = add(open_g, g), open_b = add(open_b, b);
    if (!(lit & hidden)) return;
    const Lanes mask = mask_of(hidden);
    lost_r = add(lost_r, both(r, mask));
    lost_g = add(lost_g, both(g, mask));
    lost_b = add(lost_b, both(b, mask));
  }
  void add_sums(const LaneSums& o) {
    open_r = add(open_r, o.open_r), open_g = add(open_g, o.open_g), open_b = add(open_b, o.open_b);
    lost_r = add(lost_r, o.lost_r), lost_g = add(lost_g, o.lost_g), lost_b = add(lost_b, o.lost_b);
  }
  void store_at(std::size_t k, LightSums& to) const {
    store(&to.open_r[k], open_r), store(&to.open_g[k], open_g), store(&to.open_b[k], open_b);
    store(&to.lost_r[k], lost_r), store(&to.lost_g[k], lost_g), store(&to.lost_b[k], lost_b);
  }
};

// Of every 4x4 that lies in the cell, at its top left.
void add_up_windows(const Plane& of, Plane& sums) {
  constexpr std::size_t last = SoftLights::side - 1;
  Plane rows;
  for (std::size_t k = 0; k + last < cell_pixels; ++k) {
    rows[k] = (of[k] + of[k + 1]) + (of[k + 2] + of[k + 3]);
  }
  for (std::size_t k = 0; k + last * (cell_size + 1) < cell_pixels; ++k) {
    sums[k] = (rows[k] + rows[k + cell_size]) + (rows[k + 2 * cell_size] + rows[k + 3 * cell_size]);
  }
}

float sum_of_members(const ShadowWindow& window, const Plane& of) {
  constexpr std::size_t side = SoftLights::side;
  float sum = 0;
  for (unsigned left = window.members; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    sum += of[window.first + i / side * cell_size + i % side];
  }
  return sum;
}

// What pixels have between whole windows, `of` at their top left, along lines of a cell that are
// `stride` apart in places that are `step` apart: half way between the two about them, and at the
// border of the cell, beyond the last one, by how that differs from the next that shares no pixel
// with it.
template <std::size_t step, std::size_t stride>
void put_between_windows(const Plane& of, Plane& between) {
  constexpr std::size_t side = SoftLights::side, last = cell_size - side;
  const auto line = [](std::size_t place) { return place * step; };
  const auto each = [](auto&& put) {
    for (std::size_t k = 0; k < cell_size * stride; k += stride) put(k);
  };
  for (std::size_t place = 2; place < last + 2; ++place) {
    each([&](std::size_t k) {
      between[k + line(place)] = 0.5F * (of[k + line(place - 2)] + of[k + line(place - 1)]);
    });
  }
  const auto beyond = [&](std::size_t place, std::size_t window, std::size_t next, float by) {
    each([&](std::size_t k) {
      const float here = of[k + line(window)];
      between[k + line(place)] = here + (here - of[k + line(next)]) * (by / side);
    });
  };
  beyond(0, 0, side, 1.5F), beyond(1, 0, side, 0.5F);
  beyond(last + 2, last, last - side, 0.5F), beyond(last + 3, last, last - side, 1.5F);
}

// In one colour.
void share_lost(std::span<const ShadowWindow> windows,
                const Plane& open,
                const Plane& own_lost,
                Plane& lost) {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  alignas(64) Plane open_sums, lost_sums, shares, rows, between;
  add_up_windows(open, open_sums);
  add_up_windows(own_lost, lost_sums);
  shares.fill(unknown);
  for (const ShadowWindow& window : windows) {
    const std::size_t first = window.first;
    if (window.members == whole_window) shares[first] = lost_sums[first] / open_sums[first];
  }
  put_between_windows<1, cell_size>(shares, rows);
  put_between_windows<cell_size, 1>(rows, between);
  for (const ShadowWindow& window : windows) {
    const std::size_t k = window.centre;
    float share = unknown;
    if (window.members == whole_window) {
      share = between[k] == between[k] ? std::clamp(between[k], 0.0F, 1.0F) : shares[window.first];
    } else {
      share = sum_of_members(window, own_lost) / sum_of_members(window, open);
    }
    if (share == share) lost[k] += open[k] * share - own_lost[k];  // some of it is open
  }
}

}  // namespace

void CellVisibility::clear() {
  lit.clear(), seen.clear(), near.clear();
  tints.clear(), windows.clear();
}

void add_up_light(const LitCentres& centres,
                  std::span<const DirectionalLight> lights,
                  const CellVisibility& visibility,
                  LightSums& sums,
                  LightSums& soft) {
  const bool shares = !visibility.windows.empty();
  const LightsOfCell of_cell(lights, visibility);
  for (std::size_t k = 0; k < cell_pixels; k += lanes) {
    LaneSums own, shared;
    if (bits_at(centres.receiving, k)) {
      const LaneNormals normals{load(&centres.nx[k]), load(&centres.ny[k]), load(&centres.nz[k])};
      for (const std::uint16_t i : of_cell.own()) {
        own.add_light(normals, lights[i], bits_at(visibility.lit[i], k),
                      ~bits_at(visibility.seen[i], k));
      }
      for (const std::uint16_t i : of_cell.shared()) {
        shared.add_light(normals, lights[i], bits_at(visibility.lit[i], k),
                         ~bits_at(visibility.seen[i], k));
      }
      for (const std::uint16_t i : of_cell.both()) {
        const unsigned lit = bits_at(visibility.lit[i], k), near = bits_at(visibility.near[i], k);
        const unsigned hidden = ~bits_at(visibility.seen[i], k);
        own.add_light(normals, lights[i], lit & near, hidden);
        shared.add_light(normals, lights[i], lit & ~near, hidden);
      }
    }
    if (shares) {
      shared.store_at(k, soft);
      own.add_sums(shared);
    }
    own.store_at(k, sums);
  }
  for (const TintedLight& tint : visibility.tints) {
    const std::size_t k = tint.centre;
    const Vec3f normal{centres.nx[k], centres.ny[k], centres.nz[k]};
    const DirectionalLight& l = lights[tint.light];
    const Vec3f lost = l.irradiance * tint.lost_share * dot(normal, l.direction);
    sums.add_lost(k, lost);
    const bool soft_one = shares && SoftLights::has_parts(l) && !in(visibility.near[tint.light], k);
    if (soft_one) soft.add_lost(k, lost);
  }
  if (!shares) return;
  share_lost(visibility.windows, soft.open_r, soft.lost_r, sums.lost_r);
  share_lost(visibility.windows, soft.open_g, soft.lost_g, sums.lost_g);
  share_lost(visibility.windows, soft.open_b, soft.lost_b, sums.lost_b);
}

}  // namespace render
