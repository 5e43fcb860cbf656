// Carved cells of visual hulls, and rays through them.
#include "compositing/hull_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/transform.h"

namespace compositing {
namespace {

using calibrate::Vec3f;

constexpr int side = 32;              // cells
constexpr float width_share = 0.25F;  // of a cell, that look-ups may be wide
constexpr float margin = 1.5F;        // of look-ups, in widths
constexpr int corners = 5;            // of 4 cells in a row
constexpr std::size_t all_corners = corners * corners * corners;

// By how much places in the grid are off a straight map over so many steps, at most: times the
// square of steps.
float bend_of(const CameraGrid& camera, std::span<const std::byte> places) {
  const auto at = [&](std::uint32_t row, std::uint32_t column) {
    GridPlace p;
    std::memcpy(&p, places.data() + (std::size_t{row} * camera.columns + column) * sizeof p,
                sizeof p);
    return p;
  };
  constexpr float unbounded = std::numeric_limits<float>::infinity();
  float bend = 0;
  for (std::uint32_t row = 0; row < camera.rows; ++row) {
    for (std::uint32_t column = 0; column < camera.columns; ++column) {
      const GridPlace p = at(row, column);
      if (!std::isfinite(p.u + p.v)) continue;
      const auto count = [&](GridPlace a, GridPlace b, GridPlace c) {
        const float u = std::abs(p.u - a.u - b.u + c.u), v = std::abs(p.v - a.v - b.v + c.v);
        if (std::isfinite(u + v)) {
          bend = std::max({bend, u, v});
        } else if (is_in_picture(p)) {
          bend = unbounded;  // what the lens does not see may lie within
        }
      };
      const bool wide = column + 2 < camera.columns, high = row + 2 < camera.rows;
      if (wide) count(at(row, column + 1), at(row, column + 1), at(row, column + 2));
      if (high) count(at(row + 1, column), at(row + 1, column), at(row + 2, column));
      if (column + 1 < camera.columns && row + 1 < camera.rows) {
        count(at(row, column + 1), at(row + 1, column), at(row + 1, column + 1));
      }
    }
  }
  return bend;
}

struct Range {
  float least = std::numeric_limits<float>::max(), most = -least;
  void add(float value) { least = std::min(least, value), most = std::max(most, value); }
};

}  // namespace

// Finds which of 4^3 cells may hold something.
class HullCells::Carver {
 public:
  Carver(const HullBlock& block,
         std::span<const std::byte> places,
         const std::array<float, 12>& set_from_object,
         std::span<const std::shared_ptr<const render::LivePicture>> pictures)
      : block_(block) {
    const auto& m = set_from_object;
    for (std::size_t i = 0; i < block.views; ++i) {
      const MarchView& view = block.view[i];
      View& v = views_[i];
      v.places = places.subspan(view.first_byte);
      v.picture = pictures[view.picture].get();
      v.bend = bend_of(view.camera, v.places);
      v.origin = in_camera(view.camera, {m[3], m[7], m[11]});
      for (std::size_t a = 0; a < 3; ++a) {
        v.axes[a] = turned_to_camera(view.camera, {m[a], m[4 + a], m[8 + a]});
      }
    }
  }

  // `lower`: of the first cell, in units of the box, as is `size`, a cell's.
  Mask carve(Vec3f lower, float size, float widest_m) const {
    Mask full = ~Mask{0}, unseen = ~Mask{0};
    for (std::size_t i = 0; i < block_.views && full != 0; ++i) {
      full &= carve_by(i, lower, size, widest_m, full, unseen);
    }
    return full & ~unseen;
  }

 private:
  struct View {
    std::span<const std::byte> places;
    const render::LivePicture* picture = nullptr;
    float bend = 0;
    Vec3f origin;               // in the camera's frame
    std::array<Vec3f, 3> axes;  // of the box
  };
  // Of the cells' corners: in steps of the grid, in the picture, and their depth.
  struct Corners {
    std::array<float, all_corners> x, y, z, u, v;
  };

  void project(std::size_t i, Vec3f lower, float size, Corners& c) const {
    const View& view = views_[i];
    const CameraGrid& camera = block_.view[i].camera;
    const Vec3f first =
        view.origin + view.axes[0] * lower.x + view.axes[1] * lower.y + view.axes[2] * lower.z;
    std::size_t n = 0;
    for (int k = 0; k < corners; ++k) {
      for (int j = 0; j < corners; ++j) {
        const Vec3f row = first + view.axes[2] * (size * static_cast<float>(k)) +
                          view.axes[1] * (size * static_cast<float>(j));
        for (int h = 0; h < corners; ++h, ++n) {
          const Vec3f p = row + view.axes[0] * (size * static_cast<float>(h));
          c.z[n] = p.z;
          c.x[n] = (p.x / p.z - camera.first[0]) * camera.steps_a_unit[0];
          c.y[n] = (p.y / p.z - camera.first[1]) * camera.steps_a_unit[1];
        }
      }
    }
    for (n = 0; n < all_corners; ++n) {
      constexpr float none = std::numeric_limits<float>::quiet_NaN();
      const auto place = place_in_grid(camera, view.places, c.x[n], c.y[n]);
      c.u[n] = place ? place->u : none;
      c.v[n] = place ? place->v : none;
    }
  }

  enum class Holds { nothing, no_say, maybe };
  Holds look(std::size_t i, const Corners& c, std::size_t first, float widest_m) const {
    Range x, y, z, u, v;
    bool seen = true;
    for (const std::size_t step : {0, 1, 5, 6, 25, 26, 30, 31}) {
      const std::size_t n = first + step;
      x.add(c.x[n]), y.add(c.y[n]), z.add(c.z[n]), u.add(c.u[n]), v.add(c.v[n]);
      seen = seen && std::isfinite(c.u[n] + c.v[n]);
    }
    constexpr float nearest = 1e-3F;
    if (z.most < 0) return Holds::no_say;
    if (!(z.least > nearest)) return Holds::maybe;
    const CameraGrid& camera = block_.view[i].camera;
    if (x.most < 0 || y.most < 0 || x.least > static_cast<float>(camera.columns - 1) ||
        y.least > static_cast<float>(camera.rows - 1)) {
      return Holds::no_say;
    }
    if (!seen) return Holds::maybe;
    const float steps = 0.5F * (x.most - x.least + y.most - y.least) + 2;
    const float off = views_[i].bend * steps * steps + 1e-6F;
    if (!std::isfinite(off)) return Holds::maybe;
    if (u.most + off < 0 || v.most + off < 0 || u.least - off > 1 || v.least - off > 1) {
      return Holds::no_say;
    }
    const auto within = [off](const Range& r) { return r.least - off >= 0 && r.most + off <= 1; };
    if (!within(u) || !within(v)) return Holds::maybe;
    const float rim = margin * widest_m * camera.uv_per_tangent / z.least;
    const float rim_u = off + rim * block_.view[i].root_aspect;
    const float rim_v = off + rim / block_.view[i].root_aspect;
    const float most = views_[i].picture->most_alpha(u.least - rim_u, v.least - rim_v,
                                                     u.most + rim_u, v.most + rim_v);
    return most <= no_alpha ? Holds::nothing : Holds::maybe;
  }

  Mask carve_by(
      std::size_t i, Vec3f lower, float size, float widest_m, Mask wanted, Mask& unseen) const {
    Corners c;
    project(i, lower, size, c);
    Mask full = wanted, has_no_say = 0;
    for (std::size_t n = 0; n < children; ++n) {
      const Mask bit = Mask{1} << n;
      if ((wanted & bit) == 0) continue;
      const std::size_t first = (n >> 4) * 25 + (n >> 2 & 3) * 5 + (n & 3);
      const Holds holds = look(i, c, first, widest_m);
      if (holds == Holds::nothing) full &= ~bit;
      if (holds == Holds::no_say) has_no_say |= bit;
    }
    unseen &= has_no_say;
    return full;
  }

  const HullBlock& block_;
  std::array<View, most_hull_views> views_;
};

namespace {

HullCells::Straight straight_of(const CameraGrid& camera, std::span<const std::byte> places) {
  constexpr float straight_uv = 2e-5F;  // a twentieth of a texel of a wide picture
  const auto last_x = static_cast<float>(camera.columns - 1);
  const auto last_y = static_cast<float>(camera.rows - 1);
  const auto first = place_in_grid(camera, places, 0, 0);
  const auto right = place_in_grid(camera, places, last_x, 0);
  const auto low = place_in_grid(camera, places, 0, last_y);
  if (!first || !right || !low) return {};
  const GridPlace by_x{(right->u - first->u) / last_x, (right->v - first->v) / last_x};
  const GridPlace by_y{(low->u - first->u) / last_y, (low->v - first->v) / last_y};
  for (std::uint32_t row = 0; row < camera.rows; ++row) {
    for (std::uint32_t column = 0; column < camera.columns; ++column) {
      const auto x = static_cast<float>(column), y = static_cast<float>(row);
      const auto place = place_in_grid(camera, places, x, y);
      if (!place) return {};
      const float u = std::abs(place->u - first->u - by_x.u * x - by_y.u * y);
      const float v = std::abs(place->v - first->v - by_x.v * x - by_y.v * y);
      if (!(u < straight_uv && v < straight_uv)) return {};
    }
  }
  return {true, *first, by_x, by_y};
}

}  // namespace

HullCells::HullCells(const HullBlock& block,
                     std::span<const std::byte> places,
                     const std::array<float, 12>& set_from_object,
                     std::span<const std::shared_ptr<const render::LivePicture>> pictures)
    : block_(block) {
  for (std::size_t i = 0; i < block.views; ++i) {
    const MarchView& view = block.view[i];
    straight_[i] = straight_of(view.camera, places.subspan(view.first_byte));
  }
  const auto& m = set_from_object;
  const Vec3f x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]}, o{m[3], m[7], m[11]};
  const float volume = dot(x, cross(y, z));
  const std::array<Vec3f, 3> rows{cross(y, z) * (1 / volume), cross(z, x) * (1 / volume),
                                  cross(x, y) * (1 / volume)};
  is_placed_ = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f& row = rows[i];
    const std::array<float, 4> values{row.x, row.y, row.z, -dot(row, o)};
    std::ranges::copy(values, object_from_set_.begin() + static_cast<std::ptrdiff_t>(4 * i));
    for (const float value : values) is_placed_ = is_placed_ && std::isfinite(value);
  }
  if (!is_placed_) return;
  const float mean_m = std::cbrt(std::abs(volume));
  for (std::size_t level = 0; level < levels; ++level) {
    widest_m_[level] = width_share * mean_m / static_cast<float>(2 << (2 * level));
  }
  const Carver carver(block_, places, set_from_object, pictures);
  const auto place_of = [](std::size_t n) {
    return Vec3f{static_cast<float>(n & 3), static_cast<float>(n >> 2 & 3),
                 static_cast<float>(n >> 4)};
  };
  lower_.fill(side), upper_.fill(0);
  fine_.assign(children * children, 0);
  whole_ = 0x00330033;  // 2^3: never empty
  for (std::size_t i = 0; i < children; ++i) {
    if ((whole_ >> i & 1) == 0) continue;
    const Vec3f lower = place_of(i) * 0.5F;
    middle_[i] = carver.carve(lower, 0.125F, widest_m_[1]);
    for (std::size_t j = 0; j < children; ++j) {
      if ((middle_[i] >> j & 1) == 0) continue;
      const Mask mask = carver.carve(lower + place_of(j) * 0.125F, 1.0F / side, widest_m_[2]);
      fine_[i * children + j] = mask;
      if (mask == 0) continue;
      pruned_middle_[i] |= Mask{1} << j;
      const Vec3f first = (lower + place_of(j) * 0.125F) * side;
      const std::array<float, 3> corner{first.x, first.y, first.z};
      for (std::size_t a = 0; a < 3; ++a) {
        lower_[a] = std::min(lower_[a], corner[a]);
        upper_[a] = std::max(upper_[a], corner[a] + 4);
      }
    }
    if (pruned_middle_[i] != 0) pruned_whole_ |= Mask{1} << i;
  }
}

CellWalk::CellWalk(
    const HullCells& cells, Vec3f origin, Vec3f direction, float from_m, float to_m, float widest_m)
    : cells_(cells), at_m_(from_m), to_m_(to_m) {
  if (!cells.is_placed_) return;
  while (level_ + 1 < HullCells::levels &&
         widest_m <= cells.widest_m_[static_cast<std::size_t>(level_ + 1)]) {
    ++level_;
  }
  const Vec3f p = render::transform_point(cells.object_from_set_, origin) * side;
  const Vec3f d = render::transform_vector(cells.object_from_set_, direction) * side;
  begin_ = {p.x, p.y, p.z};
  way_ = {d.x, d.y, d.z};
  float fastest = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    metres_[a] = 1 / way_[a];
    fastest = std::max(fastest, std::abs(way_[a]));
  }
  constexpr float little = 2e-3F;
  ahead_m_ = little / fastest;
  if (!(ahead_m_ > 0 && std::isfinite(ahead_m_))) level_ = -1;
  if (level_ != HullCells::levels - 1) return;
  // To the box of what there is.
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::abs(way_[a]) > 1e-6F * fastest) {
      const float lower = (cells.lower_[a] - begin_[a]) * metres_[a];
      const float upper = (cells.upper_[a] - begin_[a]) * metres_[a];
      at_m_ = std::max(at_m_, std::min(lower, upper));
      to_m_ = std::min(to_m_, std::max(lower, upper));
    } else if (begin_[a] < cells.lower_[a] - 1 || begin_[a] > cells.upper_[a] + 1) {
      to_m_ = at_m_;
    }
  }
}

// Among 4^3 of the finest cells, from the one that `cell` is in.
//
// Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987.
bool CellWalk::next_among(std::uint64_t mask, const std::array<unsigned, 3>& cell, Piece& piece) {
  std::array<float, 3> leaves;
  std::array<unsigned, 3> left;  // cells to go
  unsigned bit = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const unsigned at = cell[a] & 3U;
    const bool up = way_[a] > 0;
    const float corner = static_cast<float>(cell[a] + (up ? 1U : 0U));
    leaves[a] = way_[a] != 0 ? (corner - begin_[a]) * metres_[a] : to_m_;
    left[a] = up ? 3 - at : at;
    bit |= at << (2 * a);
  }
  bool found = false;
  float at_m = at_m_;
  for (;;) {
    const bool full = (mask >> bit & 1) != 0;
    if (full != found) {
      if (found) break;
      piece.from_m = at_m;
      found = true;
    }
    const std::size_t a =
        leaves[0] < leaves[1] ? (leaves[0] < leaves[2] ? 0 : 2) : (leaves[1] < leaves[2] ? 1 : 2);
    at_m = std::max(leaves[a], at_m);
    if (left[a] == 0 || !(at_m < to_m_)) break;
    --left[a];
    leaves[a] += std::abs(metres_[a]);
    bit += way_[a] > 0 ? 1U << (2 * a) : ~0U << (2 * a);
  }
  at_m_ = std::min(std::max(at_m, at_m_ + ahead_m_), to_m_);
  piece.to_m = at_m_;
  return found;
}

bool CellWalk::next(Piece& piece) {
  if (level_ < 0) {
    piece = {at_m_, to_m_};
    const bool more = at_m_ < to_m_;
    at_m_ = to_m_;
    return more;
  }
  const bool finest = level_ == HullCells::levels - 1;
  while (at_m_ < to_m_) {
    const float inside = at_m_ + ahead_m_;
    std::array<unsigned, 3> cell;
    for (std::size_t a = 0; a < 3; ++a) {
      const float place = begin_[a] + inside * way_[a];
      cell[a] = static_cast<unsigned>(static_cast<int>(std::clamp(place, 0.0F, side - 0.5F)));
    }
    const auto bit_of = [&](unsigned shift) {
      return (cell[2] >> shift & 3U) << 4 | (cell[1] >> shift & 3U) << 2 | (cell[0] >> shift & 3U);
    };
    const unsigned i = bit_of(4), j = bit_of(2);
    unsigned shift = 4;
    bool full = ((finest ? cells_.pruned_whole_ : cells_.whole_) >> i & 1) != 0;
    if (full && level_ > 0) {
      shift = 2;
      full = ((finest ? cells_.pruned_middle_[i] : cells_.middle_[i]) >> j & 1) != 0;
    }
    if (full && finest) {
      if (next_among(cells_.fine_[i * HullCells::children + j], cell, piece)) return true;
      continue;
    }
    float leaves = to_m_;
    for (std::size_t a = 0; a < 3; ++a) {
      if (way_[a] == 0) continue;
      const unsigned corner = ((cell[a] >> shift) + (way_[a] > 0 ? 1U : 0U)) << shift;
      const float at = (static_cast<float>(corner) - begin_[a]) * metres_[a];
      leaves = at < leaves ? at : leaves;  // nor where it is no number
    }
    const float before = at_m_;
    at_m_ = std::min(std::max(leaves, inside), to_m_);
    if (!(at_m_ > before)) {
      level_ = -1;  // cells that are no wider than rounding
      return next(piece);
    }
    if (full) {
      piece = {before, at_m_};
      return true;
    }
  }
  return false;
}

}  // namespace compositing
