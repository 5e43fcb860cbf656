// Cells under new light.
#include "render/cell_transport.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <numbers>
#include <numeric>

#include "render/blocker_boxes.h"
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
    store(&w.lamps.r[k], r), store(&w.lamps.g[k], g), store(&w.lamps.b[k], b);
  }
  for (const TintedLight& tint : lamps.tints) {
    const std::size_t k = tint.centre;
    const Vec3f lost = light.lamps[lamps.numbers[tint.light]].intensity * tint.lost_share *
                       lamps.factors[tint.light].at[k];
    w.lamps.r[k] -= lost.x, w.lamps.g[k] -= lost.y, w.lamps.b[k] -= lost.z;
  }
}

void light_mirrored(const CellTransport& cell,
                    const FrameLight& light,
                    const LostLight* more_lost,
                    RelightWorkspace& w,
                    CellPicture& picture) {
  if (cell.mirrored.empty()) return;
  const CellTransport::Mirrored& m = cell.mirrored.front();
  add_up_light({cell.mirrored_receiving, m.nx, m.ny, m.nz}, light.lights, cell.mirrored_visibility,
               w.mirrored, w.soft, more_lost);
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(cell.mirrored_receiving, k)) continue;
    const Vec3f arriving = w.mirrored.arriving(k);
    w.mirrored_arriving.put(k, arriving);
    if (m.any_shadow) {
      const Vec3f open = w.mirrored.open(k);
      w.mirrored_passing.put(k, passing(open, open - arriving));
    }
    picture.added[m.slot[k]] += four_of(m.diffuse.at(k) * arriving);
  }
}

Four with_mean(Vec3f share) { return Four{share.x, share.y, share.z, mean(share)}; }

void show_base(const CellTransport::Base& base, std::size_t slot, CellPicture& picture) {
  picture.added[slot] = four_of(base.radiance);
  picture.share[slot] = Four{base.plate.x, base.plate.y, base.plate.z, base.passed};
  picture.seen[slot] = base.seen;
}

// Of eight centres, in one colour.
struct Arrived {
  Eight arriving, passing;  // irradiance; share that is seen
};
Arrived arrived(const float* open_at, const float* lost_at, const float* lamps_at) {
  const Eight open = load_eight(open_at), lost = load_eight(lost_at), none{};
  const Eight left = open - lost, share = 1 - lost / open;
  return {(left > 0 ? left : none) + load_eight(lamps_at),
          (lost > 0) & (open > 0) ? (share > 0 ? share : none) : none + 1};
}

void light_centres(const CellTransport& cell, RelightWorkspace& w, CellPicture& picture) {
  if (cell.bases.size() == 1) {
    show_base(cell.bases.front(), 0, picture);
    std::fill_n(picture.added.begin() + 1, cell_pixels - 1, picture.added[0]);
    std::fill_n(picture.share.begin() + 1, cell_pixels - 1, picture.share[0]);
    std::fill_n(picture.seen.begin() + 1, cell_pixels - 1, picture.seen[0]);
  } else {
    for (std::size_t k = 0; k < cell_pixels; ++k) show_base(cell.base(k), k, picture);
  }
  if (none(cell.receiving)) return;
  const CellTransport::Centres& c = cell.centres.front();
  for (std::size_t k = 0; k < cell_pixels; k += 8) {
    if ((cell.receiving[k / 64] >> (k % 64) & 255) == 0) continue;
    const Arrived r = arrived(&w.light.open_r[k], &w.light.lost_r[k], &w.lamps.r[k]);
    const Arrived g = arrived(&w.light.open_g[k], &w.light.lost_g[k], &w.lamps.g[k]);
    const Arrived b = arrived(&w.light.open_b[k], &w.light.lost_b[k], &w.lamps.b[k]);
    store_eight(&w.arriving.r[k], r.arriving), store_eight(&w.passing.r[k], r.passing);
    store_eight(&w.arriving.g[k], g.arriving), store_eight(&w.passing.g[k], g.passing);
    store_eight(&w.arriving.b[k], b.arriving), store_eight(&w.passing.b[k], b.passing);
    if (c.any_diffuse) {
      const auto added = fours_of(load_eight(&c.diffuse.r[k]) * r.arriving,
                                  load_eight(&c.diffuse.g[k]) * g.arriving,
                                  load_eight(&c.diffuse.b[k]) * b.arriving, Eight{});
      for (std::size_t i = 0; i < 8; ++i) picture.added[k + i] += added[i];
    }
    if (c.any_shadow) {
      const Eight share_r = load_eight(&c.shadow.r[k]) * r.passing,
                  share_g = load_eight(&c.shadow.g[k]) * g.passing,
                  share_b = load_eight(&c.shadow.b[k]) * b.passing;
      const auto share =
          fours_of(share_r, share_g, share_b, (share_r + share_g + share_b) * (1.0F / 3));
      for (std::size_t i = 0; i < 8; ++i) picture.share[k + i] += share[i];
    }
  }
}

// What lamps add on a stand-in. Where the plate tells its albedo, they brighten the plate.
void light_catchers(const CellTransport& cell,
                    const FrameLight& light,
                    std::span<const Four, cell_pixels> plate,
                    RelightWorkspace& w,
                    CellPicture& picture,
                    RenderStatistics& statistics) {
  w.caught.assign(cell.catchers.size(), {});
  for (const CellTransport::CaughtLamp& c : cell.caught) {
    w.caught[c.catcher] += c.factor * light.lamps[c.lamp].intensity;
  }
  for (std::size_t i = 0; i < cell.catchers.size(); ++i) {
    const CellTransport::LampCatcher& c = cell.catchers[i];
    const std::size_t k = c.point;
    const bool centre = k < cell_pixels;
    const Vec3f irradiance = centre ? w.lamps.at(k) : w.caught[i];
    if (irradiance == Vec3f{}) continue;
    const Vec3f open = centre ? w.light.open(k) : w.open_at_points[k - cell_pixels];
    const Vec3f behind = three_of(plate[c.slot % cell_pixels]);
    if (std::max({behind.x, behind.y, behind.z}) >= clipped_plate) ++statistics.clipped_plate;
    if (plate_tells_albedo(behind, open) && open.x > 0 && open.y > 0 && open.z > 0) {
      // It brightens what is there, and hides nothing.
      picture.share[c.slot] += four_of(
          c.share * Vec3f{irradiance.x / open.x, irradiance.y / open.y, irradiance.z / open.z});
    } else {
      picture.added[c.slot] +=
          four_of(c.share * c.albedo * irradiance * (1 / std::numbers::pi_v<float>));
    }
  }
}

// Of light that passes pictures, if that stands for so many of which no other is dimmed.
Vec3f passed_of(Vec3f passed, float stands_for) {
  const Vec3f all{1, 1, 1};
  return stands_for == 1 ? passed : all - (all - passed) * stands_for;
}

// What is lost of such a light; not of one of which all passes.
Four lost_of(const CellTransport& cell, const CellTransport::ShadowLight& s) {
  using Light = CellTransport::ShadowLight;
  if (s.tint == Light::blocked) return four_of({s.open, s.open, s.open});
  return four_of(cell.shadow_tints[s.tint - std::size_t{Light::first_tint}] * s.open);
}

// Shadows on points that are no centres.
void light_shadow_points(const CellTransport& cell,
                         const FrameLight& light,
                         const CellPictures* pictures,
                         RelightWorkspace& w,
                         CellPicture& picture) {
  w.open_at_points.clear();
  w.passing_at_points.clear();
  const bool dims = pictures && !pictures->shadowed_through.empty();
  std::size_t dimmed = 0;  // of the picture shadows, which are in order
  for (const CellTransport::ShadowPoint& point : cell.shadow_points) {
    Four open_sum{}, lost_sum{}, hidden_sum{};
    for (std::uint32_t i = point.first; i < point.first + point.count; ++i) {
      const CellTransport::ShadowLight& s = cell.shadow_lights[i];
      const Four e = light.irradiances[s.light];
      Four gone{};
      open_sum += e * s.open;
      if (s.tint != CellTransport::ShadowLight::passes) {
        gone = lost_of(cell, s);
        lost_sum += e * gone;
      }
      if (dims && dimmed < cell.picture_shadows.size() && cell.picture_shadows[dimmed].slot == i) {
        const Four through = four_of(pictures->shadowed_through[dimmed]);
        hidden_sum += e * (s.open - gone) * (1 - through) * cell.picture_shadows[dimmed].stands_for;
        ++dimmed;
      }
    }
    const Vec3f open = three_of(open_sum), lost = three_of(lost_sum), hidden = three_of(hidden_sum);
    // Not bounded: of several points some stand for all.
    const auto part = [](float gone, float all) { return all > 0 ? gone / all : 0.0F; };
    w.passing_at_points.push_back(passing(open, lost) - Vec3f{part(hidden.x, open.x),
                                                              part(hidden.y, open.y),
                                                              part(hidden.z, open.z)});
    picture.share[point.slot] += with_mean(point.share * w.passing_at_points.back());
    w.open_at_points.push_back(open);
  }
  for (const CellTransport::BentCaustic& c : cell.bent_caustics) {
    w.passing_at_points[c.point] +=
        brightening(w.open_at_points[c.point], c.factor * light.lamps[c.lamp].intensity);
  }
}

// The last of the four is not 0.
Four weight_of(const CellTransport::LightTerm& term) {
  using Term = CellTransport::LightTerm;
  static_assert(sizeof(Term) == sizeof(Four) && offsetof(Term, weight) == sizeof(float));
  Four all;
  std::memcpy(&all, &term, sizeof all);
  return after_first(all);
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
      picture.seen[to] = picture.seen[from];
    }
  }
}

void show_places(std::span<const PlaceTerm> places, const FrameLight& light, CellPicture& picture) {
  for (const PlaceTerm& p : places) {
    picture.added[p.slot] += four_of(p.weight * plate_at(*light.levels[p.level], p.x, p.y));
  }
}

void show_shaded_places(const CellTransport& cell,
                        const FrameLight& light,
                        const RelightWorkspace& w,
                        CellPicture& picture) {
  constexpr std::uint32_t first_mirrored = CellTransport::ShadedPlate::first_mirrored;
  for (const auto& [term, point] : cell.bent_shaded) {
    const Vec3f passed = point < first_mirrored ? w.passing_at_points[point]
                                                : w.mirrored_passing.at(point - first_mirrored);
    picture.added[term.slot] +=
        four_of(term.weight * passed * plate_at(*light.levels[term.level], term.x, term.y));
  }
}

// Matte light, in the colours of live textures.
void show_painted(const CellTransport& cell, const FrameLight& light, CellPicture& picture) {
  for (std::size_t i = 0; i < cell.painted.size(); ++i) {
    const CellTransport::Painted& painted = cell.painted[i];
    Four colour{};
    for (const CellTransport::Paint& p :
         std::span(cell.paint).subspan(painted.first, painted.count)) {
      colour += four_of(plate_at(*light.levels[p.level], p.x, p.y) * p.share);
    }
    const Four white = four_of({1, 1, 1});
    picture.added[painted.slot] +=
        picture.added[CellPicture::all_slots + i] * (colour < white ? colour : white);
  }
}

// What rays see that pictures may come before: the last ones first, for a ray may have been sent on
// by what another one met.
void show_picture_rays(const CellTransport& cell,
                       const CellPictures* pictures,
                       CellPicture& picture) {
  const bool seen = pictures && !pictures->along.empty();
  const auto show = [&](std::size_t i) {
    const CellTransport::PictureRay& ray = cell.picture_rays[i];
    const std::size_t from = slots + i, to = ray.target;
    if (ray.lender != CellTransport::PictureRay::no_lender) {
      picture.added[from] += picture.added[ray.lender];
      picture.share[from] += picture.share[ray.lender];
      picture.seen[from] += picture.seen[ray.lender];
    }
    if (!seen) {
      picture.added[to] += picture.added[from];
      picture.share[to] += picture.share[from];
      picture.seen[to] += picture.seen[from];
      return;
    }
    const auto& [radiance, seen_through] = pictures->along[i];
    const Vec3f passed = passed_of(seen_through, ray.stands_for);
    const Four share{passed.x, passed.y, passed.z, mean(passed)};
    const Four own = four_of(ray.throughput * radiance), behind = picture.added[from];
    picture.added[to] += own + four_of(seen_through) * behind;
    if (ray.stands_for > 1) {
      // What is brighter than white behind this one need not be so behind the others.
      const Four white = four_of(ray.throughput), others = behind < white ? behind : white;
      picture.added[to] +=
          (own - four_of(Vec3f{1, 1, 1} - seen_through) * others) * (ray.stands_for - 1);
    }
    picture.share[to] += share * picture.share[from];
    picture.seen[to] += share[3] * picture.seen[from];
  };
  bool any_lent = false;
  for (std::size_t i = cell.picture_rays.size(); i-- > 0;) {
    const bool lent = cell.picture_rays[i].lender != CellTransport::PictureRay::no_lender;
    any_lent = any_lent || lent;
    if (!lent) show(i);
  }
  // Centres are whole now.
  for (std::size_t i = 0; any_lent && i < cell.picture_rays.size(); ++i) {
    if (cell.picture_rays[i].lender != CellTransport::PictureRay::no_lender) show(i);
  }
}

void show_foreground(const CellTransport::Foreground& foreground, CellPicture& picture) {
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const Four passed = foreground.passed[k];
    picture.added[k] = foreground.radiance[k] + passed * picture.added[k];
    picture.share[k] *= passed;
    picture.seen[k] *= passed[3];
  }
}

}  // namespace

Vec3f plate_at(const capture::Image& level, float x, float y) {
  const float cx = std::clamp(x, 0.0F, static_cast<float>(level.width - 1));
  const float cy = std::clamp(y, 0.0F, static_cast<float>(level.height - 1));
  const int x0 = std::min(static_cast<int>(cx), std::max(level.width - 2, 0));
  const int y0 = std::min(static_cast<int>(cy), std::max(level.height - 2, 0));
  const float u = cx - static_cast<float>(x0), v = cy - static_cast<float>(y0);
  const float* const top = &level.pixels[level.index(y0, x0)];
  const float* const low = level.height > 1 ? top + level.index(1, 0) : top;
  const int right = level.width > 1 ? level.channels : 0;
  const auto between = [&](const float* texel) {
    const Vec3f here{texel[0], texel[1], texel[2]};
    const Vec3f there{texel[right], texel[right + 1], texel[right + 2]};
    return here * (1 - u) + there * u;
  };
  return between(top) * (1 - v) + between(low) * v;
}

float plate_share_at(const capture::Image& plate, double x, double y, bool mirrored) {
  constexpr double faded = 1.0 / 16;  // of the shorter side
  const double inside = std::min({x + 0.5, plate.width - 0.5 - x, y + 0.5, plate.height - 0.5 - y});
  if (!mirrored) return inside >= 0 ? 1 : 0;
  const double width = faded * std::min(plate.width, plate.height);
  return static_cast<float>(std::clamp(inside / width, 0.0, 1.0));
}

void CellTransport::clear() {
  empty = true;
  blocks = {};
  foreground.clear();
  bases.clear();
  centres.assign(1, Centres{});
  receiving = mirrored_receiving = {};
  visibility.clear(), mirrored_visibility.clear(), mirrored.clear();
  shared.clear(), lights.clear();
  environment.clear(), shadow_points.clear(), shadow_lights.clear(), shadow_tints.clear();
  lamps.numbers.clear(), lamps.factors.clear(), lamps.tints.clear();
  lamp_terms.clear(), catchers.clear(), caught.clear();
  bent.clear(), bent_shaded.clear(), bent_caustics.clear(), video.clear(), painted.clear(),
      paint.clear();
  borrowed.clear(), further.clear();
  past_pictures = false;
  far_m.clear();
  picture_rays.clear(), bases_behind.clear(), environments_behind.clear();
  picture_shadows.clear(), looks_apart = {}, nearest_m = farthest_m = 0;
  picture_lights.clear(), shadowed.clear(), mirrored_shadowed.clear();
  reach = {};
  shadow_answers.forget();
  rays = 0;
  counts.clear();
}

std::size_t CellTransport::bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  const auto of_sight = [&](const CellVisibility& v) {
    return of(v.lit) + of(v.seen) + of(v.tints) + of(v.near) + of(v.windows);
  };
  return sizeof *this + of_sight(visibility) + of_sight(mirrored_visibility) + of(mirrored) +
         of(foreground) + of(bases) + of(centres) + of(shared) + of(lights) + environment.bytes() +
         of(shadow_points) + of(shadow_lights) + of(shadow_tints) + of(lamps.numbers) +
         of(lamps.factors) + of(lamps.tints) + of(lamp_terms) + of(catchers) + of(caught) +
         of(bent) + of(bent_shaded) + of(bent_caustics) + of(video) + of(painted) + of(paint) +
         of(borrowed) + of(further) + of(counts) + of(far_m) + of(picture_rays) + of(bases_behind) +
         of(environments_behind) +
         std::accumulate(environments_behind.begin(), environments_behind.end(), std::size_t{0},
                         [](std::size_t sum, const auto& e) { return sum + e.bytes(); }) +
         of(picture_lights) + of(picture_shadows) + of(shadowed) + of(mirrored_shadowed) +
         shadow_answers.bytes();
}

void relight(const CellTransport& cell,
             const FrameLight& light,
             std::span<const Four, cell_pixels> plate,
             RelightWorkspace& w,
             CellPicture& picture,
             RenderStatistics& statistics,
             const CellPictures* pictures) {
  if (!none(cell.receiving)) {
    const CellTransport::Centres& c = cell.centres.front();
    add_up_light({cell.receiving, c.nx, c.ny, c.nz}, light.lights, cell.visibility, w.light, w.soft,
                 pictures && pictures->shades ? &pictures->lost : nullptr);
    add_lamps(cell, light, w);
    if (pictures && pictures->shades_lamps) {
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        w.lamps.put(k, w.lamps.at(k) - pictures->lamps_lost.at(k));
      }
    }
  }
  light_centres(cell, w, picture);
  std::fill_n(picture.added.begin() + CellPicture::all_slots, cell.painted.size(), Four{});
  for (std::size_t i = 0; i < cell.bases_behind.size(); ++i) {
    show_base(cell.bases_behind[i], slots + i, picture);
  }
  light_mirrored(cell, light,
                 pictures && pictures->shades_mirrored ? &pictures->mirrored_lost : nullptr, w,
                 picture);
  for (const CellTransport::Further& f : cell.further) {
    show_base(f.base, cell_pixels + f.pixel, picture);
  }
  light_shadow_points(cell, light, pictures, w, picture);
  light_catchers(cell, light, plate, w, picture, statistics);
  for (const CellTransport::SharedTerm& s : cell.shared) {
    if (s.of == CellTransport::SharedTerm::Of::shadow) {
      picture.share[s.slot] += with_mean(s.weight * w.passing.at(s.centre));
    } else {
      const bool mirrored = s.of == CellTransport::SharedTerm::Of::mirrored_light;
      picture.added[s.slot] +=
          four_of(s.weight * (mirrored ? w.mirrored_arriving : w.arriving).at(s.centre));
    }
  }
  // In the order of slots: each is fetched once, for a sum waits for what was put there last.
  for (auto l = cell.lights.begin(); l != cell.lights.end();) {
    const std::uint16_t slot = l->slot;
    Four sum = picture.added[slot];
    for (; l != cell.lights.end() && l->slot == slot; ++l) {
      sum += weight_of(*l) * light.irradiances[l->light];
    }
    picture.added[slot] = sum;
  }
  for (const CellTransport::LightTerm& l : cell.lamp_terms) {
    picture.added[l.slot] += four_of(l.weight * light.lamps[l.light].intensity);
  }
  for (std::size_t i = 0; i < cell.picture_lights.size(); ++i) {
    const CellTransport::PictureLight& l = cell.picture_lights[i];
    const Vec3f passed = pictures && !pictures->lit_through.empty()
                             ? passed_of(pictures->lit_through[i], l.stands_for)
                             : Vec3f{1, 1, 1};
    const Four source =
        l.lamp ? four_of(light.lamps[l.light].intensity) : light.irradiances[l.light];
    picture.added[l.slot] += four_of(l.weight * passed) * source;
  }
  constexpr std::size_t step = EnvironmentTerms::slots;
  const std::span<Four> added(picture.added);
  cell.environment.add_light(light.environment, added.first<step>());
  for (std::size_t i = 0; i < cell.environments_behind.size(); ++i) {
    cell.environments_behind[i].add_light(light.environment,
                                          added.subspan(slots + i * step).first<step>());
  }
  show_places(cell.bent, light, picture);
  show_shaded_places(cell, light, w, picture);
  show_places(cell.video, light, picture);
  show_painted(cell, light, picture);
  show_picture_rays(cell, pictures, picture);
  // Pixels of further samples: their own sums, and what they share of centres, of their own too.
  for (const CellTransport::Borrowed& b : cell.borrowed) {
    const auto n = static_cast<float>(b.count);
    const std::size_t to = cell_pixels + b.pixel;
    picture.added[to] += picture.added[b.centre] * n;
    picture.share[to] += picture.share[b.centre] * n;
    picture.seen[to] += picture.seen[b.centre] * n;
  }
  for (const CellTransport::Further& f : cell.further) {
    const auto n = static_cast<float>(f.count);
    const std::size_t k = f.pixel, from = cell_pixels + k;
    // Divided, not multiplied by 1 / n: n equal shares of the plate give it back exactly.
    picture.added[k] = picture.added[from] / n;
    picture.share[k] = picture.share[from] / n;
    picture.seen[k] = picture.seen[from] / n;
  }
  if (cell.blocks.size > 1) fill_blocks(cell.blocks, picture);
  if (!cell.foreground.empty()) show_foreground(cell.foreground.front(), picture);
  if (pictures && pictures->has_foreground) show_foreground(pictures->foreground, picture);
}

}  // namespace render
