// Places in live textures and in the environment that a cell's slots look at, joined where they are
// many times nearly the same. Private to the kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/place_term.h"
#include "render/slot_order.h"

namespace render {

// Of one slot, with a number for the four texels that it lies between.
struct KeyedPlace {
  std::uint64_t texels;
  PlaceTerm term;
};
std::uint64_t texels_of(const PlaceTerm& term);

// One place in the middle of two that lie between the same texels, both of some weight. Between
// four texels a picture is all but linear, so hardly anything is lost.
void join_into(PlaceTerm& to, const PlaceTerm& from);

// Those that lie between the same texels become one, but for what takes light away; all in the
// order of their texels.
void join_places(std::vector<KeyedPlace>& of_slot);

// Brings terms into the order of their slots, and gives `change` those of each slot in turn, to be
// made others, not more.
template <class F>
void change_slots(std::vector<PlaceTerm>& terms, std::vector<KeyedPlace>& of_slot, F&& change) {
  sort_by_slot(terms);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < terms.size();) {
    of_slot.clear();
    const std::uint16_t slot = terms[i].slot;
    for (; i < terms.size() && terms[i].slot == slot; ++i) {
      of_slot.push_back({texels_of(terms[i]), terms[i]});
    }
    change(slot);
    for (const KeyedPlace& place : of_slot) terms[kept++] = place.term;
  }
  terms.resize(kept);
}

// Those of live textures, collected while a cell is found. Many rays through glass, or of many
// samples, look nearly the same way: so they are joined time and again. Once its memory has grown,
// nothing is allocated.
class PlaceTerms {
 public:
  void clear();
  // One whose weight is not finite is left out.
  void add(const PlaceTerm& place);
  // Places that are added in between are few, and are forgotten.
  void begin_aside() { before_ = terms_.size(), aside_ = true; }
  void end_aside() { terms_.resize(before_), aside_ = false; }
  bool empty() const { return terms_.empty(); }
  // All of them, in the order of their slots.
  std::span<const PlaceTerm> join();
  std::size_t bytes() const { return terms_.capacity() * sizeof(PlaceTerm); }

 private:
  std::vector<PlaceTerm> terms_;
  std::size_t most_ = 0;  // more are joined
  std::size_t before_ = 0;
  bool aside_ = false;
  std::vector<KeyedPlace> of_slot_;
};

}  // namespace render
