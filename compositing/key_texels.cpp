// Texels, eight at a time.
#include "compositing/key_texels.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "compositing/background_subtraction.h"

namespace compositing {
namespace {

// Eights that go through each step together: one after the other, each would wait for results of
// its own.
constexpr std::size_t together = 8;

I8 within(I8 v, int last) {
  v = v > 0 ? v : I8{};
  return v < last ? v : I8{} + last;
}

// The nearest cell of each texel, its values apart.
std::array<F8, 4> cells_of(const LitPlate& plate, I8 y, I8 x) {
  const int shift = plate.step == 4 ? 2 : 0;
  const I8 row = within(y, plate.height - 1) >> shift, column = within(x, plate.width - 1) >> shift;
  alignas(32) std::array<std::int32_t, key_lanes> at;
  const I8 all = row * plate.columns + column;
  std::memcpy(at.data(), &all, sizeof all);
  const auto cell = [&](std::size_t i) {
    return load_four(plate.cells.data() + 4 * static_cast<std::size_t>(at[i]));
  };
  const auto pair = [&](std::size_t i) {
    return __builtin_shufflevector(cell(i), cell(i + 4), 0, 1, 2, 3, 4, 5, 6, 7);
  };
  const F8 a = pair(0), b = pair(1), c = pair(2), d = pair(3);
  const F8 ab_low = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  const F8 ab_high = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const F8 cd_low = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
  const F8 cd_high = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  return {__builtin_shufflevector(ab_low, cd_low, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(ab_low, cd_low, 2, 3, 10, 11, 6, 7, 14, 15),
          __builtin_shufflevector(ab_high, cd_high, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(ab_high, cd_high, 2, 3, 10, 11, 6, 7, 14, 15)};
}

struct Eight {
  std::array<F8, 3> light, plate;  // in the keyer's order
  F8 last;                         // the last value of the plate's cell
  TexelShare<F8> share;
  TexelMatte<F8> matte;
};

template <bool two_primaries, bool by_difference>
void key_some(const LitPlate& plate,
              const KeyDials& dials,
              std::span<const TexelLanes> texels,
              std::array<F8, 4>* keyed) {
  std::array<Eight, together> all;
  const std::span<Eight> eights = std::span(all).first(texels.size());
  const auto order = channels_of(plate.colour);
  for (std::size_t i = 0; i < eights.size(); ++i) {
    Eight& eight = eights[i];
    for (std::size_t c = 0; c < 3; ++c) {
      const F8 light = texels[i].light[static_cast<std::size_t>(order[c])];
      eight.light[c] = (light > 0.0F) & (light < 1e9F) ? light : F8{};
    }
    const auto cells = cells_of(plate, texels[i].y, texels[i].x);
    eight.plate = {cells[0], cells[1], cells[2]};
    eight.last = cells[3];
  }
  if constexpr (by_difference) {
    for (Eight& e : eights) e.matte = difference_matte(e.light, e.plate, e.last, dials);
  } else {
    for (Eight& e : eights) e.share = share_of<two_primaries>(e.light, e.plate, e.last, dials);
    for (Eight& e : eights) e.matte = matte_of(e.share, e.last, dials);
  }
  const float despill = by_difference ? 0.0F : dials.despill;
  for (const Eight& e : eights) {
    const auto texel =
        foreground_of < two_primaries || by_difference > (e.light, e.plate, e.matte, despill);
    std::array<F8, 4>& to = *keyed++;
    to[static_cast<std::size_t>(order[0])] = texel.first;
    to[static_cast<std::size_t>(order[1])] = texel.second;
    to[static_cast<std::size_t>(order[2])] = texel.third;
    to[3] = texel.alpha;
  }
}

}  // namespace

void key_texels(const LitPlate& plate,
                const KeyDials& dials,
                std::span<const TexelLanes> texels,
                std::array<F8, 4>* keyed) {
  const auto key = plate.use == PlateUse::difference ? key_some<true, true>
                   : has_two_primaries(plate.colour) ? key_some<true, false>
                                                     : key_some<false, false>;
  while (!texels.empty()) {
    const std::size_t count = std::min(texels.size(), together);
    key(plate, dials, texels.first(count), keyed);
    texels = texels.subspan(count), keyed += count;
  }
}

}  // namespace compositing
