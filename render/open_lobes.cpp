// What rough lobes see of the sky: by the lights of the table, where one ray would not do.
#include "render/open_lobes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "render/lanes.h"
#include "render/light_gather.h"
#include "render/standard.h"

namespace render {

void OpenLobes::note(std::size_t pixel, const RoughLobe& lobe) {
  if (in(rough_, pixel) && lobes_[pixel].roughness >= lobe.roughness) return;
  rough_[pixel / 64] |= std::uint64_t{1} << (pixel % 64);
  lobes_[pixel] = lobe;
}

// What glass takes of the lights, by blocks.
void OpenLobes::sum_tints(const CellVisibility& visibility) {
  tinted_.clear();
  if (visibility.tints.empty()) return;
  tinted_.resize(visibility.lit.size() * in_row * in_row);
  for (const TintedLight& tint : visibility.tints) {
    tinted_[tint.light * in_row * in_row + block_of(tint.centre)] += mean(tint.lost_share);
  }
}

// The share of the light in a lobe that those pixels of a word of the cell's see.
OpenLobe OpenLobes::seen_by(const RoughLobe& lobe,
                            std::size_t word,
                            std::uint64_t members,
                            const CellVisibility& visibility,
                            const CellMask& receiving,
                            const LightRows& lights) const {
  const SeenLobe seen_lobe(lobe.normal, lobe.geometric_normal, lobe.view);
  const auto count = [](std::uint64_t pixels) { return static_cast<float>(std::popcount(pixels)); };
  const std::size_t block =
      block_of(word * 64 + static_cast<std::size_t>(std::countr_zero(members)));
  const std::uint64_t of_block = receiving[word] & block4 << block % in_row * side;
  Eight all{}, open{}, squares{};
  for (std::size_t row = 0; row < lights.wide; row += 8) {
    Eight lit{}, seen{};
    for (std::size_t i = 0; i < std::min<std::size_t>(8, lights.wide - row); ++i) {
      const std::size_t number = lights.number[row + i];
      lit[i] = count(visibility.lit[number][word] & members);
      seen[i] = count(visibility.seen[number][word] & members);
      if (tinted_.empty()) continue;
      const float taken = tinted_[number * in_row * in_row + block];
      seen[i] = std::max(seen[i] - taken * count(members) / count(of_block), 0.0F);
    }
    const calibrate::Vec3T<Eight> to{load_eight(&lights.x[row]), load_eight(&lights.y[row]),
                                     load_eight(&lights.z[row])};
    const Eight light = load_eight(&lights.sum[row]) *
                        seen_lobe.blurred(lobe.roughness, load_eight(&lights.spread[row]), to);
    all += light * lit, open += light * seen, squares += light * lit * (light * lit);
  }
  const auto sum = [](const Eight& v) {
    return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
  };
  const float total = sum(all), of_squares = sum(squares);
  if (!(total > 0) || !(of_squares > 0)) return {};
  return {std::min(sum(open) / total, 1.0F), total * total / of_squares};
}

// Between the middles of four blocks, or as the outermost ones.
OpenLobe OpenLobes::between(std::span<const Block, in_row * in_row> blocks,
                            std::size_t pixel,
                            std::uint32_t surface) const {
  const auto place = [](std::size_t along) {
    const float at = (static_cast<float>(along) - (side - 1) / 2.0F) / side;
    return std::clamp(at, 0.0F, in_row - 1.0F);
  };
  const float x = place(pixel % cell_size), y = place(pixel / cell_size);
  const auto left = static_cast<std::size_t>(x), top = static_cast<std::size_t>(y);
  OpenLobe sum{0, 0};
  float weights = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t column = left + i % 2, row = top + i / 2;
    const float weight = (1 - std::abs(x - static_cast<float>(column))) *
                         (1 - std::abs(y - static_cast<float>(row)));
    if (!(weight > 0)) continue;
    const Block& block = blocks[row * in_row + column];
    for (const OfSurface& of : std::span(block.surfaces).first(block.count)) {
      if (of.surface != surface || !(of.lobe.lights > 0)) continue;
      sum.share += weight * of.lobe.share, sum.lights += weight * of.lobe.lights;
      weights += weight;
    }
  }
  if (!(weights > 0)) return {};
  return {sum.share / weights, sum.lights / weights};
}

void OpenLobes::find(const CellVisibility& visibility,
                     const CellMask& receiving,
                     const LightRows& lights,
                     std::span<const std::uint32_t, cell_pixels> surfaces) {
  if (none(rough_)) return;
  sum_tints(visibility);
  std::array<Block, in_row * in_row> blocks;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::size_t word = b / in_row, column = b % in_row * side;
    std::uint64_t left = rough_[word] & block4 << column;
    while (left != 0) {
      std::uint64_t members = 0;
      const auto number_of = [&](std::uint64_t pixels) {
        return word * 64 + static_cast<std::size_t>(std::countr_zero(pixels));
      };
      const std::uint32_t surface = surfaces[number_of(left)];
      for (std::uint64_t rest = left; rest != 0; rest &= rest - 1) {
        if (surfaces[number_of(rest)] == surface) members |= rest & -rest;
      }
      // In the middle of the block, if one of them is.
      const std::uint64_t middle = members & (std::uint64_t{0x0000'0006'0006'0000} << column);
      const RoughLobe& lobe = lobes_[number_of(middle != 0 ? middle : members)];
      blocks[b].surfaces[blocks[b].count++] = {
          surface, seen_by(lobe, word, members, visibility, receiving, lights)};
      left &= ~members;
    }
  }
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (in(rough_, k)) open_[k] = between(blocks, k, surfaces[k]);
  }
  found_ = rough_;
}

}  // namespace render
