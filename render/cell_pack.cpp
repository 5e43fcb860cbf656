// A cell's transport, tidied: terms by slot, and those that are many times the same as one.
#include <algorithm>
#include <span>
#include <vector>

#include "render/cell_baker.h"

namespace render {
namespace {

std::uint32_t key_of(const CellTransport::SharedTerm& s) {
  static_assert(CellPicture::lit_slots <= 1U << 15 && cell_pixels <= 1U << 15);
  return (s.slot * 32768U + s.centre) * 4U + static_cast<std::uint32_t>(s.of);
}

// Those of the same slot, centre and kind become one. In place: nothing is allocated.
void join(std::vector<CellTransport::SharedTerm>& terms) {
  std::ranges::sort(terms, {}, key_of);
  std::size_t kept = 0;
  for (const CellTransport::SharedTerm& term : terms) {
    if (kept > 0 && key_of(terms[kept - 1]) == key_of(term)) {
      terms[kept - 1].weight += term.weight;
    } else {
      terms[kept++] = term;
    }
  }
  terms.resize(kept);
}

}  // namespace

// Tells what came of the cell's slots, and joins what is many times the same.
void CellBaker::pack() {
  CellTransport& t = *transport_;
  pack_bases();
  const CellTransport::Base plain{{}, {1, 1, 1}, 1, 1};
  t.empty = t.receiving == CellMask{} && t.mirrored.empty() && places_.empty() && lights_.empty() &&
            bent_.empty() && t.bent_shaded.empty() && video_.empty() && t.painted.empty() &&
            lamps_.empty() && t.foreground.empty() && t.picture_rays.empty() &&
            t.picture_lights.empty();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    t.empty = t.empty && (base_[k] == plain || !is_inside(k)) && edge_[k] == Edge::none;
    if (edge_[k] == Edge::none) continue;
    t.further.push_back({static_cast<std::uint16_t>(k),
                         static_cast<std::uint16_t>(further_samples_.count(k)),
                         base_[cell_pixels + k]});
    if (grey_of_further_[k] != Vec3f{}) {
      t.shared.push_back({static_cast<std::uint16_t>(cell_pixels + k),
                          static_cast<std::uint16_t>(k), CellTransport::SharedTerm::Of::light,
                          grey_of_further_[k]});
    }
    for (std::size_t i = 0; i < borrowed_[k].size(); ++i) {
      if (borrowed_[k][i] == 0) continue;
      const int centre = static_cast<int>(k) + (static_cast<int>(i) / 3 - 1) * cell_size +
                         static_cast<int>(i) % 3 - 1;
      t.borrowed.push_back(
          {static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(centre), borrowed_[k][i]});
    }
  }
  const auto lights = lights_.join(), lamps = lamps_.join();
  t.lights.assign(lights.begin(), lights.end());
  t.lamp_terms.assign(lamps.begin(), lamps.end());
  pack_places();
  pack_live_places();
  join(t.shared);
  if (none(t.receiving)) t.centres.clear();
}

// Those of slots behind picture rays apart.
void CellBaker::pack_places() {
  CellTransport& t = *transport_;
  constexpr std::size_t step = EnvironmentTerms::slots;
  // A picture of one ray a pixel is hardly kept.
  std::span<PlaceTerm> left =
      effort_.aa_samples > 1 ? places_.join_wider(further_samples_) : places_.join();
  const auto take = [&](std::size_t first, EnvironmentTerms& to) {
    const auto end = std::ranges::lower_bound(left, first + step, {}, &PlaceTerm::slot);
    const auto own = left.first(static_cast<std::size_t>(end - left.begin()));
    for (PlaceTerm& term : own) term.slot = static_cast<std::uint16_t>(term.slot - first);
    to.pack(own, frame_->planned_levels);
    left = left.subspan(own.size());
  };
  static_assert(slots == step);
  take(0, t.environment);
  for (std::size_t first = slots; first < slots + t.picture_rays.size(); first += step) {
    take(first, t.environments_behind.emplace_back());
  }
}

// Places of the plate that one slot sees in the shadow at one point become fewer, as bent_ makes
// them.
void CellBaker::join_shaded_places() {
  std::vector<CellTransport::ShadedPlate>& terms = transport_->bent_shaded;
  const auto key = [](const CellTransport::ShadedPlate& t) {
    return std::uint64_t{t.term.slot} << 32 | t.point;
  };
  std::ranges::sort(terms, {}, key);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < terms.size();) {
    const std::uint64_t same = key(terms[i]);
    const std::uint32_t point = terms[i].point;
    shaded_of_point_.clear();
    for (; i < terms.size() && key(terms[i]) == same; ++i) {
      shaded_of_point_.push_back({texels_of(terms[i].term), terms[i].term});
    }
    if (shaded_of_point_.size() > 1) join_places(shaded_of_point_);
    for (const KeyedPlace& place : shaded_of_point_) terms[kept++] = {place.term, point};
  }
  terms.resize(kept);
}

// Of the plate, and of live textures.
void CellBaker::pack_live_places() {
  CellTransport& t = *transport_;
  const auto bent = bent_.join();
  t.bent.assign(bent.begin(), bent.end());
  join_shaded_places();
  const auto videos = video_.join();
  t.video.assign(videos.begin(), videos.end());
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    for (const PaintedSlot& slot : std::span(painted_of_pixel_[k]).first(painted_count_[k])) {
      painted_weights_[slot.number] = slot.weight;
    }
  }
  for (const PlaceTerm& place : paint_.join()) {
    const std::size_t i = place.slot;
    if (t.painted[i].count++ == 0) t.painted[i].first = static_cast<std::uint32_t>(t.paint.size());
    t.paint.push_back({place.weight.x / painted_weights_[i], place.x, place.y, place.level});
  }
}

void CellBaker::pack_bases() {
  CellTransport& t = *transport_;
  const auto behind = base_.begin() + slots;
  t.bases_behind.assign(behind, behind + static_cast<std::ptrdiff_t>(t.picture_rays.size()));
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    // Likely the latest, or one of the first.
    const std::size_t latest = t.bases.size() - 1;
    std::size_t i = 0;
    if (!t.bases.empty() && t.bases[latest] == base_[k]) {
      i = latest;
    } else {
      while (i < t.bases.size() && !(t.bases[i] == base_[k])) ++i;
      if (i == t.bases.size()) t.bases.push_back(base_[k]);
    }
    t.base_of[k] = static_cast<std::uint8_t>(i);
  }
}

std::size_t CellBaker::scratch_bytes() const {
  return places_.bytes() + lights_.bytes() + lamps_.bytes() + bent_.bytes() + video_.bytes() +
         paint_.bytes();
}

}  // namespace render
