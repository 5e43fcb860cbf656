// Where in a visual hull's box anything may be: cells that are carved once a frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compositing/hull_block.h"
#include "render/live_picture.h"
#include "render/shader.h"

namespace compositing {

// The box in 2^3 cells of 4^3 cells of 4^3. A cell is empty where some camera that sees all of it
// sees nothing there, or none sees any of it; by bounds of alpha (LivePicture::most_alpha), so that
// what is empty is so for certain, but for alpha below 1.5/255. Cells hold for look-ups as wide as
// a quarter of a cell; rays with wider ones have larger cells, those with the widest none.
class HullCells final : public render::Prepared {
 public:
  // `set_from_object` places the unit cube. Pictures that the block names must be there.
  HullCells(const HullBlock& block,
            std::span<const std::byte> places,
            const std::array<float, 12>& set_from_object,
            std::span<const std::shared_ptr<const render::LivePicture>> pictures);

  const HullBlock& block() const { return block_; }
  // Where in the view's picture a line is, if that is straight in it: from x and y in steps of the
  // view's grid, times z. Else null.
  struct Straight {
    bool is = false;
    GridPlace first{}, by_x{}, by_y{};
  };
  const Straight& straight(std::size_t view) const { return straight_[view]; }

 private:
  friend class CellWalk;
  static constexpr int levels = 3;
  // Of a level's 4^3 cells, x first.
  using Mask = std::uint64_t;
  static constexpr std::size_t children = 64;

  class Carver;

  HullBlock block_;
  std::array<float, 12> object_from_set_{};
  std::array<Straight, most_hull_views> straight_;
  bool is_placed_ = false;
  std::array<float, levels> widest_m_{};  // that a level's cells hold for
  // Those that may hold something; of the first two levels also without those that hold no finer.
  Mask whole_ = ~Mask{0}, pruned_whole_ = 0;
  std::array<Mask, children> middle_{}, pruned_middle_{};
  std::vector<Mask> fine_;
  std::array<float, 3> lower_{}, upper_{};  // of the finest that may hold something, in those
};

// The pieces of a ray on which something may be, in order.
class CellWalk {
 public:
  // From `from_m` to `to_m` along a unit direction in the set; look-ups are no wider than that.
  CellWalk(const HullCells& cells,
           calibrate::Vec3f origin,
           calibrate::Vec3f direction,
           float from_m,
           float to_m,
           float widest_m);

  struct Piece {
    float from_m, to_m;
  };
  // False at the end.
  bool next(Piece& piece);

 private:
  bool next_among(std::uint64_t mask, const std::array<unsigned, 3>& cell, Piece& piece);

  const HullCells& cells_;
  int level_ = -1;  // of the cells, -1 = none
  float at_m_, to_m_;
  float ahead_m_ = 0;                     // a little of a cell
  std::array<float, 3> begin_{}, way_{};  // in the finest cells, a metre
  std::array<float, 3> metres_{};         // a cell
};

}  // namespace compositing
