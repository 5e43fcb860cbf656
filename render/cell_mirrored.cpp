// The light of what centres mirror, or see through something clear.
#include <algorithm>
#include <numbers>

#include "render/cell_baker.h"

namespace render {
namespace {

constexpr float reach_of_neighbours = 1.5F;  // by their cones
constexpr float grey_plate = 0.2F / std::numbers::pi_v<float>;

Vec3f lesser(Vec3f a, Vec3f b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
Vec3f greater(Vec3f a, Vec3f b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

}  // namespace

// Of the rays that each centre has sent on the brightest, to be followed together.
void CellBaker::choose_first() {
  std::array<QueuedRay*, cell_pixels> brightest{};
  for (QueuedRay& ray : queue_) {
    QueuedRay*& best = brightest[ray.pixel];
    if (best == nullptr || largest(ray.throughput) > largest(best->throughput)) best = &ray;
  }
  for (QueuedRay* best : brightest) {
    if (best != nullptr) best->first = true;
  }
  std::partition(queue_.begin(), queue_.end(), [](const QueuedRay& ray) { return !ray.first; });
}

// Dull surfaces, and the plate in shadows; but for caustics each has a point of its own.
bool CellBaker::may_be_lit_as_centres(const ShadePoint& p) const {
  if (p.catches_lamps) return false;
  return p.catches_shadow ? p.kind == RayKind::bent && !frame_->caustics : p.diffuse != Vec3f{};
}

// Which pixels' centres mirror what may get its light as centres do: those of 4x4 pixels that see
// one smooth surface there, which mirrors no light itself; of the plate, some of these are enough,
// for else its lights are kept one by one.
CellMask CellBaker::find_mirrored(int count, std::span<const std::uint8_t> glossy) {
  mirrored_at_.fill(nowhere);
  CellMask found{};
  bool any = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const ShadePoint& p = points_[i];
    if (!is_first_[i] || glossy[i] || !may_be_lit_as_centres(p)) continue;
    mirrored_at_[p.pixel] = static_cast<std::uint16_t>(i);
    any = true;
  }
  for (std::size_t block = 0; any && block < 16; ++block) {
    const std::size_t first = block / 4 * 4 * cell_size + block % 4 * 4;
    if (mirrors_smoothly(first)) {
      found[first / 64] |= block4 << (first % 64);
    } else {
      find_near_plate(first, found);
    }
  }
  return found;
}

// Of a block that mirrors the plate in part, what lies together.
void CellBaker::find_near_plate(std::size_t first, CellMask& found) const {
  constexpr std::size_t worth_it = 5;
  std::array<std::size_t, 16> near;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t k = first + i / 4 * cell_size + i % 4;
    if (mirrored_at_[k] == nowhere || !points_[mirrored_at_[k]].catches_shadow) continue;
    if (count == 0 || mirror_alike(points_[mirrored_at_[near[0]]], points_[mirrored_at_[k]])) {
      near[count++] = k;
    }
  }
  if (count < worth_it) return;
  for (const std::size_t k : std::span(near).first(count)) {
    found[k / 64] |= std::uint64_t{1} << (k % 64);
  }
}

// Whether two pixels of a block see one smooth surface, near by.
bool CellBaker::mirror_alike(const ShadePoint& a, const ShadePoint& b) {
  constexpr float apart = 8;  // how far pixels of a block are, at most, by their cones
  const float wide_m = apart * (length(a.steps.a) + length(a.steps.b));
  return a.hit.instance == b.hit.instance && a.hit.material == b.hit.material &&
         dot(a.light_normal, b.light_normal) > alike_normals &&
         length(b.hit.position - a.hit.position) < wide_m;
}

bool CellBaker::mirrors_smoothly(std::size_t first) const {
  if (mirrored_at_[first] == nowhere) return false;
  const ShadePoint& a = points_[mirrored_at_[first]];
  for (std::size_t i = 1; i < 16; ++i) {
    const std::size_t k = first + i / 4 * cell_size + i % 4;
    if (mirrored_at_[k] == nowhere || !mirror_alike(a, points_[mirrored_at_[k]])) return false;
  }
  return true;
}

// Lights what of some points needs no light of its own: what centres mirror smoothly, and what
// further samples see beside that, or centres once more, as both faces of a pane do.
void CellBaker::receive_mirrored(int count, std::span<const std::uint8_t> glossy) {
  std::array<std::uint16_t, stream_rays> points;
  std::size_t n = 0;
  const CellMask mirrored = find_mirrored(count, glossy);
  if (mirrored != CellMask{}) {
    light_mirrored(mirrored);
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (in(mirrored, k)) points[n++] = mirrored_at_[k];
    }
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const std::uint32_t pixel = points_[i].pixel;
    const bool has_own = is_first_[i] && in(mirrored, pixel);
    if (!has_own && !glossy[i] && share_mirrored(i)) points[n++] = static_cast<std::uint16_t>(i);
  }
  for (const std::uint16_t i : std::span(points).first(n)) shares_mirrored_[i] = 1;
  const auto end = std::remove_if(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(n),
                                  [&](std::uint16_t i) { return points_[i].catches_shadow; });
  const auto lit = static_cast<std::size_t>(end - points.begin());
  if (lit > 0 && !frame_->planned_table->lamps.empty()) {
    receive_lamps(std::span(points).first(lit));
  }
}

// Finds who sees which light, and notes it.
void CellBaker::light_mirrored(const CellMask& mirrored) {
  CellTransport& t = *transport_;
  Receivers& r = receivers_;
  clear_receivers();
  r.active = r.by_caustics = mirrored;
  r.mirrored = true;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    r.nx[k] = r.ny[k] = r.nz[k] = 0;
    sets_centres_ = true;
    if (in(mirrored, k)) set_receiver(k, points_[mirrored_at_[k]]);
    sets_centres_ = false;
  }
  count_shadow_rays(
      cell_pixels, [&](std::size_t k) { return k; },
      [&] { gather_cell(shadow_rays_, r, gather_, t.mirrored_visibility, *statistics_); });
  sort_tints(t.mirrored_visibility);
  if (may_shade(t.mirrored_visibility, mirrored)) keep_shadowed(mirrored, t.mirrored_shadowed);
  r.mirrored = false;
  t.mirrored_receiving = mirrored;
  CellTransport::Mirrored& to = t.mirrored.emplace_back();
  to.nx = r.nx, to.ny = r.ny, to.nz = r.nz;
  to.slot.fill(0);
  to.any_shadow = false;
  to.diffuse.r.fill(0), to.diffuse.g.fill(0), to.diffuse.b.fill(0);
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(mirrored, k)) continue;
    const ShadePoint& p = points_[mirrored_at_[k]];
    const Vec3f open = r.light.open(k);
    light_of_point_[mirrored_at_[k]] = {open, r.light.arriving(k), {}};
    to.diffuse.put(k, p.throughput * p.diffuse);
    to.slot[k] = matte_target_of(p);
    if (p.catches_shadow) {
      to.any_shadow = true;
      add_bent(p, p.throughput * p.plate_share, first_mirrored + static_cast<std::uint32_t>(k));
    }
    const float reach_m = reach_of_neighbours * (length(p.steps.a) + length(p.steps.b));
    mirrored_hits_[k] = {p.hit.instance, p.hit.material, reach_m,
                         p.light_normal, p.hit.position, light_of_point_[mirrored_at_[k]]};
  }
}

// A point may get its light from the nearest of what the centres about its pixel mirror, of the
// same surface, where they are all lit alike.
bool CellBaker::share_mirrored(std::size_t point) {
  const CellMask& mirrored = transport_->mirrored_receiving;
  const ShadePoint& p = points_[point];
  if (p.depth == 0 || mirrored == CellMask{} || !may_be_lit_as_centres(p)) return false;
  const int px = static_cast<int>(p.pixel % cell_size), py = static_cast<int>(p.pixel / cell_size);
  std::size_t nearest = cell_pixels;
  float least = 0;
  Vec3f lower, upper;
  for (int y = std::max(py - 1, 0); y <= std::min(py + 1, cell_size - 1); ++y) {
    for (int x = std::max(px - 1, 0); x <= std::min(px + 1, cell_size - 1); ++x) {
      const auto k = static_cast<std::size_t>(y * cell_size + x);
      if (!in(mirrored, k)) continue;
      const MirroredHit& m = mirrored_hits_[k];
      if (m.instance != p.hit.instance || m.material != p.hit.material ||
          !(dot(m.normal, p.light_normal) > alike_normals)) {
        continue;
      }
      const float apart_m = length(p.hit.position - m.position);
      const bool any = nearest < cell_pixels;
      lower = any ? lesser(lower, m.light.arriving) : m.light.arriving;
      upper = any ? greater(upper, m.light.arriving) : m.light.arriving;
      if (any && !(apart_m < least)) continue;
      nearest = k, least = apart_m;
    }
  }
  if (nearest == cell_pixels || !(least < mirrored_hits_[nearest].reach_m)) return false;
  const Vec3f answer = p.catches_shadow ? p.plate_share * grey_plate : planned_diffuse(p);
  if (largest(p.throughput * answer * (upper - lower)) > effort_.glint_contrast) return false;
  light_of_point_[point] = mirrored_hits_[nearest].light;
  if (p.catches_shadow) {
    add_bent(p, p.throughput * p.plate_share, first_mirrored + static_cast<std::uint32_t>(nearest));
    return true;
  }
  transport_->shared.push_back({matte_target_of(p), static_cast<std::uint16_t>(nearest),
                                CellTransport::SharedTerm::Of::mirrored_light,
                                p.throughput * p.diffuse});
  return true;
}

// Lamps' light is each point's own.
void CellBaker::receive_lamps(std::span<const std::uint16_t> points) {
  Receivers& r = receivers_;
  clear_receivers();
  for (std::size_t n = 0; n < points.size(); ++n) {
    set_receiver(n, points_[points[n]]);
    r.active[n / 64] |= std::uint64_t{1} << (n % 64);
  }
  r.count = static_cast<int>(points.size());
  r.by_lamps = r.by_caustics = r.active;
  tested_.clear();
  add_tested(points);
  count_shadow_rays(
      points.size(), [&](std::size_t n) { return points_[points[n]].pixel; },
      [&] { add_point_lamps(points); });
}

}  // namespace render
