// A cell's transport, tidied: terms by slot, and those that are many times the same as one.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <span>

#include "render/cell_baker.h"

namespace render {
namespace {

std::uint32_t key_of(const CellTransport::SharedTerm& s) {
  static_assert(CellPicture::all_slots <= 1U << 14);
  return (s.slot * 65536U + s.centre) * 4U + static_cast<std::uint32_t>(s.of);
}

// Slots that look at more places than this have faint ones looked up less sharply, each time that
// they are joined.
constexpr std::size_t most_places_of_slot = 256;
// By how much a slot may then change for one of them at a time, under the planned light.
constexpr float least_change = 3e-4F;
// And by how much for all of them that join wider ones at the end, each sample of it.
constexpr float most_change = 1e-3F;

// A number for the four texels that a term's place lies between.
std::uint64_t texels_of(const EnvironmentTerm& e) {
  // Texels are fewer than 2^15 a side; left of and above the first ones there is one more.
  const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(e.x)) + 1);
  const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(e.y)) + 1);
  return std::uint64_t{e.level} << 40 | row << 20 | column;
}

// Joins neighbouring terms of the same key, from one vector to another or within one. Returns how
// many are left.
template <class Term>
std::size_t join(const std::vector<Term>& from, std::vector<Term>& to) {
  std::size_t kept = 0;
  for (const Term& term : from) {
    if (kept > 0 && key_of(to[kept - 1]) == key_of(term)) {
      to[kept - 1].weight += term.weight;
    } else {
      to[kept++] = term;
    }
  }
  return kept;
}

// One place in the middle of two that lie between the same texels, both of some weight.
void join_into(EnvironmentTerm& to, const EnvironmentTerm& from) {
  const float share = mean(to.weight), weight = mean(from.weight), part = weight / (share + weight);
  to.weight += from.weight;
  to.x += (from.x - to.x) * part;
  to.y += (from.y - to.y) * part;
}

// Brings terms into the order of their slots, of which there are few, in place, for there may be
// more than a million; those of a slot come in any order.
template <class Term>
void sort_by_slot(std::vector<Term>& terms) {
  if (terms.empty()) return;  // as most lists are where one ray a pixel meets dull things
  constexpr std::size_t all = CellPicture::all_slots;
  const std::size_t count = std::size_t{std::ranges::max(terms, {}, &Term::slot).slot} + 1;
  std::array<std::uint32_t, all + 1> first;
  std::fill_n(first.begin(), count + 1, 0U);
  for (const Term& term : terms) ++first[term.slot + 1U];
  const auto end = first.begin() + static_cast<std::ptrdiff_t>(count) + 1;
  std::partial_sum(first.begin(), end, first.begin());
  std::array<std::uint32_t, all> next;
  std::copy_n(first.begin(), count, next.begin());
  for (std::size_t slot = 0; slot < count; ++slot) {
    for (; next[slot] < first[slot + 1]; ++next[slot]) {
      Term& here = terms[next[slot]];
      while (here.slot != slot) std::swap(here, terms[next[here.slot]++]);
    }
  }
}

}  // namespace

// Tells what came of the cell's slots, and joins what is many times the same.
void CellBaker::pack() {
  CellTransport& t = *transport_;
  pack_bases();
  const CellTransport::Base plain{{}, {1, 1, 1}, 1, 1};
  t.empty = t.receiving == CellMask{} && t.mirrored.empty() && places_.empty() &&
            t.lights.empty() && t.bent.empty() && t.video.empty() && lamp_terms_.empty() &&
            t.foreground.empty() && t.picture_rays.empty() && t.picture_lights.empty();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    t.empty = t.empty && (base_[k] == plain || !is_inside(k)) && edge_[k] == Edge::none;
    if (edge_[k] == Edge::none) continue;
    t.further.push_back({static_cast<std::uint16_t>(k), counts_[k], base_[cell_pixels + k]});
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
  pack_lights(t.lights);
  pack_lights(lamp_terms_);
  t.lamp_terms = lamp_terms_;
  join_places(effort_.aa_samples > 1);  // a picture of one ray a pixel is hardly kept
  pack_places();
  std::ranges::sort(t.shared, {}, [](const CellTransport::SharedTerm& s) {
    return key_of(s);
  });  // in place: nothing is allocated
  t.shared.resize(join(t.shared, t.shared));
  if (none(t.receiving)) t.centres.clear();
}

// Those of slots behind picture rays apart.
void CellBaker::pack_places() {
  CellTransport& t = *transport_;
  constexpr std::size_t step = EnvironmentTerms::slots;
  std::span<EnvironmentTerm> left(places_);
  const auto take = [&](std::size_t first, EnvironmentTerms& to) {
    const auto end = std::ranges::lower_bound(left, first + step, {}, &EnvironmentTerm::slot);
    const auto own = left.first(static_cast<std::size_t>(end - left.begin()));
    for (EnvironmentTerm& term : own) term.slot = static_cast<std::uint16_t>(term.slot - first);
    to.pack(own, frame_->planned_levels);
    left = left.subspan(own.size());
  };
  static_assert(slots == step);
  take(0, t.environment);
  for (std::size_t first = slots; first < slots + t.picture_rays.size(); first += step) {
    take(first, t.environments_behind.emplace_back());
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
  const auto bytes = [](const auto& list) { return list.capacity() * sizeof list[0]; };
  return longest_places_ * sizeof places_[0] + bytes(keyed_places_) + bytes(lamp_terms_);
}

// A cell that samples glass a thousand times a pixel finds millions of terms: they are joined time
// and again. Those of the pixels around it are few, and are dropped by their number.
void CellBaker::add_light(const CellTransport::LightTerm& term) {
  auto& terms = transport_->lights;
  terms.push_back(term);
  if (terms.size() <= most_lights_ || shades_ring_) return;
  pack_lights(terms);
  most_lights_ = 2 * terms.size() + enough_terms;
}

void CellBaker::add_place(const EnvironmentTerm& term) {
  if (!is_finite(term.weight)) return;  // nothing could be joined with it
  places_.push_back(term);
  if (places_.size() <= most_places_ || shades_ring_) return;
  join_places(false);
  most_places_ = places_.size() + std::min(places_.size(), 8 * enough_terms) + enough_terms;
  longest_places_ = std::max(longest_places_, most_places_);
}

// One term for each light of a slot, in order: by slots first, of which there are few, then added
// up by light.
void CellBaker::pack_lights(std::vector<CellTransport::LightTerm>& terms) {
  sort_by_slot(terms);
  constexpr std::size_t word = 64;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < terms.size();) {
    const std::uint16_t slot = terms[i].slot;
    for (; i < terms.size() && terms[i].slot == slot; ++i) {
      const std::size_t light = terms[i].light;
      if (light >= sum_of_light_.size()) {
        has_sum_.resize(light / word + 1);
        sum_of_light_.resize(has_sum_.size() * word);
      }
      sum_of_light_[light] += terms[i].weight;
      has_sum_[light / word] |= std::uint64_t{1} << (light % word);
    }
    for (std::size_t first = 0; first < sum_of_light_.size(); first += word) {
      std::uint64_t& bits = has_sum_[first / word];
      for (; bits != 0; bits &= bits - 1) {
        const std::size_t light = first + static_cast<std::size_t>(std::countr_zero(bits));
        terms[kept++] = {slot, static_cast<std::uint16_t>(light), sum_of_light_[light]};
        sum_of_light_[light] = {};
      }
    }
  }
  terms.resize(kept);
}

// Places of a slot that lie between the same four texels of a level become one, in their middle:
// many rays through glass, or of many samples, look nearly the same way. Between four texels a
// picture is all but linear, so hardly anything is lost.
void CellBaker::join_places(bool joins_wider) {
  sort_by_slot(places_);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < places_.size();) {
    keyed_places_.clear();
    const std::uint16_t slot = places_[i].slot;
    for (; i < places_.size() && places_[i].slot == slot; ++i) {
      keyed_places_.push_back({texels_of(places_[i]), places_[i]});
    }
    join_places_of_slot();
    if (keyed_places_.size() > most_places_of_slot && halve_faint_places()) {
      join_places_of_slot();
    }
    if (joins_wider) join_wider_places();
    for (const KeyedPlace& place : keyed_places_) places_[kept++] = place.term;
  }
  places_.resize(kept);
}

void CellBaker::join_places_of_slot() {
  std::ranges::sort(keyed_places_, [](const KeyedPlace& a, const KeyedPlace& b) {
    return a.texels != b.texels   ? a.texels < b.texels
           : a.term.x != b.term.x ? a.term.x < b.term.x
                                  : a.term.y < b.term.y;
  });
  std::size_t kept = 0;
  for (const KeyedPlace& from : keyed_places_) {
    const float weight = mean(from.term.weight);
    const float share = kept > 0 ? mean(keyed_places_[kept - 1].term.weight) : 0;
    if (weight > 0 && share > 0 && keyed_places_[kept - 1].texels == from.texels) {
      join_into(keyed_places_[kept - 1].term, from.term);
    } else {
      keyed_places_[kept++] = from;
    }
  }
  keyed_places_.resize(kept);
}

// The same place in texels twice as wide, if there are any. Only those of some weight are joined.
std::optional<EnvironmentTerm> CellBaker::wider(const EnvironmentTerm& e) const {
  const std::size_t level = halved_level(*frame_->planned, e.level);
  if (level == e.level || !(mean(e.weight) > 0)) return {};
  const capture::Image &fine = *frame_->planned_levels[e.level],
                       &coarse = *frame_->planned_levels[level];
  if (coarse.width * 2 != fine.width || coarse.height * 2 != fine.height) return {};
  return EnvironmentTerm{e.weight, (e.x - 0.5F) / 2, (e.y - 0.5F) / 2, e.slot,
                         static_cast<std::uint16_t>(level)};
}

// By how much its slot changes under the planned light.
float CellBaker::change(const EnvironmentTerm& from, const EnvironmentTerm& to) const {
  const auto& levels = frame_->planned_levels;
  const Vec3f by = from.weight * (radiance_at(*levels[to.level], to.x, to.y) -
                                  radiance_at(*levels[from.level], from.x, from.y));
  return std::max({std::abs(by.x), std::abs(by.y), std::abs(by.z)});
}

// Where two places of the same texels were not joined, one takes away what the other gives (rays
// cut by chance): they stay together.
bool CellBaker::is_alone(std::vector<KeyedPlace>::const_iterator place) const {
  const bool first = place == keyed_places_.begin() || std::prev(place)->texels != place->texels;
  const auto next = std::next(place);
  return first && (next == keyed_places_.end() || next->texels != place->texels);
}

// Where a slot looks at very many places, those that give it least, and show about the same in
// texels twice as wide, are looked up there, so that they can be joined. False if there are none.
bool CellBaker::halve_faint_places() {
  float all = 0;
  for (const KeyedPlace& place : keyed_places_) all += std::abs(mean(place.term.weight));
  const float least = all / static_cast<float>(most_places_of_slot);
  bool halved = false;
  for (auto place = keyed_places_.begin(); place != keyed_places_.end(); ++place) {
    if (mean(place->term.weight) >= least || !is_alone(place)) continue;
    const auto to = wider(place->term);
    if (!to || change(place->term, *to) > least_change) continue;
    *place = {texels_of(*to), *to};
    halved = true;
  }
  return halved;
}

// A cone looks at the two levels that it lies between, and lobes at cones beside and within each
// other: places join those that they would be in texels twice as wide, where next to nothing
// changes.
void CellBaker::join_wider_places() {
  const std::uint16_t slot = keyed_places_.front().term.slot;
  const bool of_centre = slot < cell_pixels || slot >= slots;
  const auto samples = of_centre ? 1.0F : static_cast<float>(counts_[slot - cell_pixels]);
  float left = most_change * samples;
  // They are in order of levels, and wider ones have higher numbers.
  for (auto place = keyed_places_.begin(); place != keyed_places_.end(); ++place) {
    const auto to = is_alone(place) ? wider(place->term) : std::nullopt;
    if (!to) continue;
    const auto other = std::ranges::lower_bound(place, keyed_places_.end(), texels_of(*to), {},
                                                &KeyedPlace::texels);
    if (other == keyed_places_.end() || other->texels != texels_of(*to) || !is_alone(other) ||
        !(mean(other->term.weight) > 0))
      continue;
    const float by = change(place->term, *to);
    if (by > std::min(least_change * samples, left)) continue;
    left -= by;
    join_into(other->term, *to);
    place->term.weight = {};
  }
  std::erase_if(keyed_places_,
                [](const KeyedPlace& place) { return place.term.weight == Vec3f{}; });
}

}  // namespace render
