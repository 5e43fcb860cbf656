// What a cell's slots take of the table's lights, or of lamps, collected while the cell is found.
// Private to the kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/cell_transport.h"
#include "render/slot_order.h"

namespace render {

// A cell that samples glass a thousand times a pixel finds millions of terms: they are joined time
// and again. Once its memory has grown, nothing is allocated.
class LightTerms {
 public:
  using Term = CellTransport::LightTerm;

  void clear();
  void add(const Term& term);
  // Terms that are added in between are few, and are forgotten.
  void begin_aside() { before_ = terms_.size(), aside_ = true; }
  void end_aside() { terms_.resize(before_), aside_ = false; }
  bool empty() const { return terms_.empty(); }
  // One for each light of a slot, in their order.
  std::span<const Term> join();
  std::size_t bytes() const { return terms_.capacity() * sizeof(Term); }

 private:
  std::vector<Term> terms_;
  std::size_t most_ = enough_terms;  // more are joined
  std::size_t before_ = 0;
  bool aside_ = false;
  std::vector<calibrate::Vec3f> sum_of_light_;  // of a slot, by light; zero between slots
  std::vector<std::uint64_t> has_sum_;          // bits, by light
};

}  // namespace render
