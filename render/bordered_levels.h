// An environment's levels as a cell's terms look them up. Private to the kernel.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "capture/half.h"
#include "capture/image.h"

namespace render {

// The levels of one frame's environment with what lies beyond their poles and seam around them, so
// that no place is a special one, and as halves, for they are read out of the cache: a radiance is
// within 1/2048 of itself, or of 2^-39 of the level's brightest if that is more. Each level is made
// when it is first asked for. What is no number, or negative, is 0.
//
// begin() on one thread; then at() on many.
class BorderedLevels {
 public:
  // Red, green, blue and nothing, texel by texel. What shows at (x, y), as radiance_at() has them,
  // is between the four texels from `texels + row * floor(y + 1) + 4 * floor(x + 1)` on.
  struct Level {
    int width, height;
    const capture::Half* texels;
    int row;      // halves from one to the next
    float scale;  // radiance per texel's value: a power of two
  };

  // `levels` must stay as they are until the next call.
  void begin(std::span<const capture::Image* const> levels);
  Level at(std::size_t number) const;

 private:
  struct Slot {
    const capture::Image* from = nullptr;
    std::once_flag filled;
    std::unique_ptr<capture::Half[]> texels;
    std::size_t size = 0;
    float scale = 1;
  };
  static void fill(Slot& slot);

  std::vector<std::unique_ptr<Slot>> slots_;
};

}  // namespace render
