// Light from places in the environment.
#include "render/environment_terms.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace render {
namespace {

using calibrate::Vec3f;

using EightWords = std::int32_t __attribute__((vector_size(32)));

constexpr int bias = 127 - 14;      // a float's, of the last of a colour's 15 bits
constexpr float least = 0x1p-110F;  // above what would make that bit no normal number

// Places count from -1 on in these, of a level so many pixels wide or high.
float step_of(int size) {
  return static_cast<float>(std::bit_ceil(static_cast<std::uint32_t>(size) + 1)) / 65536;
}

// No farther than the border: add_light() reads what this says.
std::uint32_t packed_place(float at, int size) {
  const float inside = std::min(std::max(-1.0F, at), static_cast<float>(size));
  const float steps = (inside + 1) / step_of(size) + 0.5F;
  return static_cast<std::uint32_t>(std::min(steps, 65535.0F));
}

std::array<std::uint32_t, 3> packed(const EnvironmentTerm& term, const capture::Image& level) {
  std::array<std::uint32_t, 3> words{term.slot, packed_place(term.x, level.width),
                                     packed_place(term.y, level.height)};
  const Vec3f w = term.weight;
  const float most = std::max({std::fabs(w.x), std::fabs(w.y), std::fabs(w.z)});
  if (!(std::isfinite(w.x) && std::isfinite(w.y) && std::isfinite(w.z) && most >= least))
    return words;
  // A float's exponent is such that most / 2^exponent is from 0.5 to 1; one more where the greatest
  // would be rounded beyond what 15 bits hold.
  const auto scale_by = [](int power) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(power + 127) << 23);
  };
  int exponent = static_cast<int>(std::bit_cast<std::uint32_t>(most) >> 23) - 126;
  if (most * scale_by(14 - exponent) > 16383.0F) ++exponent;
  const float scale = scale_by(14 - exponent);
  const auto bits = [&](float colour) {
    return static_cast<std::uint32_t>(std::lrint(colour * scale)) << 17;
  };
  words[0] |= bits(w.x) | static_cast<std::uint32_t>(exponent + bias) << 9;
  words[1] |= bits(w.y);
  words[2] |= bits(w.z);
  return words;
}

Eight to_floats(EightWords v) { return __builtin_convertvector(v, Eight); }

EightWords load_eight(const std::array<std::uint32_t, 8>& words) {
  return std::bit_cast<EightWords>(words);
}

constexpr std::ptrdiff_t ahead = 20;  // blocks: they come from memory while others are lit

template <class T>
void call_for(const T& what) {
  const char* at = reinterpret_cast<const char*>(&what);
  for (std::size_t i = 0; i < sizeof(T); i += 64) __builtin_prefetch(at + i);
}

}  // namespace

void EnvironmentTerms::pack(std::span<const EnvironmentTerm> terms,
                            std::span<const capture::Image* const> levels) {
  clear();
  std::array<std::uint32_t, most_levels> counts{};
  for (const EnvironmentTerm& term : terms) ++counts[term.level];
  std::array<std::size_t, most_levels> next{};  // places of terms, eight a block
  std::size_t blocks = 0;
  for (std::uint32_t level = 0; level < levels.size(); ++level) {
    next[level] = blocks * 8;
    if (counts[level] == 0) continue;
    levels_.push_back({level, (counts[level] + 7) / 8});
    blocks += levels_.back().blocks;
  }
  blocks_.resize(blocks);
  for (const EnvironmentTerm& term : terms) {
    const std::size_t at = next[term.level]++;
    const auto words = packed(term, *levels[term.level]);
    for (std::size_t k = 0; k < words.size(); ++k) blocks_[at / 8].words[k][at % 8] = words[k];
  }
  // Filled up with the last term of the level, but without weight: it reads nothing else.
  for (const Level& level : levels_) {
    const std::size_t last = next[level.number] - 1;
    auto& words = blocks_[last / 8].words;
    for (std::size_t i = last % 8 + 1; i < 8; ++i) {
      words[0][i] = words[0][last % 8] & 511;
      words[1][i] = words[1][last % 8] & 0xFFFF;
      words[2][i] = words[2][last % 8] & 0xFFFF;
    }
  }
}

void EnvironmentTerms::add_light(const BorderedLevels& levels, std::span<Four, slots> added) const {
  const Block* block = blocks_.data();
  for (const Level& of : levels_) {
    const BorderedLevels::Level level = levels.at(of.number);
    const float step_x = step_of(level.width), step_y = step_of(level.height);
    for (const Block* end = block + of.blocks; block != end; ++block) {
      if (blocks_.data() + blocks_.size() - block > ahead) call_for(block[ahead]);
      const EightWords a = load_eight(block->words[0]), b = load_eight(block->words[1]),
                       c = load_eight(block->words[2]);
      const Eight scale = std::bit_cast<Eight>((a >> 9 & 255) << 23) * level.scale;
      const std::array<Four, 8> weights =
          fours_of(to_floats(a >> 17) * scale, to_floats(b >> 17) * scale,
                   to_floats(c >> 17) * scale, Eight{});
      const Eight x = to_floats(b & 0xFFFF) * step_x, y = to_floats(c & 0xFFFF) * step_y;
      const EightWords column = __builtin_convertvector(x, EightWords),
                       line = __builtin_convertvector(y, EightWords);
      const Eight fx = x - to_floats(column), fy = y - to_floats(line);
      const EightWords texel = line * level.row + column * 4, slot = a & 511;
      for (std::size_t i = 0; i < 8; ++i) {
        const capture::Half* top = level.texels + texel[i];
        const Eight above = eight_of_halves(top), below = eight_of_halves(top + level.row);
        const Eight both = above + (below - above) * fy[i];
        const Four left = first_four(both), right = last_four(both);
        added[static_cast<std::size_t>(slot[i])] += weights[i] * (left + (right - left) * fx[i]);
      }
    }
  }
}

}  // namespace render
