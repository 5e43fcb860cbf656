// Chroma samples to every pixel.
#include "capture/chroma.h"

#include <stdexcept>

namespace capture {
namespace {

template <int factor>
void widen(const ChromaSteps& steps,
           int samples,
           const std::int32_t* padded,
           std::int32_t* __restrict to) {
  const std::int32_t* a[factor];
  std::int32_t weight[factor];
  for (int phase = 0; phase < factor; ++phase) {
    a[phase] = padded + 1 + steps.before(phase);
    weight[phase] = steps.weight(phase);
  }
  const std::int32_t units = steps.units();
  for (int i = 0; i < samples; ++i) {
    for (int phase = 0; phase < factor; ++phase) {
      to[factor * i + phase] =
          units * a[phase][i] + weight[phase] * (a[phase][i + 1] - a[phase][i]);
    }
  }
}

}  // namespace

ChromaSteps::ChromaSteps(int factor, Siting siting)
    : factor_(factor), units_(factor == 1 ? 1 : 2 * factor) {
  if (factor != 1 && factor != 2 && factor != 4) {
    throw std::invalid_argument("chroma is shared by 1, 2 or 4 samples");
  }
  // The first chroma sample lies at luma coordinate `site` / 2.
  const int site = siting == Siting::first    ? 0
                   : siting == Siting::middle ? factor - 1
                                              : 2 * (factor - 1);
  for (int phase = 0; phase < factor; ++phase) {
    // Of luma sample `phase`, in units of the distance between chroma samples.
    const int distance = factor == 1 ? 0 : 2 * phase - site;
    const int before = distance < 0 ? -1 : 0;
    steps_.push_back({before, distance - before * units_});
  }
}

// Rows do not overlap, here and below.
void blend_chroma(int samples,
                  std::int32_t* __restrict a,
                  int a_weight,
                  const std::int32_t* __restrict b,
                  int b_weight) {
  for (int i = 0; i < samples; ++i) {
    a[i] = a_weight * a[i] + b_weight * b[i];
  }
}

void widen_chroma(const ChromaSteps& steps,
                  int samples,
                  const std::int32_t* padded,
                  std::int32_t* to) {
  switch (steps.factor()) {
    case 1:
      return widen<1>(steps, samples, padded, to);
    case 2:
      return widen<2>(steps, samples, padded, to);
    default:
      return widen<4>(steps, samples, padded, to);
  }
}

}  // namespace capture
