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
// picture is all but linear, so hardly anything is lost. Done at the end of a cell, and before that
// when it has very many.
void CellBaker::join_places() {
  const auto key = [](const EnvironmentTerm& e) {
    // Texels are fewer than 2^15 a side; left of and above the first ones there is one more.
    const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(e.x)) + 1);
    const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(e.y)) + 1);
    return std::uint64_t{e.slot} << 48 | std::uint64_t{e.level} << 40 | row << 20 | column;
  };
  sort_by_slot(places_, sorted_places_, [&](auto of_slot) {
    keyed_places_.clear();
    for (const EnvironmentTerm& e : of_slot) keyed_places_.push_back({key(e), e});
    std::ranges::sort(keyed_places_, [](const KeyedPlace& a, const KeyedPlace& b) {
      return a.texels != b.texels   ? a.texels < b.texels
             : a.term.x != b.term.x ? a.term.x < b.term.x
                                    : a.term.y < b.term.y;
    });
    std::ranges::transform(keyed_places_, of_slot.begin(), &KeyedPlace::term);
  });
  std::size_t kept = 0;
  for (const EnvironmentTerm& e : sorted_places_) {
    const float weight = mean(e.weight), share = kept > 0 ? mean(places_[kept - 1].weight) : 0;
    if (weight > 0 && share > 0 && key(places_[kept - 1]) == key(e)) {
      EnvironmentTerm& to = places_[kept - 1];
      const float part = weight / (share + weight);
      to.weight += e.weight;
      to.x += (e.x - to.x) * part;
      to.y += (e.y - to.y) * part;
    } else {
      places_[kept++] = e;
    }
  }
  places_.resize(kept);
}

}  // namespace render
