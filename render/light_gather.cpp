// Who sees which light.
#include "render/light_gather.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "render/caustics.h"
#include "render/lanes.h"
#include "render/shadow_stream.h"
#include "render/trace.h"
#include "render/visibility_finder.h"

namespace render {
namespace {

// For each light: which pixels it shines on (in both their normals); and its irradiance there,
// added to `open`.
void find_lit(Receivers& r, std::span<const DirectionalLight> lights, std::span<CellMask> lit) {
  std::fill(lit.begin(), lit.end(), CellMask{});
  for (std::size_t k = 0; k < cell_pixels; k += lanes) {
    const auto active = static_cast<unsigned>(r.active[k / 64] >> (k % 64)) & ((1U << lanes) - 1);
    if (!active) continue;
    const Lanes here = mask_of(active);
    const Lanes nx = load(&r.nx[k]), ny = load(&r.ny[k]), nz = load(&r.nz[k]);
    const Lanes gx = load(&r.gx[k]), gy = load(&r.gy[k]), gz = load(&r.gz[k]);
    Lanes red = load(&r.open_r[k]), green = load(&r.open_g[k]), blue = load(&r.open_b[k]);
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const Lanes cosine = dot(nx, ny, nz, lights[i].direction);
      const Lanes shines =
          both(both(positive(cosine), positive(dot(gx, gy, gz, lights[i].direction))), here);
      const Lanes weight = both(cosine, shines);
      const Vec3f e = lights[i].irradiance;
      red = add(red, multiply(weight, all(e.x)));
      green = add(green, multiply(weight, all(e.y)));
      blue = add(blue, multiply(weight, all(e.z)));
      lit[i][k / 64] |= static_cast<std::uint64_t>(bits_of(shines)) << (k % 64);
    }
    store(&r.open_r[k], red), store(&r.open_g[k], green), store(&r.open_b[k], blue);
  }
}

// Irradiance of the lights that shine on a pixel but are not seen from it, added to `lost`.
void add_hidden(Receivers& r,
                std::span<const DirectionalLight> lights,
                std::span<const CellMask> lit,
                std::span<const CellMask> seen) {
  for (std::size_t k = 0; k < cell_pixels; k += lanes) {
    const auto active = static_cast<unsigned>(r.active[k / 64] >> (k % 64)) & ((1U << lanes) - 1);
    if (!active) continue;
    const Lanes nx = load(&r.nx[k]), ny = load(&r.ny[k]), nz = load(&r.nz[k]);
    Lanes red = load(&r.lost_r[k]), green = load(&r.lost_g[k]), blue = load(&r.lost_b[k]);
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const auto hidden = static_cast<unsigned>((lit[i][k / 64] & ~seen[i][k / 64]) >> (k % 64)) &
                          ((1U << lanes) - 1);
      if (!hidden) continue;
      const Lanes weight = both(dot(nx, ny, nz, lights[i].direction), mask_of(hidden));
      const Vec3f e = lights[i].irradiance;
      red = add(red, multiply(weight, all(e.x)));
      green = add(green, multiply(weight, all(e.y)));
      blue = add(blue, multiply(weight, all(e.z)));
    }
    store(&r.lost_r[k], red), store(&r.lost_g[k], green), store(&r.lost_b[k], blue);
  }
}

float cosine_at(const Receivers& r, std::size_t k, Vec3f l) {
  return r.nx[k] * l.x + r.ny[k] * l.y + r.nz[k] * l.z;
}

void add_lost(Receivers& r, std::size_t k, const DirectionalLight& light, Vec3f share) {
  const float cosine = cosine_at(r, k, light.direction);
  r.lost_r[k] += cosine * light.irradiance.x * share.x;
  r.lost_g[k] += cosine * light.irradiance.y * share.y;
  r.lost_b[k] += cosine * light.irradiance.z * share.z;
}

void subtract_open(Receivers& r, std::size_t k, const DirectionalLight& light) {
  const float cosine = cosine_at(r, k, light.direction);
  r.open_r[k] -= cosine * light.irradiance.x;
  r.open_g[k] -= cosine * light.irradiance.y;
  r.open_b[k] -= cosine * light.irradiance.z;
}

// That a tested light may stand for: where a point faces few of those that it tests, they are too
// few to tell how much light there is.
constexpr float most_stood_for = 16;
constexpr float rough_accuracy = 0.5F;  // from here on, points that count little test half as many

struct Box {
  Vec3f centre, half;
};

// Whether anything in `bounds` can lie between a point of `box` and a light in direction l.
bool may_block(const Scene::Bounds& bounds, const Box& box, Vec3f l) {
  float near_t = 0, far_t = ray_far;
  const auto slab = [&](float lower, float upper, float centre, float half, float d) {
    lower -= centre + half;
    upper -= centre - half;
    if (std::abs(d) < 1e-12F) return lower <= 0 && upper >= 0;
    const float a = lower / d, b = upper / d;
    near_t = std::max(near_t, std::min(a, b));
    far_t = std::min(far_t, std::max(a, b));
    return near_t <= far_t;
  };
  return slab(bounds.lower.x, bounds.upper.x, box.centre.x, box.half.x, l.x) &&
         slab(bounds.lower.y, bounds.upper.y, box.centre.y, box.half.y, l.y) &&
         slab(bounds.lower.z, bounds.upper.z, box.centre.z, box.half.z, l.z);
}

Box box_of(const Receivers& r) {
  Vec3f lower{ray_far, ray_far, ray_far}, upper = -lower;
  for (std::size_t word = 0; word < 4; ++word) {
    for (std::uint64_t bits = r.active[word]; bits != 0; bits &= bits - 1) {
      const std::size_t k = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      lower = {std::min(lower.x, r.px[k]), std::min(lower.y, r.py[k]), std::min(lower.z, r.pz[k])};
      upper = {std::max(upper.x, r.px[k]), std::max(upper.y, r.py[k]), std::max(upper.z, r.pz[k])};
    }
  }
  return {(lower + upper) * 0.5F, (upper - lower) * 0.5F};
}

bool can_be_blocked(const LightContext& context, const Box& box, Vec3f l) {
  if (!context.effort->cull_lights) return true;
  const auto& boxes = context.scene->blocker_boxes();
  return may_block(context.scene->blocker_bounds(), box, l) &&
         std::any_of(boxes.begin(), boxes.end(),
                     [&](const Scene::Bounds& b) { return may_block(b, box, l); });
}

// A point that counts little tests every second, fourth ... light only; compact ones are few and
// strong, and are tested by all. 0 = none.
std::uint32_t stride_of(const Effort& effort, float share, const DirectionalLight& light) {
  if (light.compact != 0) return 1;
  if (share == 0) return 0;
  if (effort.accuracy >= 1 || share >= 0.5F) return 1;
  const std::uint32_t stride = share >= 0.2F ? 2 : share >= 0.05F ? 4 : 8;
  return effort.accuracy > rough_accuracy ? stride : 2 * stride;
}

bool shines_on(const Receivers& r, std::size_t k, Vec3f l) {
  return cosine_at(r, k, l) > 0 && r.gx[k] * l.x + r.gy[k] * l.y + r.gz[k] * l.z > 0;
}

float sum(Vec3f v) { return v.x + v.y + v.z; }

void clear_sums(Receivers& r) {
  r.open_r.fill(0), r.open_g.fill(0), r.open_b.fill(0);
  r.lost_r.fill(0), r.lost_g.fill(0), r.lost_b.fill(0);
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

}  // namespace

unsigned LightContext::mask_to(std::uint32_t light) const {
  return caustics != nullptr && caustics->photons().follows(light) ? ray_glass_blocks : 0U;
}

void gather_cell(const LightContext& context,
                 Receivers& r,
                 GatherWorkspace& w,
                 CellVisibility& visibility,
                 RenderStatistics& statistics) {
  clear_sums(r);
  find_smooth_blocks(r, w);
  const auto& lights = context.table->lights;
  visibility.lit.resize(lights.size());
  visibility.seen.resize(lights.size());
  visibility.tints.clear();
  const Box box = box_of(r);
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
      skip[i] = w.lit[i] == CellMask{} || !can_be_blocked(context, box, group[i].direction);
    }
    if (real_first != CellMask{}) {
      // Light that real things block is not there to be lost.
      VisibilityFinder behind(context, r, w, statistics, mask_real_blocker);
      behind.skip_ = skip;
      behind.find(first32, count);
      w.tints.clear();
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t word = 0; word < 4; ++word) {
          const std::uint64_t hidden = w.lit[i][word] & ~w.seen[i][word] & real_first[word];
          for (std::uint64_t bits = hidden; bits != 0; bits &= bits - 1) {
            const auto k = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
            subtract_open(r, k, lights[first + i]);
          }
          w.lit[i][word] &= ~hidden;
        }
      }
    }
    VisibilityFinder finder(context, r, w, statistics, 0);
    finder.skip_ = skip;
    finder.find(first32, count);
    add_hidden(r, group, std::span(w.lit).first(count), std::span(w.seen).first(count));
    for (const auto& tint : w.tints) {
      add_lost(r, tint.point, lights[tint.light], tint.lost_share);
      visibility.tints.push_back({static_cast<std::uint16_t>(tint.light),
                                  static_cast<std::uint16_t>(tint.point), tint.lost_share});
    }
    std::copy_n(w.lit.begin(), count, visibility.lit.begin() + static_cast<std::ptrdiff_t>(first));
    std::copy_n(w.seen.begin(), count,
                visibility.seen.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

void gather_points(const LightContext& context,
                   Receivers& r,
                   GatherWorkspace& w,
                   std::vector<PointLight>& tested,
                   RenderStatistics& statistics) {
  clear_sums(r);
  const auto& lights = context.table->lights;
  const bool real = context.scene->has_real_blockers();
  const auto is_tested = [&](std::size_t k, std::uint32_t i) {
    const std::uint32_t stride = stride_of(*context.effort, r.share[k], lights[i]);
    return stride != 0 && (i + k) % stride == 0;
  };
  std::array<float, cell_pixels> stands_for;  // lights, of each that the point tests
  stands_for.fill(1);
  for (std::size_t k = 0; k < static_cast<std::size_t>(r.count); ++k) {
    if (stride_of(*context.effort, r.share[k], {}) <= 1) continue;
    float of_tested = 0, of_all = 0;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
      if (lights[i].compact != 0 || !shines_on(r, k, lights[i].direction)) continue;
      const float e = cosine_at(r, k, lights[i].direction) * sum(lights[i].irradiance);
      of_all += e;
      if (is_tested(k, i)) of_tested += e;
    }
    if (of_tested > 0) stands_for[k] = std::min(of_all / of_tested, most_stood_for);
  }
  const auto visit = [&](std::uint32_t k, std::uint32_t i, bool blocked, Vec3f share) {
    const Vec3f passed = blocked ? Vec3f{} : share;
    const float weight =
        cosine_at(r, k, lights[i].direction) * (lights[i].compact != 0 ? 1.0F : stands_for[k]);
    const Vec3f open = lights[i].irradiance * weight;
    const Vec3f lost = open * (Vec3f{1, 1, 1} - passed);
    r.open_r[k] += open.x, r.open_g[k] += open.y, r.open_b[k] += open.z;
    r.lost_r[k] += lost.x, r.lost_g[k] += lost.y, r.lost_b[k] += lost.z;
    tested.push_back(
        {static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(i), weight, passed});
  };
  for (std::uint32_t i = 0; i < lights.size(); ++i) {
    const Vec3f l = lights[i].direction;
    for (std::size_t k = 0; k < static_cast<std::size_t>(r.count); ++k) {
      if (!is_tested(k, i) || !shines_on(r, k, l)) continue;
      if (real && r.real_first[k]) {
        const Vec3f origin{r.px[k], r.py[k], r.pz[k]};
        ++statistics.shadow_rays;
        if (w.counts) ++w.counts[k];
        if (transmittance(*context.scene, origin, l, 0, ray_far, mask_real_blocker) == Vec3f{}) {
          continue;
        }
      }
      add_ray(w, r, k, i, l, r.mask[k] | (in(r.by_caustics, k) ? context.mask_to(i) : 0U));
      if (w.rays == stream_rays) flush(*context.scene, w, statistics, visit);
    }
  }
  flush(*context.scene, w, statistics, visit);
}

void gather_cell_lamps(const LightContext& context,
                       const Receivers& r,
                       GatherWorkspace& w,
                       CellLamps& cell,
                       RenderStatistics& statistics) {
  const auto& lamps = context.table->lamps;
  for (std::size_t first = 0; first < lamps.size(); first += GatherWorkspace::group) {
    const std::size_t count = std::min<std::size_t>(GatherWorkspace::group, lamps.size() - first);
    VisibilityFinder finder(context, r, w, statistics, mask_virtual | mask_real_blocker, true);
    std::array<std::uint16_t, GatherWorkspace::group> place{};
    w.tints.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const LocalLight& lamp = lamps[first + i];
      w.lit[i] = {};
      finder.skip_[i] = lamp.ambient != 0 || context.is_caustic(first + i);
      if (lamp.intensity == Vec3f{}) continue;
      if (context.is_caustic(first + i)) {
        add_cell_caustic(context, r, first + i, cell);
        continue;
      }
      CellLamps::Factors factors{};
      for (std::size_t word = 0; word < 4; ++word) {
        for (std::uint64_t bits = r.by_lamps[word]; bits != 0; bits &= bits - 1) {
          const std::size_t k = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
          const auto ray = ray_to_lamp(lamp_receiver(r, k), lamp);
          if (!ray) continue;
          factors.at[k] = ray->per_intensity;
          w.lit[i][word] |= std::uint64_t{1} << (k % 64);
        }
      }
      if (w.lit[i] == CellMask{}) continue;
      place[i] = static_cast<std::uint16_t>(cell.numbers.size());
      cell.numbers.push_back(static_cast<std::uint16_t>(first + i));
      cell.factors.push_back(factors);
    }
    finder.find(static_cast<std::uint32_t>(first), count);
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
}

void gather_point_lamps(const LightContext& context,
                        const Receivers& r,
                        GatherWorkspace& w,
                        std::vector<PointLamp>& reached,
                        RenderStatistics& statistics) {
  const auto& lamps = context.table->lamps;
  const auto visit = [&](std::uint32_t k, std::uint32_t i, bool blocked, Vec3f share) {
    const auto ray = ray_to_lamp(lamp_receiver(r, k), lamps[i]);
    if (blocked || !ray) return;
    reached.push_back(
        {static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(i), share * ray->per_intensity});
  };
  for (std::size_t k = 0; k < static_cast<std::size_t>(r.count); ++k) {
    const bool by_lamps = in(r.by_lamps, k), by_caustics = in(r.by_caustics, k);
    if (!by_lamps && !by_caustics) continue;
    for (std::uint32_t i = 0; i < lamps.size(); ++i) {
      if (lamps[i].intensity == Vec3f{}) continue;
      if (!(context.is_caustic(i) ? by_caustics : by_lamps)) continue;
      if (context.is_caustic(i)) {
        const LampReceiver at = lamp_receiver(r, k);
        const Vec3f got =
            context.caustics->at(i - context.first_caustic, at.origin, at.geometric_normal);
        if (got == Vec3f{}) continue;
        reached.push_back({static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(i), got});
        continue;
      }
      const auto ray = ray_to_lamp(lamp_receiver(r, k), lamps[i]);
      if (!ray) continue;
      if (!(ray->far_m > 0)) {
        visit(static_cast<std::uint32_t>(k), i, false, {1, 1, 1});
        continue;
      }
      add_ray(w, r, k, i, ray->direction, mask_virtual | mask_real_blocker, ray->far_m);
      if (w.rays == stream_rays) flush(*context.scene, w, statistics, visit);
    }
  }
  flush(*context.scene, w, statistics, visit);
}

}  // namespace render
