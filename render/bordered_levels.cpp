// An environment's levels with a border.
#include "render/bordered_levels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "render/environment.h"
#include "render/lanes.h"

namespace render {
namespace {

constexpr int before = 1, behind = 2;  // texels of the border

int halves_a_row(const capture::Image& level) { return 4 * (before + level.width + behind); }

// So that the brightest is from 2^14 to 2^15.
float scale_of(const capture::Image& level) {
  // As bits: what is no number is above all others, and what is negative below.
  std::int32_t most = 0;
  for (const float value : level.pixels) most = std::max(most, std::bit_cast<std::int32_t>(value));
  const float brightest = most > std::bit_cast<std::int32_t>(brightest_radiance)
                              ? brightest_radiance
                              : std::bit_cast<float>(most);
  if (!(brightest > 0)) return 1;
  return std::ldexp(1.0F, std::max(std::ilogb(brightest) - 14, -126));
}

// counted_radiance() of each colour.
Four counted(Four stored) {
  const Four none{}, most = none + brightest_radiance;
  stored = stored > none ? stored : none;
  return stored < most ? stored : most;
}

}  // namespace

void BorderedLevels::begin(std::span<const capture::Image* const> levels) {
  slots_.resize(levels.size());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    auto slot = std::make_unique<Slot>();
    slot->from = levels[i];
    const auto row = static_cast<std::size_t>(halves_a_row(*levels[i]));
    slot->size = row * static_cast<std::size_t>(before + levels[i]->height + behind);
    // What is written anew anyhow is not cleared.
    if (slots_[i] && slots_[i]->size == slot->size) {
      slot->texels = std::move(slots_[i]->texels);
    } else {
      slot->texels.reset(new capture::Half[slot->size]);
    }
    slots_[i] = std::move(slot);
  }
}

BorderedLevels::Level BorderedLevels::at(std::size_t number) const {
  Slot& slot = *slots_[number];
  std::call_once(slot.filled, fill, slot);
  const capture::Image& level = *slot.from;
  return {level.width, level.height, slot.texels.get(), halves_a_row(level), slot.scale};
}

void BorderedLevels::fill(Slot& slot) {
  const capture::Image& level = *slot.from;
  slot.scale = scale_of(level);
  const Four per_radiance = Four{1, 1, 1, 0} * (1 / slot.scale);
  capture::Half* to = slot.texels.get();
  for (int y = -before; y < level.height + behind; ++y) {
    // Beyond a pole lies the row itself, half way around.
    const int row = std::clamp(y, 0, level.height - 1);
    const float* from = &level.pixels[level.index(row, 0)];
    const auto put = [&](Four texel) {
      store_halves(counted(texel) * per_radiance, to);
      to += 4;
    };
    const auto put_one = [&](int column) {
      const float* p = from + 3 * (column % level.width);
      put(Four{p[0], p[1], p[2], 0});
    };
    const int first = row == y ? 0 : level.width / 2;
    put_one(first + level.width - before);
    for (int column = first; column < level.width - 1; ++column) put(load_four(from + 3 * column));
    put_one(level.width - 1);
    for (int column = 0; column < first + behind; ++column) put_one(column);
  }
}

}  // namespace render
