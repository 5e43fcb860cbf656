// A cell's transport, tidied: terms by slot, and those that are many times the same as one.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "render/cell_baker.h"

namespace render {
namespace {

std::uint32_t key_of(const CellTransport::LightTerm& l) { return l.slot * 65536U + l.light; }
std::uint32_t key_of(const CellTransport::SharedTerm& s) {
  return (s.slot * 65536U + s.centre) * 4U + static_cast<std::uint32_t>(s.of);
}

// Slots that look at more places than this have faint ones looked up less sharply, each time that
// they are joined.
constexpr std::size_t most_places_of_slot = 256;
// By how much a slot may then change for one of them at a time, under the planned light.
constexpr float least_change = 3e-4F;

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

// Terms in the order of their slots, of which there are few; sort_slot orders those of one.
template <class Term, class F>
void sort_by_slot(const std::vector<Term>& terms, std::vector<Term>& sorted, F&& sort_slot) {
  std::array<std::uint32_t, slots + 1> first{};  // of each slot's terms
  for (const Term& term : terms) ++first[term.slot + 1U];
  std::partial_sum(first.begin(), first.end(), first.begin());
  sorted.resize(terms.size());
  std::array<std::uint32_t, slots + 1> next = first;
  for (const Term& term : terms) sorted[next[term.slot]++] = term;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const std::size_t count = first[slot + 1] - first[slot];
    if (count > 1) sort_slot(std::span(sorted).subspan(first[slot], count));
  }
}

}  // namespace

// Tells what came of the cell's slots, and joins what is many times the same.
void CellBaker::pack() {
  CellTransport& t = *transport_;
  std::copy_n(base_.begin(), cell_pixels, t.base.begin());
  const CellTransport::Base plain{{}, {1, 1, 1}, 1, 1};
  t.empty = t.receiving == CellMask{} && t.mirrored.empty() && places_.empty() &&
            t.lights.empty() && t.bent.empty() && t.video.empty() && lamp_terms_.empty();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    t.empty = t.empty && (base_[k] == plain || !is_inside(k)) && edge_[k] == Edge::none;
    if (edge_[k] == Edge::none) continue;
    t.further.push_back({static_cast<std::uint16_t>(k), counts_[k], base_[cell_pixels + k]});
    for (std::size_t i = 0; i < borrowed_[k].size(); ++i) {
      if (borrowed_[k][i] == 0) continue;
      const int centre = static_cast<int>(k) + (static_cast<int>(i) / 3 - 1) * cell_size +
                         static_cast<int>(i) % 3 - 1;
      t.borrowed.push_back(
          {static_cast<std::uint16_t>(k), static_cast<std::uint16_t>(centre), borrowed_[k][i]});
    }
  }
  pack_lights(t.lights, t.lights);
  pack_lights(lamp_terms_, t.lamp_terms);
  join_places();
  t.environment.pack(places_, frame_->planned_levels);
  std::ranges::sort(t.shared, {}, [](const CellTransport::SharedTerm& s) {
    return key_of(s);
  });  // in place: nothing is allocated
  t.shared.resize(join(t.shared, t.shared));
}

// A cell that samples glass a thousand times a pixel finds millions of terms: they are joined time
// and again. Those of the pixels around it are few, and are dropped by their number.
void CellBaker::add_light(const CellTransport::LightTerm& term) {
  auto& terms = transport_->lights;
  terms.push_back(term);
  if (terms.size() <= most_lights_ || shades_ring_) return;
  pack_lights(terms, terms);
  most_lights_ = 2 * terms.size() + enough_terms;
}

void CellBaker::add_place(const EnvironmentTerm& term) {
  places_.push_back(term);
  if (places_.size() <= most_places_ || shades_ring_) return;
  join_places();
  most_places_ = 2 * places_.size() + enough_terms;
}

// One term for each light of a slot: by slots first, of which there are few.
void CellBaker::pack_lights(const std::vector<CellTransport::LightTerm>& from,
                            std::vector<CellTransport::LightTerm>& to) {
  sort_by_slot(from, sorted_lights_, [](auto of_slot) {
    std::ranges::sort(of_slot, {}, &CellTransport::LightTerm::light);
  });
  const auto kept = static_cast<std::ptrdiff_t>(join(sorted_lights_, sorted_lights_));
  to.assign(sorted_lights_.begin(), sorted_lights_.begin() + kept);
}

// Places of a slot that lie between the same four texels of a level become one, in their middle:
// many rays through glass, or of many samples, look nearly the same way. Between four texels a
// picture is all but linear, so hardly anything is lost.
void CellBaker::join_places() {
  sort_by_slot(places_, sorted_places_, [](auto) {});
  places_.clear();
  for (std::size_t i = 0; i < sorted_places_.size();) {
    keyed_places_.clear();
    const std::uint16_t slot = sorted_places_[i].slot;
    for (; i < sorted_places_.size() && sorted_places_[i].slot == slot; ++i) {
      keyed_places_.push_back({texels_of(sorted_places_[i]), sorted_places_[i]});
    }
    join_places_of_slot();
    if (keyed_places_.size() > most_places_of_slot && halve_faint_places()) {
      join_places_of_slot();
    }
    for (const KeyedPlace& place : keyed_places_) places_.push_back(place.term);
  }
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
      EnvironmentTerm& to = keyed_places_[kept - 1].term;
      const float part = weight / (share + weight);
      to.weight += from.term.weight;
      to.x += (from.term.x - to.x) * part;
      to.y += (from.term.y - to.y) * part;
    } else {
      keyed_places_[kept++] = from;
    }
  }
  keyed_places_.resize(kept);
}

// Where a slot looks at very many places, those that give it least, and show about the same in
// texels twice as wide, are looked up there, so that they can be joined. False if there are none.
bool CellBaker::halve_faint_places() {
  float all = 0;
  for (const KeyedPlace& place : keyed_places_) all += std::abs(mean(place.term.weight));
  const float least = all / static_cast<float>(most_places_of_slot);
  bool halved = false;
  for (KeyedPlace& place : keyed_places_) {
    EnvironmentTerm& e = place.term;
    const std::size_t level = halved_level(*frame_->planned, e.level);
    const float weight = mean(e.weight);  // only those above 0 are joined
    if (level == e.level || !(weight > 0) || weight >= least) continue;
    const capture::Image &fine = *frame_->planned_levels[e.level],
                         &coarse = *frame_->planned_levels[level];
    if (coarse.width * 2 != fine.width || coarse.height * 2 != fine.height) continue;
    const float x = (e.x - 0.5F) / 2, y = (e.y - 0.5F) / 2;
    const Vec3f change = e.weight * (radiance_at(coarse, x, y) - radiance_at(fine, e.x, e.y));
    if (std::max({std::abs(change.x), std::abs(change.y), std::abs(change.z)}) > least_change)
      continue;
    e.level = static_cast<std::uint16_t>(level);
    e.x = x, e.y = y;
    place.texels = texels_of(e);
    halved = true;
  }
  return halved;
}

}  // namespace render
