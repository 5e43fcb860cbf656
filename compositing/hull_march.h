// Rays through a visual hull: where all keyed cameras that see a place see the person there.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "compositing/hull_cells.h"
#include "render/live_picture.h"

namespace compositing {

// A ray with the width of its cone where it begins, and by how much it grows.
struct HullRay {
  calibrate::Vec3f origin, direction;  // unit
  float width_m = 0, width_per_m = 0;
};

// The alpha of a place is the least that it has in the pictures of all cameras that see it; 0 if
// none does. Neither allocates nor throws; pictures must not be null.
class HullMarch {
 public:
  HullMarch(const HullCells& cells,
            std::span<const std::byte> places,
            std::span<const std::shared_ptr<const render::LivePicture>> pictures)
      : cells_(cells), block_(cells.block()), places_(places), pictures_(pictures) {}

  const HullBlock& block() const { return block_; }

  struct Crossing {
    float alpha = 0;  // the largest on the way
    float at_m = 0;   // where it first has half of that
    float far_m = 0;  // nothing beyond was looked at
  };
  // Follows the ray from `from_m` to `to_m`, and no further than to what is as good as opaque,
  // which counts as 1. Steps are no longer than the block's in the picture that is nearest,
  // or than half of what is looked up at once; empty cells are passed.
  Crossing find(const HullRay& ray, float from_m, float to_m) const;
  // Its alpha only, with steps so much longer.
  float opacity(const HullRay& ray, float from_m, float to_m, float coarser = 1) const;

  // What a camera sees at a place, in a square so wide; nothing if it does not see that far.
  std::optional<std::array<float, 4>> look(std::size_t view,
                                           calibrate::Vec3f p_set,
                                           float width_m) const;

 private:
  // The ray as the cameras have it: begin + t * along, x and y times z, in steps of the grid, or
  // where it is straight in the picture as parts of that.
  struct Lines {
    std::array<calibrate::Vec3f, most_hull_views> begin, along;
    float width_m = 0, width_per_m = 0;
    std::size_t first = 0;  // the camera that saw least last
  };
  struct Place {
    GridPlace place;
    float width_uv = 0;  // of the ray's cone
  };
  Crossing search(const HullRay& ray, float from_m, float to_m, float coarser, bool where) const;
  Lines lines_of(const HullRay& ray) const;
  std::optional<Place> place_at(const Lines& lines, std::size_t view, float t) const;
  float quick_alpha_at(Lines& lines, float t, float least) const;
  float alpha_at(const Lines& lines, float t) const;
  float step_of(const HullRay& ray, float from, float to, float coarser) const;
  std::span<const std::byte> places_of(std::size_t view) const {
    return places_.subspan(block_.view[view].first_byte);
  }

  const HullCells& cells_;
  const HullBlock& block_;
  std::span<const std::byte> places_;
  std::span<const std::shared_ptr<const render::LivePicture>> pictures_;
};

}  // namespace compositing
