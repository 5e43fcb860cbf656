// Terms of lights, added up by slot and light.
#include "render/light_terms.h"

#include <bit>

namespace render {

void LightTerms::clear() {
  aside_ = false;  // a cell may have been given up meanwhile
  terms_.clear();
  most_ = enough_terms;
}

void LightTerms::add(const Term& term) {
  terms_.push_back(term);
  if (terms_.size() <= most_ || aside_) return;
  join();
  most_ = 2 * terms_.size() + enough_terms;
}

std::span<const LightTerms::Term> LightTerms::join() {
  sort_by_slot(terms_);
  constexpr std::size_t word = 64;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < terms_.size();) {
    const std::uint16_t slot = terms_[i].slot;
    for (; i < terms_.size() && terms_[i].slot == slot; ++i) {
      const std::size_t light = terms_[i].light;
      if (light >= sum_of_light_.size()) {
        has_sum_.resize(light / word + 1);
        sum_of_light_.resize(has_sum_.size() * word);
      }
      sum_of_light_[light] += terms_[i].weight;
      has_sum_[light / word] |= std::uint64_t{1} << (light % word);
    }
    for (std::size_t first = 0; first < sum_of_light_.size(); first += word) {
      std::uint64_t& bits = has_sum_[first / word];
      for (; bits != 0; bits &= bits - 1) {
        const std::size_t light = first + static_cast<std::size_t>(std::countr_zero(bits));
        terms_[kept++] = {slot, static_cast<std::uint16_t>(light), sum_of_light_[light]};
        sum_of_light_[light] = {};
      }
    }
  }
  terms_.resize(kept);
  return terms_;
}

}  // namespace render
