// Terms of a cell's slots, in their order. Private to the kernel.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "render/cell_transport.h"

namespace render {

// Brings terms into the order of their slots, of which there are few, in place, for there may be
// more than a million; those of a slot come in any order.
template <class Term>
void sort_by_slot(std::vector<Term>& terms) {
  if (terms.empty()) return;  // as most lists are where one ray a pixel meets dull things
  constexpr std::size_t all = CellPicture::lit_slots;
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

// A list that is joined whenever it has grown to twice what was left of it, and some.
inline constexpr std::size_t enough_terms = std::size_t{1} << 15;

}  // namespace render
