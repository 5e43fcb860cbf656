// Light from places in the environment.
#include "render/environment_terms.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

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

using Words = std::array<std::uint32_t, 3>;
Words packed(const PlaceTerm& term, const capture::Image& level) {
  Words words{term.slot, packed_place(term.x, level.width), packed_place(term.y, level.height)};
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

// Some blocks of terms, unpacked all before any is lit: what is put down here comes back one by one
// for less than lanes of registers do.
class Unpacked {
 public:
  static constexpr std::size_t most = 16;  // blocks

  template <class Block>
  void take(const Block& block, const BorderedLevels::Level& level, float step_x, float step_y) {
    const EightWords a = load_eight(block.words[0]), b = load_eight(block.words[1]),
                     c = load_eight(block.words[2]);
    const Eight scale = std::bit_cast<Eight>((a >> 9 & 255) << 23) * level.scale;
    const auto weights = fours_of(to_floats(a >> 17) * scale, to_floats(b >> 17) * scale,
                                  to_floats(c >> 17) * scale, Eight{});
    const Eight x = to_floats(b & 0xFFFF) * step_x, y = to_floats(c & 0xFFFF) * step_y;
    const EightWords column = __builtin_convertvector(x, EightWords),
                     line = __builtin_convertvector(y, EightWords);
    const EightWords texels = line * level.row + column * 4, slots = a & 511;
    std::memcpy(&weights_[count_], &weights, sizeof weights);
    std::memcpy(&texels_[count_], &texels, sizeof texels);
    std::memcpy(&slots_[count_], &slots, sizeof slots);
    store_eight(&across_[count_], x - to_floats(column));
    store_eight(&down_[count_], y - to_floats(line));
    count_ += 8;
  }

  void add_light(const BorderedLevels::Level& level,
                 std::span<Four, EnvironmentTerms::slots> added) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const capture::Half* top = level.texels + texels_[i];
      const Eight above = eight_of_halves(top), below = eight_of_halves(top + level.row);
      const Eight both = above + (below - above) * down_[i];
      const Four left = first_four(both), right = last_four(both);
      added[static_cast<std::size_t>(slots_[i])] +=
          weights_[i] * (left + (right - left) * across_[i]);
    }
  }

 private:
  template <class T>
  using Each = std::array<T, most * 8>;
  std::size_t count_ = 0;
  Each<Four> weights_;
  Each<std::int32_t> texels_, slots_;
  Each<float> across_, down_;  // from the texel, of its size
};

}  // namespace

void EnvironmentTerms::pack(std::span<const PlaceTerm> terms,
                            std::span<const capture::Image* const> levels) {
  clear();
  std::array<std::uint32_t, most_levels> counts{};
  for (const PlaceTerm& term : terms) ++counts[term.level];
  // Where a level's next term goes.
  struct Place {
    std::size_t first, end, block, lane;
  };
  std::array<Place, most_levels> places;
  std::size_t blocks = 0;
  for (std::uint32_t level = 0; level < levels.size(); ++level) {
    if (counts[level] == 0) continue;
    levels_.push_back({level, (counts[level] + 7) / 8});
    places[level] = {blocks, blocks + levels_.back().blocks, blocks, 0};
    blocks = places[level].end;
  }
  blocks_.resize(blocks);
  const auto put = [this](Place& at, const Words& words) {
    for (std::size_t k = 0; k < words.size(); ++k) blocks_[at.block].words[k][at.lane] = words[k];
    if (++at.block == at.end) at.block = at.first, ++at.lane;
  };
  std::array<Words, most_levels> last;
  for (const PlaceTerm& term : terms) {
    last[term.level] = packed(term, *levels[term.level]);
    put(places[term.level], last[term.level]);
  }
  // Filled up with the last term of the level, but without weight: it reads nothing else.
  for (const Level& level : levels_) {
    Place& at = places[level.number];
    const Words& of = last[level.number];
    while (at.lane < 8) put(at, {of[0] & 511, of[1] & 0xFFFF, of[2] & 0xFFFF});
  }
}

void EnvironmentTerms::add_light(const BorderedLevels& levels, std::span<Four, slots> added) const {
  const Block *block = blocks_.data(), *const last = block + blocks_.size();
  for (const Level& of : levels_) {
    const BorderedLevels::Level level = levels.at(of.number);
    const float step_x = step_of(level.width), step_y = step_of(level.height);
    for (const Block* const end = block + of.blocks; block != end;) {
      Unpacked some;
      for (const Block* const until = block + std::min<std::ptrdiff_t>(end - block, Unpacked::most);
           block != until; ++block) {
        if (last - block > ahead) call_for(block[ahead]);
        some.take(*block, level, step_x, step_y);
      }
      some.add_light(level, added);
    }
  }
}

}  // namespace render
