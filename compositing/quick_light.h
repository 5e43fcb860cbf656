// The light on the screen as quick keying follows it: by blocks, from few pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "capture/colour.h"
#include "compositing/clean_plate.h"
#include "compositing/gap_filler.h"
#include "compositing/key_lanes.h"
#include "compositing/screen_near.h"

namespace compositing {

// As PlateLight for screens of one primary, but of each 16x16 pixels 8 are looked at, or in small
// pictures 16 of each 8x8; each 8x8 pixels have one gain, and the plate is lit only where it is
// asked for.
class QuickLight {
 public:
  // The plate without gain, of PlateUse::screen. `tolerance` is of colour, against the primary,
  // `spread` of the gain within a cell.
  QuickLight(const LitPlate& bare, float tolerance, float spread);

  // Frames of the plate's size, with channels in the plate's order. Allocates nothing.
  template <class Rows>
  PlateSight update(const Rows& rows, bool follow);

  // Of 8x8 pixels, row by row:

  float gain(std::size_t block) const { return gains_[block]; }
  // The plate without gain at 4x4 pixels each: left and right, above and below. (first, second,
  // third, 1 / excess; 0 where there is no screen.)
  const std::array<F8, 2>& plate(std::size_t block) const { return plates_[block]; }
  void prefetch(std::size_t block) const { __builtin_prefetch(&plates_[block]); }
  // Whether the screen is so near that thin things are to be expected: see ScreenNear.
  bool is_near(std::size_t block) const { return block_near_[block] != 0; }
  // How many blocks are deep within what stands before it.
  std::int64_t deep_blocks() const { return std::count(block_near_.begin(), block_near_.end(), 0); }
  // What is screen at a glance, as bound_screen() has it; kept until the gain has changed by more
  // than a hundredth.
  const std::vector<LightBounds>& light_bounds();
  const std::vector<CodeBounds>& code_bounds(capture::Transfer transfer);

 private:
  template <class Rows>
  PlateSight measure(const Rows& rows);
  void light_up();

  // Eight pixels of a row that are looked at, the ratios of the plate at either four: 1 / first,
  // and the others over it.
  struct Look {
    int y = 0, x = 0, count = 0;
    F8 ratios{};
  };

  int height_;
  int cell_;            // of the gain, in pixels
  int rows_, columns_;  // of blocks
  std::array<int, 3> order_;
  float tolerance_, spread_;
  std::vector<std::array<Look, 2>> looks_;  // of each cell of the gain; may be of no pixels
  std::vector<float> pixels_;               // of each that are looked at, 0 = shows no screen
  GapFiller filler_;
  std::vector<float> shown_, blurred_, smoothed_;  // of the gain's cells
  std::vector<float> gain_row_;
  ScreenNear near_;           // on the gain's cells
  std::vector<float> gains_;  // from here on of blocks
  std::vector<std::uint8_t> block_near_;
  std::vector<std::array<F8, 2>> plates_;
  std::vector<LightBounds> bare_;  // without gain
  std::vector<LightBounds> light_;
  std::vector<float> light_gains_;  // with which these are
  std::vector<CodeBounds> codes_;
  std::vector<float> code_gains_;
  capture::Transfer transfer_ = capture::Transfer::srgb;  // of codes_
};

}  // namespace compositing
