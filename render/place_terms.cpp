// Places, joined by the texels that they lie between.
#include "render/place_terms.h"

#include <algorithm>
#include <cmath>

namespace render {

using calibrate::Vec3f;

std::uint64_t texels_of(const PlaceTerm& term) {
  // Texels are fewer than 2^15 a side; left of and above the first ones there is one more.
  const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(term.x)) + 1);
  const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(term.y)) + 1);
  return std::uint64_t{term.level} << 40 | row << 20 | column;
}

void join_into(PlaceTerm& to, const PlaceTerm& from) {
  const float share = mean(to.weight), weight = mean(from.weight), part = weight / (share + weight);
  to.weight += from.weight;
  to.x += (from.x - to.x) * part;
  to.y += (from.y - to.y) * part;
}

void join_places(std::vector<KeyedPlace>& of_slot) {
  std::ranges::sort(of_slot, [](const KeyedPlace& a, const KeyedPlace& b) {
    return a.texels != b.texels   ? a.texels < b.texels
           : a.term.x != b.term.x ? a.term.x < b.term.x
                                  : a.term.y < b.term.y;
  });
  std::size_t kept = 0;
  for (const KeyedPlace& from : of_slot) {
    const float weight = mean(from.term.weight);
    const float share = kept > 0 ? mean(of_slot[kept - 1].term.weight) : 0;
    if (weight > 0 && share > 0 && of_slot[kept - 1].texels == from.texels) {
      join_into(of_slot[kept - 1].term, from.term);
    } else {
      of_slot[kept++] = from;
    }
  }
  of_slot.resize(kept);
}

void PlaceTerms::clear() {
  aside_ = false;  // a cell may have been given up meanwhile
  terms_.clear();
  most_ = enough_terms;
}

void PlaceTerms::add(const PlaceTerm& place) {
  if (!is_finite(place.weight)) return;
  terms_.push_back(place);
  if (terms_.size() <= most_ || aside_) return;
  join();
  most_ = 2 * terms_.size() + enough_terms;
}

std::span<const PlaceTerm> PlaceTerms::join() {
  change_slots(terms_, of_slot_, [&](std::uint16_t) { join_places(of_slot_); });
  return terms_;
}

}  // namespace render
