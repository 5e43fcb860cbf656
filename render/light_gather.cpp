// Who sees which light.
#include "render/light_gather.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "render/blocker_boxes.h"
#include "render/caustics.h"
#include "render/lanes.h"
#include "render/shadow_stream.h"
#include "render/smooth_blocks.h"
#include "render/soft_lights.h"
#include "render/trace.h"
#include "render/visibility_finder.h"

namespace render {
namespace {

// For each light: which pixels it shines on, in both their normals.
void find_lit(const Receivers& r,
              std::span<const DirectionalLight> lights,
              std::span<CellMask> lit) {
  std::fill(lit.begin(), lit.end(), CellMask{});
  for (std::size_t k = 0; k < cell_pixels; k += lanes) {
    const auto active = static_cast<unsigned>(r.active[k / 64] >> (k % 64)) & ((1U << lanes) - 1);
    if (!active) continue;
    const Lanes nx = load(&r.nx[k]), ny = load(&r.ny[k]), nz = load(&r.nz[k]);
    const Lanes gx = load(&r.gx[k]), gy = load(&r.gy[k]), gz = load(&r.gz[k]);
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const Vec3f l = lights[i].direction;
      const Lanes shines = both(positive(dot(nx, ny, nz, l)), positive(dot(gx, gy, gz, l)));
      lit[i][k / 64] |= static_cast<std::uint64_t>(bits_of(shines) & active) << (k % 64);
    }
  }
}

// Of eight receivers side by side.
LampWay<Eight> ways_to(const Receivers& r, std::size_t first, const LocalLight& lamp) {
  const auto eight = [first](const auto& x, const auto& y, const auto& z) {
    return calibrate::Vec3T<Eight>{load_eight(&x[first]), load_eight(&y[first]),
                                   load_eight(&z[first])};
  };
  return way_to_lamp(eight(r.px, r.py, r.pz), eight(r.nx, r.ny, r.nz), eight(r.gx, r.gy, r.gz),
                     lamp);
}

// Which pixels a lamp shines on, and how much of it they get.
void find_lit(const Receivers& r,
              const LocalLight& lamp,
              CellLamps::Factors& factors,
              CellMask& lit) {
  for (std::size_t first = 0; first < cell_pixels; first += 8) {
    const auto asked = static_cast<unsigned>(r.by_lamps[first / 64] >> (first % 64) & 0xFF);
    if (asked == 0) continue;
    unsigned shines = asked;
    Eight got = eight_of(1);
    if (lamp.ambient == 0) {
      const LampWay<Eight> ways = ways_to(r, first, lamp);
      shines &= bits_of(ways.shines);
      got = ways.per_intensity;
    }
    for (unsigned left = shines; left != 0; left &= left - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(left));
      factors.at[first + k] = got[k];
    }
    lit[first / 64] |= std::uint64_t{shines} << (first % 64);
  }
}

constexpr float rough_accuracy = 0.5F;  // from here on, points that count little test half as many

Scene::Bounds box_of(const Receivers& r) {
  Vec3f lower{ray_far, ray_far, ray_far}, upper = -lower;
  for (std::size_t word = 0; word < 4; ++word) {
    for (std::uint64_t bits = r.active[word]; bits != 0; bits &= bits - 1) {
      const std::size_t k = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      lower = {std::min(lower.x, r.px[k]), std::min(lower.y, r.py[k]), std::min(lower.z, r.pz[k])};
      upper = {std::max(upper.x, r.px[k]), std::max(upper.y, r.py[k]), std::max(upper.z, r.pz[k])};
    }
  }
  return {lower, upper};
}

// A point that counts little tests every second, fourth ... light only; compact ones are few and
// strong, and are tested by all. 0 = none.
std::uint32_t stride_of(const Effort& effort, float share) {
  if (share == 0) return 0;
  if (effort.accuracy >= 1 || share >= 0.5F) return 1;
  const std::uint32_t stride = share >= few_lights_share ? 2 : share >= 0.05F ? 4 : 8;
  return effort.accuracy > rough_accuracy ? stride : 2 * stride;
}

// What a cell's centres get of a light's caustics, its colour as tints.
void add_cell_caustic(const LightContext& context,
                      const Receivers& r,
                      std::size_t lamp,
                      CellLamps& cell) {
  CellLamps::Factors factors{};
  const auto place = static_cast<std::uint16_t>(cell.numbers.size());
  bool any = false;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(r.by_caustics, k)) continue;
    const LampReceiver at = lamp_receiver(r, k);
    const Vec3f got =
        context.caustics->at(lamp - context.first_caustic, at.origin, at.geometric_normal);
    const float most = largest(got);
    if (!(most > 0)) continue;
    any = true;
    factors.at[k] = most;
    const Vec3f lost = Vec3f{1, 1, 1} - got / most;
    if (lost != Vec3f{}) cell.tints.push_back({place, static_cast<std::uint16_t>(k), lost});
  }
  if (!any) return;
  cell.numbers.push_back(static_cast<std::uint16_t>(lamp));
  cell.factors.push_back(factors);
}

// How far things cast sharp shadows, by how far neighbouring pixels' points lie apart: penumbrae as
// wide as four pixels, which a window is.
void find_sharp(const Receivers& r, GatherWorkspace& w) {
  const auto step = [&r](std::size_t a, std::size_t b) {
    if (!in(r.active, b) || r.surface[a] != r.surface[b]) return 0.0F;
    return length(Vec3f{r.px[b] - r.px[a], r.py[b] - r.py[a], r.pz[b] - r.pz[a]});
  };
  w.sharp_m.fill(0);
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(r.active, k)) continue;
    const float across = step(k, k % cell_size + 1 < cell_size ? k + 1 : k - 1);
    const float down = step(k, k + cell_size < cell_pixels ? k + cell_size : k - cell_size);
    w.sharp_m[k] = across + down;
  }
}

// Marks pixels that see a light that has parts otherwise than the next one does, or tinted.
void find_soft(const LightContext& context,
               const GatherWorkspace& w,
               std::size_t first,
               std::size_t count,
               CellMask& soft_shadow) {
  constexpr std::uint64_t last_column = 0x8000800080008000ULL;
  for (std::size_t i = 0; i < count; ++i) {
    if (!context.has_parts(first + i)) continue;
    std::array<std::uint64_t, 5> soft{}, hidden{};
    for (std::size_t word = 0; word < 4; ++word) {
      soft[word] = w.lit[i][word] & ~w.near[i][word];
      hidden[word] = soft[word] & ~w.seen[i][word];
    }
    for (std::size_t word = 0; word < 4; ++word) {
      const auto next_row = [word](const auto& of) { return of[word] >> 16 | of[word + 1] << 48; };
      const std::uint64_t right = (hidden[word] ^ hidden[word] >> 1) & soft[word] >> 1;
      const std::uint64_t below = (hidden[word] ^ next_row(hidden)) & next_row(soft);
      soft_shadow[word] |= soft[word] & ((right & ~last_column) | below);
    }
  }
  for (const GatherWorkspace::Tint& tint : w.tints) {
    const std::size_t k = tint.point;
    if (!context.has_parts(tint.light) || in(w.near[tint.light - first], k)) continue;
    soft_shadow[k / 64] |= std::uint64_t{1} << (k % 64);
  }
}

void find_windows(const Receivers& r,
                  const CellMask& soft_shadow,
                  std::vector<ShadowWindow>& windows) {
  constexpr int side = SoftLights::side;
  for (int y = 0; y < cell_size; ++y) {
    for (int x = 0; x < cell_size; ++x) {
      const auto centre = static_cast<std::size_t>(y * cell_size + x);
      if (!in(r.active, centre)) continue;
      const int x0 = std::clamp(x - 1, 0, cell_size - side);
      const int y0 = std::clamp(y - 1, 0, cell_size - side);
      unsigned members = 0;
      bool soft = false;
      for (int i = 0; i < side * side; ++i) {
        const auto k = static_cast<std::size_t>((y0 + i / side) * cell_size + x0 + i % side);
        if (!in(r.active, k) || !is_one_surface(r, centre, k)) continue;
        members |= 1U << i;
        soft = soft || in(soft_shadow, k);
      }
      if (!soft) continue;
      windows.push_back({static_cast<std::uint8_t>(centre),
                         static_cast<std::uint8_t>(y0 * cell_size + x0),
                         static_cast<std::uint16_t>(members)});
    }
  }
}

}  // namespace

LightRows::LightRows(std::span<const DirectionalLight> lights) : number(order_by_place(lights)) {
  wide = number.size();
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (lights[i].compact != 0) number.push_back(static_cast<std::uint16_t>(i));
  }
  place.resize(lights.size());
  for (std::size_t i = 0; i < number.size(); ++i) place[number[i]] = static_cast<std::uint16_t>(i);
  for (const std::uint16_t i : number) {
    const DirectionalLight& light = lights[i];
    x.push_back(light.direction.x);
    y.push_back(light.direction.y);
    z.push_back(light.direction.z);
    sum.push_back(light.irradiance.x + light.irradiance.y + light.irradiance.z);
    spread.push_back(light.spread);
  }
  for (std::vector<float>* row : {&x, &y, &z, &sum, &spread}) {
    row->resize((number.size() + 7) / 8 * 8);
  }
}

bool LightContext::can_be_blocked(const Scene::Bounds& from, std::size_t light) const {
  if (!effort->cull_lights) return true;
  const DirectionRange to = range(light);
  return may_be_met(scene->blocker_bounds(), from, to) &&
         std::ranges::any_of(scene->blocker_boxes(),
                             [&](const Scene::Bounds& b) { return may_be_met(b, from, to); });
}

unsigned LightContext::mask_to(std::uint32_t light) const {
  return caustics != nullptr && caustics->photons().follows(light) ? ray_glass_blocks : 0U;
}

void gather_cell(const LightContext& context,
                 Receivers& r,
                 GatherWorkspace& w,
                 CellVisibility& visibility,
                 RenderStatistics& statistics) {
  find_smooth_blocks(r, w);
  const auto& lights = context.table->lights;
  visibility.lit.resize(lights.size());
  visibility.seen.resize(lights.size());
  visibility.tints.clear();
  visibility.windows.clear();
  if (context.parts != nullptr) find_sharp(r, w);
  visibility.near.resize(lights.size());
  CellMask soft_shadow{};
  const Scene::Bounds box = box_of(r);
  w.notes.begin(context, r, ShadowRays::to_lights);
  CellMask real_first{};
  if (context.scene->has_real_blockers()) {
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (r.real_first[k]) real_first[k / 64] |= std::uint64_t{1} << (k % 64);
    }
    for (std::size_t word = 0; word < 4; ++word) real_first[word] &= r.active[word];
  }

  CellMask answering{};  // to lights that are not compact
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (r.share[k] > 0) answering[k / 64] |= std::uint64_t{1} << (k % 64);
  }
  for (std::size_t first = 0; first < lights.size(); first += GatherWorkspace::group) {
    const std::size_t count = std::min<std::size_t>(GatherWorkspace::group, lights.size() - first);
    const auto first32 = static_cast<std::uint32_t>(first);
    w.tints.clear();
    std::array<bool, GatherWorkspace::group> skip{};
    const std::span<const DirectionalLight> group(&lights[first], count);
    find_lit(r, group, std::span(w.lit).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      if (group[i].compact == 0) {
        for (std::size_t word = 0; word < 4; ++word) w.lit[i][word] &= answering[word];
      }
      skip[i] = true;
      if (w.lit[i] == CellMask{}) continue;
      skip[i] = !context.can_be_blocked(box, first + i);
      if (skip[i]) w.notes.leave_out(first32 + static_cast<std::uint32_t>(i), box);
    }
    if (real_first != CellMask{}) {
      // Light that real things block is not there to be lost.
      VisibilityFinder behind(context, r, w, statistics, mask_real_blocker);
      behind.find(first32, std::span(skip).first(count));
      w.tints.clear();
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t word = 0; word < 4; ++word) {
          const std::uint64_t hidden = w.lit[i][word] & ~w.seen[i][word] & real_first[word];
          w.lit[i][word] &= ~hidden;
        }
      }
    }
    VisibilityFinder finder(context, r, w, statistics, 0);
    finder.find(first32, std::span(skip).first(count));
    for (const auto& tint : w.tints) {
      visibility.tints.push_back({static_cast<std::uint16_t>(tint.light),
                                  static_cast<std::uint16_t>(tint.point), tint.lost_share});
    }
    std::copy_n(w.lit.begin(), count, visibility.lit.begin() + static_cast<std::ptrdiff_t>(first));
    std::copy_n(w.seen.begin(), count,
                visibility.seen.begin() + static_cast<std::ptrdiff_t>(first));
    if (context.parts == nullptr) continue;
    std::copy_n(w.near.begin(), count,
                visibility.near.begin() + static_cast<std::ptrdiff_t>(first));
    find_soft(context, w, first, count, soft_shadow);
  }
  if (soft_shadow != CellMask{}) find_windows(r, soft_shadow, visibility.windows);
  if (visibility.windows.empty()) visibility.near.clear();
  add_up_light({r.active, r.nx, r.ny, r.nz}, lights, visibility, r.light, w.soft);
}

namespace {

// A row of lights and a point: calls `visit(first, cosines, shines)` for every eight of them
// from `from` on; the mask is of those that shine on it, in both its normals.
template <class F>
void for_each_eight(
    const LightRows& rows, const Receivers& r, std::size_t k, std::size_t from, F&& visit) {
  for (std::size_t first = from / 8 * 8; first < rows.x.size(); first += 8) {
    const Eight x = load_eight(&rows.x[first]), y = load_eight(&rows.y[first]),
                z = load_eight(&rows.z[first]);
    const Eight cosines = r.nx[k] * x + r.ny[k] * y + r.nz[k] * z;
    const Eight risen = r.gx[k] * x + r.gy[k] * y + r.gz[k] * z;
    visit(first, cosines, (cosines > Eight{}) & (risen > Eight{}));
  }
}

// Which light of a few a point tests, and what of its irradiance it then stands for; nothing if
// none of them shines there. One sample of a pixel takes the brightest; of many, each takes one by
// what it gives there, at another place of their sum.
std::optional<GatherWorkspace::Asked> one_of(const LightContext& context,
                                             const Receivers& r,
                                             std::size_t k,
                                             std::span<const float> given,
                                             std::size_t first,
                                             std::size_t count) {
  const std::span<const float> gives =
      given.subspan(first, std::min(count, context.rows->wide - first));
  float all = 0;
  for (const float g : gives) all += std::max(g, 0.0F);
  if (!(all > 0)) return std::nullopt;
  auto chosen = static_cast<std::size_t>(std::ranges::max_element(gives) - gives.begin());
  if (r.part[k] != SoftLights::middle) {
    const float place = (static_cast<float>(r.part[k]) + 0.5F) / SoftLights::count +
                        golden_ratio * static_cast<float>(first / count);
    float left = (place - std::floor(place)) * all;
    for (std::size_t i = 0; i < gives.size(); ++i) {
      if (!(gives[i] > 0)) continue;
      chosen = i;
      left -= gives[i];
      if (left < 0) break;
    }
  }
  return GatherWorkspace::Asked{static_cast<std::uint16_t>(k), context.rows->number[first + chosen],
                                all / context.rows->sum[first + chosen]};
}

void ask_lights(const LightContext& context, const Receivers& r, GatherWorkspace& w) {
  const auto& lights = context.table->lights;
  const LightRows& rows = *context.rows;
  w.asked.clear();
  w.gives.resize(rows.x.size());
  for (std::size_t k = 0; k < static_cast<std::size_t>(r.count); ++k) {
    const std::uint32_t stride = stride_of(*context.effort, r.share[k]);
    const std::size_t from = stride == 1 ? 0 : rows.wide;  // those that every point asks
    const auto ask = [&](std::size_t first, const Eight& cosines, const auto& shines) {
      unsigned bits = bits_of(shines);
      if (first < from) bits &= ~0U << (from - first);
      for (; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(bits));
        w.asked.push_back({static_cast<std::uint16_t>(k), rows.number[first + i], cosines[i]});
      }
    };
    for_each_eight(rows, r, k, from, ask);
    if (stride <= 1) continue;
    for_each_eight(rows, r, k, 0, [&](std::size_t first, const Eight& cosines, const auto& shines) {
      const Eight gives = cosines * load_eight(&rows.sum[first]);
      store_eight(&w.gives[first], shines ? gives : Eight{});
    });
    for (std::size_t i = 0; i < rows.wide; i += stride) {
      if (const auto asked = one_of(context, r, k, w.gives, i, stride)) w.asked.push_back(*asked);
    }
  }
  // Light by light: rays of a stream then go the same way.
  w.first_of_light.assign(lights.size() + 1, 0);
  for (const GatherWorkspace::Asked& a : w.asked) ++w.first_of_light[a.light + 1U];
  std::partial_sum(w.first_of_light.begin(), w.first_of_light.end(), w.first_of_light.begin());
  w.asked_by_light.resize(w.asked.size());
  for (const GatherWorkspace::Asked& a : w.asked) {
    w.asked_by_light[w.first_of_light[a.light]++] = a;
  }
}

}  // namespace

void gather_points(const LightContext& context,
                   Receivers& r,
                   GatherWorkspace& w,
                   std::vector<PointLight>& tested,
                   RenderStatistics& statistics) {
  r.light = {};
  const auto& lights = context.table->lights;
  const bool real = context.scene->has_real_blockers();
  ask_lights(context, r, w);
  w.notes.begin(context, r, ShadowRays::to_lights);
  std::size_t rays = 0;
  const auto visit = [&](std::uint32_t k, std::uint32_t i, bool blocked, Vec3f share) {
    const Vec3f passed = blocked ? Vec3f{} : share;
    const float weight = w.ray_weight[rays++];
    const Vec3f open = lights[i].irradiance * weight;
    const Vec3f lost = open * (Vec3f{1, 1, 1} - passed);
    r.light.add_open(k, open);
    r.light.add_lost(k, lost);
    tested.push_back(
        {static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(i), weight, passed});
  };
  const auto shoot_all = [&] {
    rays = 0;
    flush(*context.scene, w, statistics, visit);
  };
  for (const auto& [k, i, weight] : w.asked_by_light) {
    const Vec3f to = context.direction(r, k, i);
    if (real && r.real_first[k]) {
      const Vec3f origin{r.px[k], r.py[k], r.pz[k]};
      ++statistics.shadow_rays;
      if (w.counts) ++w.counts[k];
      const bool blocked =
          transmittance(*context.scene, origin, to, 0, ray_far, mask_real_blocker) == Vec3f{};
      w.notes.note(origin, mask_real_blocker, to, blocked);
      if (blocked) continue;
    }
    w.ray_weight[static_cast<std::size_t>(w.rays)] = weight;
    add_ray(w, r, k, i, to, r.mask[k] | (in(r.by_caustics, k) ? context.mask_to(i) : 0U));
    if (w.rays == stream_rays) shoot_all();
  }
  shoot_all();
}

void gather_cell_lamps(const LightContext& context,
                       const Receivers& r,
                       GatherWorkspace& w,
                       CellLamps& cell,
                       RenderStatistics& statistics) {
  const auto& lamps = context.table->lamps;
  w.notes.begin(context, r, ShadowRays::to_lamps);
  for (std::size_t first = 0; first < lamps.size(); first += GatherWorkspace::group) {
    const std::size_t count = std::min<std::size_t>(GatherWorkspace::group, lamps.size() - first);
    std::array<std::uint16_t, GatherWorkspace::group> place{};
    std::array<bool, GatherWorkspace::group> skip{};
    w.tints.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const LocalLight& lamp = lamps[first + i];
      w.lit[i] = {};
      skip[i] = lamp.ambient != 0 || context.is_caustic(first + i);
      if (lamp.intensity == Vec3f{}) continue;
      if (context.is_caustic(first + i)) {
        add_cell_caustic(context, r, first + i, cell);
        continue;
      }
      CellLamps::Factors factors{};
      find_lit(r, lamp, factors, w.lit[i]);
      if (w.lit[i] == CellMask{}) continue;
      place[i] = static_cast<std::uint16_t>(cell.numbers.size());
      cell.numbers.push_back(static_cast<std::uint16_t>(first + i));
      cell.factors.push_back(factors);
    }
    VisibilityFinder finder(context, r, w, statistics, mask_virtual | mask_real_blocker, true);
    finder.find(static_cast<std::uint32_t>(first), std::span(skip).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t word = 0; word < 4; ++word) {
        for (std::uint64_t bits = w.lit[i][word] & ~w.seen[i][word]; bits != 0; bits &= bits - 1) {
          cell.factors[place[i]].at[word * 64 + static_cast<std::size_t>(std::countr_zero(bits))] =
              0;
        }
      }
    }
    for (const auto& tint : w.tints) {
      cell.tints.push_back(
          {place[tint.light - first], static_cast<std::uint16_t>(tint.point), tint.lost_share});
    }
  }
  std::ranges::sort(cell.tints, {}, key_of);
}

std::span<const TintedLight> CellLamps::tints_of(std::size_t place) const {
  return std::ranges::equal_range(tints, place, {}, &TintedLight::light);
}

Vec3f CellLamps::passed(std::size_t place, std::size_t centre) const {
  Vec3f passed{1, 1, 1};
  for (const TintedLight& tint :
       std::ranges::equal_range(tints_of(place), centre, {}, &TintedLight::centre)) {
    passed -= tint.lost_share;
  }
  return passed;
}

void gather_point_lamps(const LightContext& context,
                        const Receivers& r,
                        GatherWorkspace& w,
                        std::vector<PointLamp>& reached,
                        RenderStatistics& statistics) {
  const auto& lamps = context.table->lamps;
  std::size_t rays = 0;
  const auto visit = [&](std::uint32_t k, std::uint32_t i, bool blocked, Vec3f share) {
    const float open = w.ray_weight[rays++];
    if (blocked) return;
    reached.push_back({static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(i), share, open});
  };
  const auto shoot_all = [&] {
    rays = 0;
    flush(*context.scene, w, statistics, visit);
  };
  w.notes.begin(context, r, ShadowRays::to_lamps);
  w.ways.resize(lamps.size());
  const auto count = static_cast<std::size_t>(r.count);
  for (std::size_t first = 0; first < count; first += 8) {
    const bool any_by_lamps = (r.by_lamps[first / 64] >> (first % 64) & 0xFF) != 0;
    for (std::size_t i = 0; any_by_lamps && i < lamps.size(); ++i) {
      if (lamps[i].ambient == 0 && !context.is_caustic(i)) w.ways[i] = ways_to(r, first, lamps[i]);
    }
    for (std::size_t k = first; k < std::min(count, first + 8); ++k) {
      const bool by_lamps = in(r.by_lamps, k), by_caustics = in(r.by_caustics, k);
      if (!by_lamps && !by_caustics) continue;
      const auto point = static_cast<std::uint16_t>(k);
      for (std::uint32_t i = 0; i < lamps.size(); ++i) {
        if (lamps[i].intensity == Vec3f{}) continue;
        if (!(context.is_caustic(i) ? by_caustics : by_lamps)) continue;
        const auto lamp = static_cast<std::uint16_t>(i);
        if (context.is_caustic(i)) {
          const LampReceiver at = lamp_receiver(r, k);
          const Vec3f got =
              context.caustics->at(i - context.first_caustic, at.origin, at.geometric_normal);
          if (got != Vec3f{}) reached.push_back({point, lamp, got, 1});
        } else if (lamps[i].ambient != 0) {
          reached.push_back({point, lamp, {1, 1, 1}, 1});
        } else if (const LampWay<Eight>& way = w.ways[i]; way.shines[k - first] != 0) {
          const std::size_t j = k - first;
          w.ray_weight[static_cast<std::size_t>(w.rays)] = way.per_intensity[j];
          add_ray(w, r, k, i, {way.direction.x[j], way.direction.y[j], way.direction.z[j]},
                  mask_virtual | mask_real_blocker, way.distance_m[j] * before_lamp);
          if (w.rays == stream_rays) shoot_all();
        }
      }
    }
  }
  shoot_all();
}

}  // namespace render
