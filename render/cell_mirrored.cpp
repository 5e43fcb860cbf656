// The light of what centres mirror, or see through something clear.
#include <algorithm>

#include "render/cell_baker.h"

namespace render {

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

// Which pixels' centres mirror what may get its light as centres do: those of 4x4 pixels that see
// one smooth surface there, which mirrors no light itself, nor catches shadows.
CellMask CellBaker::find_mirrored(int count, std::span<const std::uint8_t> glossy) {
  mirrored_at_.fill(nowhere);
  CellMask found{};
  bool any = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const ShadePoint& p = points_[i];
    const bool dull = p.diffuse != Vec3f{} && !glossy[i] && !p.catches_shadow && !p.catches_lamps;
    if (!is_first_[i] || !dull) continue;
    mirrored_at_[p.pixel] = static_cast<std::uint16_t>(i);
    any = true;
  }
  for (std::size_t block = 0; any && block < 16; ++block) {
    const std::size_t first = block / 4 * 4 * cell_size + block % 4 * 4;
    if (mirrors_smoothly(first)) found[first / 64] |= block4 << (first % 64);
  }
  return found;
}

bool CellBaker::mirrors_smoothly(std::size_t first) const {
  constexpr float apart = 8;  // how far pixels of a block are, at most, by their cones
  if (mirrored_at_[first] == nowhere) return false;
  const ShadePoint& a = points_[mirrored_at_[first]];
  const float wide_m = apart * (length(a.steps.a) + length(a.steps.b));
  for (std::size_t i = 1; i < 16; ++i) {
    const std::size_t k = first + i / 4 * cell_size + i % 4;
    if (mirrored_at_[k] == nowhere) return false;
    const ShadePoint& b = points_[mirrored_at_[k]];
    if (a.hit.instance != b.hit.instance || a.hit.material != b.hit.material ||
        !(dot(a.light_normal, b.light_normal) > alike_normals) ||
        !(length(b.hit.position - a.hit.position) < wide_m)) {
      return false;
    }
  }
  return true;
}

// Finds who of them sees which light, and notes it.
void CellBaker::receive_mirrored(const CellMask& mirrored) {
  CellTransport& t = *transport_;
  Receivers& r = receivers_;
  clear_receivers();
  r.active = r.by_caustics = mirrored;
  r.mirrored = true;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    r.nx[k] = r.ny[k] = r.nz[k] = 0;
    if (in(mirrored, k)) set_receiver(k, points_[mirrored_at_[k]]);
  }
  count_shadow_rays(
      cell_pixels, [&](std::size_t k) { return k; },
      [&] { gather_cell(shadow_rays_, r, gather_, t.mirrored_visibility, *statistics_); });
  r.mirrored = false;
  t.mirrored_receiving = mirrored;
  CellTransport::Mirrored& to = t.mirrored.emplace_back();
  to.nx = r.nx, to.ny = r.ny, to.nz = r.nz;
  to.diffuse = {};
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(mirrored, k)) continue;
    const ShadePoint& p = points_[mirrored_at_[k]];
    const Vec3f open = r.light.open(k);
    light_of_point_[mirrored_at_[k]] = {open, open - r.light.lost(k), {}};
    to.diffuse[k] = p.throughput * p.diffuse;
  }
  if (!frame_->planned_table->lamps.empty()) receive_mirrored_lamps(mirrored);
}

// Lamps' light is found point by point.
void CellBaker::receive_mirrored_lamps(const CellMask& mirrored) {
  Receivers& r = receivers_;
  std::array<std::uint16_t, stream_rays> point_at;
  clear_receivers();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(mirrored, k)) continue;
    const auto n = static_cast<std::size_t>(r.count++);
    point_at[n] = mirrored_at_[k];
    set_receiver(n, points_[mirrored_at_[k]]);
    r.active[n / 64] |= std::uint64_t{1} << (n % 64);
  }
  r.by_lamps = r.by_caustics = r.active;
  const auto points = std::span(point_at).first(static_cast<std::size_t>(r.count));
  tested_.clear();
  add_tested(points);
  count_shadow_rays(
      points.size(), [&](std::size_t n) { return points_[points[n]].pixel; },
      [&] { add_point_lamps(points); });
}

}  // namespace render
