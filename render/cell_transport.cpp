// Cells under new light.
#include "render/cell_transport.h"

#include <algorithm>
#include <bit>
#include <numbers>

#include "render/lanes.h"
#include "render/stand_in_parameters.h"

namespace render {
namespace {

// Irradiance of the lamps at the centres.
void add_lamps(const CellTransport& cell, const FrameLight& light, RelightWorkspace& w) {
  const CellLamps& lamps = cell.lamps;
  for (std::size_t k = 0; k < cell_pixels; k += lanes) {
    Lanes r = all(0), g = all(0), b = all(0);
    if (static_cast<unsigned>(cell.receiving[k / 64] >> (k % 64)) & ((1U << lanes) - 1)) {
      for (std::size_t i = 0; i < lamps.numbers.size(); ++i) {
        const Lanes factor = load(&lamps.factors[i].at[k]);
        const Vec3f intensity = light.lamps[lamps.numbers[i]].intensity;
        r = add(r, multiply(factor, all(intensity.x)));
        g = add(g, multiply(factor, all(intensity.y)));
        b = add(b, multiply(factor, all(intensity.z)));
      }
    }
    store(&w.lamps_r[k], r), store(&w.lamps_g[k], g), store(&w.lamps_b[k], b);
  }
  for (const TintedLight& tint : lamps.tints) {
    const std::size_t k = tint.centre;
    const Vec3f lost = light.lamps[lamps.numbers[tint.light]].intensity * tint.lost_share *
                       lamps.factors[tint.light].at[k];
    w.lamps_r[k] -= lost.x, w.lamps_g[k] -= lost.y, w.lamps_b[k] -= lost.z;
  }
}

void light_mirrored(const CellTransport& cell, const FrameLight& light, RelightWorkspace& w) {
  if (cell.mirrored.empty()) return;
  const CellTransport::Mirrored& m = cell.mirrored.front();
  add_up_light({cell.mirrored_receiving, m.nx, m.ny, m.nz}, light.lights, cell.mirrored_visibility,
               w.mirrored, w.soft);
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(cell.mirrored_receiving, k)) continue;
    w.mirrored_arriving[k] = w.mirrored.open(k) - w.mirrored.lost(k);
    w.added[k] += four_of(m.diffuse[k] * w.mirrored_arriving[k]);
  }
}

void light_centres(const CellTransport& cell, RelightWorkspace& w) {
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const CellTransport::Base& base = cell.base[k];
    w.added[k] = four_of(base.radiance);
    w.share[k] = base.plate;
    w.passed[k] = base.passed;
    if (!(cell.receiving[k / 64] >> (k % 64) & 1)) continue;
    const Vec3f open = w.light.open(k), lost = w.light.lost(k);
    w.arriving[k] = open - lost + Vec3f{w.lamps_r[k], w.lamps_g[k], w.lamps_b[k]};
    w.passing[k] = passing(open, lost);
    w.added[k] += four_of(cell.diffuse[k] * w.arriving[k]);
    const Vec3f share = cell.shadow[k] * w.passing[k];
    w.share[k] += share;
    w.passed[k] += mean(share);
  }
}

// What lamps add on a stand-in. Where the plate tells its albedo, they brighten the plate.
void light_catchers(const CellTransport& cell,
                    const FrameLight& light,
                    std::span<const Vec3f, cell_pixels> plate,
                    RelightWorkspace& w,
                    RenderStatistics& statistics) {
  w.caught.assign(cell.catchers.size(), {});
  for (const CellTransport::CaughtLamp& c : cell.caught) {
    w.caught[c.catcher] += c.factor * light.lamps[c.lamp].intensity;
  }
  for (std::size_t i = 0; i < cell.catchers.size(); ++i) {
    const CellTransport::LampCatcher& c = cell.catchers[i];
    const std::size_t k = c.point;
    const bool centre = k < cell_pixels;
    const Vec3f irradiance = centre ? Vec3f{w.lamps_r[k], w.lamps_g[k], w.lamps_b[k]} : w.caught[i];
    if (irradiance == Vec3f{}) continue;
    const Vec3f open = centre ? w.light.open(k) : w.open_at_points[k - cell_pixels];
    const Vec3f behind = plate[c.slot % cell_pixels];
    if (std::max({behind.x, behind.y, behind.z}) >= clipped_plate) ++statistics.clipped_plate;
    if (plate_tells_albedo(behind, open) && open.x > 0 && open.y > 0 && open.z > 0) {
      w.share[c.slot] +=
          c.share * Vec3f{irradiance.x / open.x, irradiance.y / open.y, irradiance.z / open.z};
    } else {
      w.added[c.slot] += four_of(c.share * c.albedo * irradiance * (1 / std::numbers::pi_v<float>));
    }
  }
}

// Shadows on points that are no centres.
void light_shadow_points(const CellTransport& cell, const FrameLight& light, RelightWorkspace& w) {
  w.open_at_points.clear();
  w.passing_at_points.clear();
  for (const CellTransport::ShadowPoint& point : cell.shadow_points) {
    Vec3f open{}, lost{};
    for (std::uint32_t i = point.first; i < point.first + point.count; ++i) {
      const CellTransport::ShadowLight& s = cell.shadow_lights[i];
      const Vec3f e = light.lights[s.light].irradiance;
      open += e * s.open;
      lost += e * s.lost;
    }
    w.passing_at_points.push_back(passing(open, lost));
    const Vec3f share = point.share * w.passing_at_points.back();
    w.share[point.slot] += share;
    w.passed[point.slot] += mean(share);
    w.open_at_points.push_back(open);
  }
  for (const CellTransport::BentCaustic& c : cell.bent_caustics) {
    w.passing_at_points[c.point] +=
        brightening(w.open_at_points[c.point], c.factor * light.lamps[c.lamp].intensity);
  }
}

// The pixels of a block show what the one does that has a ray.
void fill_blocks(const CellTransport::Blocks& blocks, CellPicture& picture) {
  for (int y = 0; y < blocks.rows; ++y) {
    for (int x = 0; x < blocks.columns; ++x) {
      const auto to = static_cast<std::size_t>(y * cell_size + x);
      const auto from = static_cast<std::size_t>(blocks.middle(y, blocks.rows) * cell_size +
                                                 blocks.middle(x, blocks.columns));
      picture.added[to] = picture.added[from];
      picture.share[to] = picture.share[from];
      picture.passed[to] = picture.passed[from];
      picture.seen[to] = picture.seen[from];
    }
  }
}

}  // namespace

Vec3f plate_at(const capture::Image& level, float x, float y) {
  const float cx = std::clamp(x, 0.0F, static_cast<float>(level.width - 1));
  const float cy = std::clamp(y, 0.0F, static_cast<float>(level.height - 1));
  const int x0 = std::min(static_cast<int>(cx), std::max(level.width - 2, 0));
  const int y0 = std::min(static_cast<int>(cy), std::max(level.height - 2, 0));
  const int x1 = std::min(x0 + 1, level.width - 1), y1 = std::min(y0 + 1, level.height - 1);
  const float u = cx - static_cast<float>(x0), v = cy - static_cast<float>(y0);
  const auto texel = [&](int row, int column) {
    return Vec3f{level.at(row, column, 0), level.at(row, column, 1), level.at(row, column, 2)};
  };
  return (texel(y0, x0) * (1 - u) + texel(y0, x1) * u) * (1 - v) +
         (texel(y1, x0) * (1 - u) + texel(y1, x1) * u) * v;
}

void CellTransport::clear() {
  empty = true;
  blocks = {};
  base.fill({});
  nx.fill(0), ny.fill(0), nz.fill(0);
  diffuse.fill({});
  shadow.fill({});
  receiving = mirrored_receiving = {};
  visibility.clear(), mirrored_visibility.clear(), mirrored.clear();
  shared.clear(), lights.clear();
  environment.clear(), shadow_points.clear(), shadow_lights.clear();
  lamps.numbers.clear(), lamps.factors.clear(), lamps.tints.clear();
  lamp_terms.clear(), catchers.clear(), caught.clear();
  bent.clear(), bent_caustics.clear(), video.clear(), borrowed.clear(), further.clear();
  reach = {};
  rays = 0;
  counts.clear();
}

std::size_t CellTransport::bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  const auto of_sight = [&](const CellVisibility& v) {
    return of(v.lit) + of(v.seen) + of(v.tints) + of(v.near) + of(v.windows);
  };
  return sizeof *this + of_sight(visibility) + of_sight(mirrored_visibility) + of(mirrored) +
         of(shared) + of(lights) + environment.bytes() + of(shadow_points) + of(shadow_lights) +
         of(lamps.numbers) + of(lamps.factors) + of(lamps.tints) + of(lamp_terms) + of(catchers) +
         of(caught) + of(bent) + of(bent_caustics) + of(video) + of(borrowed) + of(further) +
         of(counts);
}

void relight(const CellTransport& cell,
             const FrameLight& light,
             std::span<const Vec3f, cell_pixels> plate,
             RelightWorkspace& w,
             CellPicture& picture,
             RenderStatistics& statistics) {
  if (cell.receiving != CellMask{}) {
    add_up_light({cell.receiving, cell.nx, cell.ny, cell.nz}, light.lights, cell.visibility,
                 w.light, w.soft);
    add_lamps(cell, light, w);
  }
  light_centres(cell, w);
  light_mirrored(cell, light, w);
  for (const CellTransport::Further& f : cell.further) {
    const std::size_t slot = cell_pixels + f.pixel;
    w.added[slot] = four_of(f.base.radiance);
    w.share[slot] = f.base.plate;
    w.passed[slot] = f.base.passed;
  }
  light_shadow_points(cell, light, w);
  light_catchers(cell, light, plate, w, statistics);
  for (const CellTransport::SharedTerm& s : cell.shared) {
    if (s.of == CellTransport::SharedTerm::Of::shadow) {
      const Vec3f share = s.weight * w.passing[s.centre];
      w.share[s.slot] += share;
      w.passed[s.slot] += mean(share);
    } else {
      const bool mirrored = s.of == CellTransport::SharedTerm::Of::mirrored_light;
      w.added[s.slot] +=
          four_of(s.weight * (mirrored ? w.mirrored_arriving : w.arriving)[s.centre]);
    }
  }
  for (const CellTransport::LightTerm& l : cell.lights) {
    w.added[l.slot] += four_of(l.weight * light.lights[l.light].irradiance);
  }
  for (const CellTransport::LightTerm& l : cell.lamp_terms) {
    w.added[l.slot] += four_of(l.weight * light.lamps[l.light].intensity);
  }
  cell.environment.add_light(light.levels, w.added);
  for (const CellTransport::BentPlate& b : cell.bent) {
    const Vec3f share =
        b.point == CellTransport::BentPlate::lit ? Vec3f{1, 1, 1} : w.passing_at_points[b.point];
    w.added[b.slot] += four_of(b.weight * share * plate_at(*light.levels[b.level], b.x, b.y));
  }
  for (const CellTransport::VideoTerm& v : cell.video) {
    w.added[v.slot] += four_of(v.weight * plate_at(*light.levels[v.level], v.x, v.y));
  }
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    picture.added[k] = three_of(w.added[k]);
    picture.share[k] = w.share[k];
    picture.passed[k] = w.passed[k];
    picture.seen[k] = cell.base[k].seen;
  }
  // Pixels of further samples: their own sums, and what they share of centres.
  for (const CellTransport::Further& f : cell.further) {
    const std::size_t k = f.pixel;
    picture.added[k] = three_of(w.added[cell_pixels + k]);
    picture.share[k] = w.share[cell_pixels + k];
    picture.passed[k] = w.passed[cell_pixels + k];
    picture.seen[k] = f.base.seen;
  }
  for (const CellTransport::Borrowed& b : cell.borrowed) {
    const auto n = static_cast<float>(b.count);
    picture.added[b.pixel] += three_of(w.added[b.centre]) * n;
    picture.share[b.pixel] += w.share[b.centre] * n;
    picture.passed[b.pixel] += w.passed[b.centre] * n;
    picture.seen[b.pixel] += cell.base[b.centre].seen * n;
  }
  for (const CellTransport::Further& f : cell.further) {
    const auto n = static_cast<float>(f.count);
    const std::size_t k = f.pixel;
    // Divided, not multiplied by 1 / n: n equal shares of the plate give it back exactly.
    picture.added[k] = picture.added[k] / n;
    picture.share[k] = picture.share[k] / n;
    picture.passed[k] /= n;
    picture.seen[k] /= n;
  }
  if (cell.blocks.size > 1) fill_blocks(cell.blocks, picture);
}

}  // namespace render
