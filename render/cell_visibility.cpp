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

template <std::size_t count = lanes>
unsigned bits_at(const CellMask& mask, std::size_t k) {
  return static_cast<unsigned>(mask[k / 64] >> (k % 64)) & ((1U << count) - 1);
}

// Light of many directions together, on surfaces that all of it shines on: each colour's irradiance
// is the cosine to a vector.
struct LightVectors {
  Vec3f r{}, g{}, b{};
  bool any = false;

  void add(const DirectionalLight& l) {
    r += l.direction * l.irradiance.x;
    g += l.direction * l.irradiance.y;
    b += l.direction * l.irradiance.z;
    any = true;
  }
};

// Lights by what a cell's centres see of them. On most cells most lights shine on all centres or on
// none, and are hidden from all or from none: they cost nothing a pixel.
struct LightGroup {
  struct List {
    std::array<std::uint16_t, most_lights> lights;
    std::size_t count = 0;

    void add(std::size_t i) { lights[count++] = static_cast<std::uint16_t>(i); }
    std::span<const std::uint16_t> span() const { return std::span(lights).first(count); }
  };
  LightVectors open, lost;  // that shine on all, and are hidden from all
  List partly_hidden;       // that shine on all
  List partly_lit;
};

// The lights that shine on any of a cell's centres: those that no window shares, those that are
// shared, and those that are hidden near some centres and shared by the others.
class LightsOfCell {
 public:
  LightsOfCell(std::span<const DirectionalLight> lights,
               const CellMask& receiving,
               const CellVisibility& visibility) {
    const bool shares = !visibility.windows.empty();
    const std::size_t count =
        std::min({lights.size(), visibility.lit.size(), std::size_t{most_lights}});
    for (std::size_t i = 0; i < count; ++i) {
      if (none(visibility.lit[i])) continue;
      const bool soft = shares && SoftLights::has_parts(lights[i]);
      if (soft && !none(visibility.near[i])) {
        both_.add(i);
      } else {
        sort_in(soft ? shared_ : own_, lights[i], i, receiving, visibility);
      }
    }
  }
  const LightGroup& own() const { return own_; }
  const LightGroup& shared() const { return shared_; }
  std::span<const std::uint16_t> both() const { return both_.span(); }

 private:
  static void sort_in(LightGroup& group,
                      const DirectionalLight& light,
                      std::size_t i,
                      const CellMask& receiving,
                      const CellVisibility& visibility) {
    bool all_lit = true, all_seen = true, all_hidden = true;
    for (std::size_t word = 0; word < receiving.size(); ++word) {
      all_lit &= (receiving[word] & ~visibility.lit[i][word]) == 0;
      all_seen &= (receiving[word] & ~visibility.seen[i][word]) == 0;
      all_hidden &= (receiving[word] & visibility.seen[i][word]) == 0;
    }
    if (!all_lit) return group.partly_lit.add(i);
    group.open.add(light);
    if (all_seen) return;
    all_hidden ? group.lost.add(light) : group.partly_hidden.add(i);
  }

  LightGroup own_, shared_;
  LightGroup::List both_;
};

struct LaneNormals {
  Lanes x, y, z;
};

// Irradiance of some centres beside each other.
struct LaneColour {
  Lanes r = all(0), g = all(0), b = all(0);

  void add_light(Lanes cosine, Vec3f irradiance) {
    r = add(r, multiply(cosine, all(irradiance.x)));
    g = add(g, multiply(cosine, all(irradiance.y)));
    b = add(b, multiply(cosine, all(irradiance.z)));
  }
  void add_all(const LaneNormals& n, const LightVectors& v) {
    if (!v.any) return;
    r = add(r, dot(n.x, n.y, n.z, v.r));
    g = add(g, dot(n.x, n.y, n.z, v.g));
    b = add(b, dot(n.x, n.y, n.z, v.b));
  }
  void add_sums(const LaneColour& o) { r = add(r, o.r), g = add(g, o.g), b = add(b, o.b); }
};

struct LaneSums {
  LaneColour open, lost;

  // A light that shines on these centres, and from which of them it is hidden.
  void add_light(const LaneNormals& n, const DirectionalLight& l, unsigned lit, unsigned hidden) {
    if (!lit) return;
    const Lanes cosine = both(dot(n.x, n.y, n.z, l.direction), mask_of(lit));
    open.add_light(cosine, l.irradiance);
    if (lit & hidden) lost.add_light(both(cosine, mask_of(hidden)), l.irradiance);
  }
  void add_group(const LaneNormals& n,
                 std::span<const DirectionalLight> lights,
                 const LightGroup& group,
                 const CellVisibility& visibility,
                 std::size_t k) {
    open.add_all(n, group.open);
    lost.add_all(n, group.lost);
    for (const std::uint16_t i : group.partly_hidden.span()) {
      const unsigned hidden = bits_at(visibility.lit[i], k) & ~bits_at(visibility.seen[i], k);
      if (!hidden) continue;
      const DirectionalLight& l = lights[i];
      lost.add_light(both(dot(n.x, n.y, n.z, l.direction), mask_of(hidden)), l.irradiance);
    }
    for (const std::uint16_t i : group.partly_lit.span()) {
      add_light(n, lights[i], bits_at(visibility.lit[i], k), ~bits_at(visibility.seen[i], k));
    }
  }
  void add_sums(const LaneSums& o) { open.add_sums(o.open), lost.add_sums(o.lost); }
  void store_at(std::size_t k, LightSums& to) const {
    store(&to.open_r[k], open.r), store(&to.open_g[k], open.g), store(&to.open_b[k], open.b);
    store(&to.lost_r[k], lost.r), store(&to.lost_g[k], lost.g), store(&to.lost_b[k], lost.b);
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
  const auto put_half_way = [&](std::size_t k, std::size_t place) {
    between[k + line(place)] = 0.5F * (of[k + line(place - 2)] + of[k + line(place - 1)]);
  };
  // What lies side by side in memory, one after the other.
  if constexpr (step == 1) {
    each([&](std::size_t k) {
      for (std::size_t place = 2; place < last + 2; ++place) put_half_way(k, place);
    });
  } else {
    for (std::size_t place = 2; place < last + 2; ++place) {
      each([&](std::size_t k) { put_half_way(k, place); });
    }
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

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

// Of windows that lie on one surface whole: which centres they are of, and their top left pixels.
struct WholeWindows {
  CellMask centres{}, firsts{};

  explicit WholeWindows(std::span<const ShadowWindow> windows) {
    const auto add = [](CellMask& mask, std::size_t k) { mask[k / 64] |= 1ULL << (k % 64); };
    for (const ShadowWindow& window : windows) {
      if (window.members != whole_window) continue;
      add(centres, window.centre), add(firsts, window.first);
    }
  }
};

// The share that whole windows lose, in one colour: at their top left, and between them.
struct WindowShares {
  alignas(64) Plane at, between;

  void find(const CellMask& firsts, const Plane& open, const Plane& own_lost) {
    alignas(64) Plane open_sums{}, lost_sums{}, rows;
    add_up_windows(open, open_sums);
    add_up_windows(own_lost, lost_sums);
    for (std::size_t k = 0; k < cell_pixels; k += 8) {
      const Eight share = load_eight(&lost_sums[k]) / load_eight(&open_sums[k]);
      store_eight(&at[k], mask_of_eight(bits_at<8>(firsts, k)) ? share : eight_of(unknown));
    }
    put_between_windows<1, cell_size>(at, rows);
    put_between_windows<cell_size, 1>(rows, between);
  }
};

// The same at a cell's border and where a surface ends: a window's own share.
std::size_t first_of_window(std::size_t centre) {
  const auto first = [](std::size_t place) {
    return std::clamp<std::size_t>(place, 1, cell_size - SoftLights::side + 1) - 1;
  };
  return first(centre / cell_size) * cell_size + first(centre % cell_size);
}

// What the centres of whole windows lose, in one colour, in place of what they see themselves.
void lose_shares(const CellMask& centres,
                 const WindowShares& shares,
                 const Plane& open,
                 const Plane& own_lost,
                 Plane& lost) {
  const Eight none{}, whole = eight_of(1);
  for (std::size_t k = 0; k < cell_pixels; k += 8) {
    const unsigned asked = bits_at<8>(centres, k);
    if (asked == 0) continue;
    Eight share = load_eight(&shares.between[k]);
    const unsigned between = bits_of(share == share);  // not where it is unknown
    share = share < none ? none : share;
    share = share > whole ? whole : share;
    for (unsigned left = asked & ~between; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      share[i] = shares.at[first_of_window(k + i)];
    }
    const Eight more = load_eight(&open[k]) * share - load_eight(&own_lost[k]);
    const auto changes = mask_of_eight(asked) & (share == share);
    store_eight(&lost[k], load_eight(&lost[k]) + (changes ? more : none));
  }
}

void share_lost(std::span<const ShadowWindow> windows, const LightSums& soft, LightSums& sums) {
  constexpr std::size_t colours = 3, side = SoftLights::side;
  const std::array<const Plane*, colours> open{&soft.open_r, &soft.open_g, &soft.open_b};
  const std::array<const Plane*, colours> own_lost{&soft.lost_r, &soft.lost_g, &soft.lost_b};
  const std::array<Plane*, colours> lost{&sums.lost_r, &sums.lost_g, &sums.lost_b};
  const WholeWindows whole(windows);
  if (!none(whole.centres)) {
    WindowShares shares;
    for (std::size_t c = 0; c < colours; ++c) {
      shares.find(whole.firsts, *open[c], *own_lost[c]);
      lose_shares(whole.centres, shares, *open[c], *own_lost[c], *lost[c]);
    }
  }
  for (const ShadowWindow& window : windows) {
    if (window.members == whole_window) continue;
    const std::size_t k = window.centre;
    std::array<float, colours> open_sum{}, lost_sum{};
    for (unsigned left = window.members; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      const std::size_t member = window.first + i / side * cell_size + i % side;
      for (std::size_t c = 0; c < colours; ++c) {
        open_sum[c] += (*open[c])[member];
        lost_sum[c] += (*own_lost[c])[member];
      }
    }
    for (std::size_t c = 0; c < colours; ++c) {
      const float share = lost_sum[c] / open_sum[c];
      const bool any_open = share == share;
      if (any_open) (*lost[c])[k] += (*open[c])[k] * share - (*own_lost[c])[k];
    }
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
                  LightSums& soft,
                  const LostLight* more) {
  const bool shares = !visibility.windows.empty();
  const LightsOfCell of_cell(lights, centres.receiving, visibility);
  for (std::size_t k = 0; k < cell_pixels; k += lanes) {
    LaneSums own, shared;
    if (bits_at(centres.receiving, k)) {
      const LaneNormals normals{load(&centres.nx[k]), load(&centres.ny[k]), load(&centres.nz[k])};
      own.add_group(normals, lights, of_cell.own(), visibility, k);
      if (shares) shared.add_group(normals, lights, of_cell.shared(), visibility, k);
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
  const auto add_lost = [](const ColourPlanes& lost, LightSums& to) {
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      to.lost_r[k] += lost.r[k], to.lost_g[k] += lost.g[k], to.lost_b[k] += lost.b[k];
    }
  };
  if (more) add_lost(more->all, sums);
  if (more && shares) add_lost(more->shared, soft);
  if (!shares) return;
  share_lost(visibility.windows, soft, sums);
}

}  // namespace render
