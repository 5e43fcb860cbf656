// Chroma samples to every pixel, in exact integers.
#pragma once

#include <cstdint>
#include <vector>

namespace capture {

// Where chroma samples sit among the luma samples of one direction, first (co-sited with the first
// luma sample), middle, or last of each group.
enum class Siting { first, middle, last };

// Bilinear interpolation along one direction where `factor` (1, 2 or 4) luma samples share a chroma
// sample. Luma sample factor*i + phase lies between chroma samples i + before(phase) and the next,
// at weight(phase) / units() from the former.
class ChromaSteps {
 public:
  ChromaSteps(int factor, Siting siting);
  int factor() const { return factor_; }
  int units() const { return units_; }  // 1 for factor 1, else 2 * factor
  int before(int phase) const { return steps_[static_cast<std::size_t>(phase)].before; }
  int weight(int phase) const { return steps_[static_cast<std::size_t>(phase)].weight; }

 private:
  struct Step {
    int before = 0;
    int weight = 0;
  };
  int factor_;
  int units_;
  std::vector<Step> steps_;
};

// a * a_weight + b * b_weight, sample by sample, into `a`.
void blend_chroma(int samples, std::int32_t* a, int a_weight, const std::int32_t* b, int b_weight);

// A row of chroma, one sample more on either side than `samples`, to luma's width, in units of
// 1 / steps.units(). `padded` holds samples + 2 values; `to` has room for factor * samples.
void widen_chroma(const ChromaSteps& steps,
                  int samples,
                  const std::int32_t* padded,
                  std::int32_t* to);

}  // namespace capture
