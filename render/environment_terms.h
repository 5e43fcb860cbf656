// Light from places in the environment: the terms of a cell's slots, as they are found, and as they
// are kept and lit. Private to the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/image.h"
#include "render/bordered_levels.h"
#include "render/environment.h"
#include "render/lanes.h"
#include "render/place_term.h"

namespace render {

// Many of them in half the room, for they are most of what is kept, and in the order in which they
// are lit: by levels, and within each so that the next term is of another slot, where that can be,
// for a sum waits for what was put there last. A weight's colours have one exponent, and each is
// within 1/16384 of the greatest; places are within 1/65536 of the level. A weight that is not
// finite, or below 2^-110, counts as 0.
class EnvironmentTerms {
 public:
  static constexpr std::size_t slots = 512, most_levels = most_environment_levels;

  void clear() { blocks_.clear(), levels_.clear(); }
  bool empty() const { return blocks_.empty(); }
  std::size_t bytes() const {
    return blocks_.capacity() * sizeof(Block) + levels_.capacity() * sizeof(Level);
  }

  // Takes the place of what was there. Terms have slots below 512 and are in their order; `levels`,
  // at most 128, are those of an environment of this size.
  void pack(std::span<const PlaceTerm> terms, std::span<const capture::Image* const> levels);

  // Adds to the slots what comes from the levels of an environment of the same size.
  void add_light(const BorderedLevels& levels, std::span<Four, slots> added) const;

 private:
  // Eight terms: each has 15 bits of red, 8 of the exponent and 9 of the slot; 16 of green and 16
  // of x; 16 of blue and 16 of y. A level's terms in the order of their slots fill the first places
  // of all of its blocks, then the second ones; those left over have a weight of 0.
  struct Block {
    alignas(32) std::array<std::array<std::uint32_t, 8>, 3> words;
  };
  struct Level {
    std::uint32_t number, blocks;
  };

  std::vector<Block> blocks_;
  std::vector<Level> levels_;
};

}  // namespace render
