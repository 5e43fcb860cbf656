// A whole frame, row by row, eight pixels at a time: for keyer.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "capture/image.h"
#include "compositing/key_lanes.h"
#include "compositing/key_scratch.h"
#include "compositing/key_store.h"
#include "compositing/key_texel.h"

namespace compositing {

// One frame through `Formula`, which tells the share of the screen, of that a matte, and of that a
// foreground.
//
// Eight rows at a time, 8x8 pixels that are screen at a glance, and were before, are passed over.
// The rest is done eight pixels of a row at a time, a few of these together, by short loops: in one
// loop, each eight would wait for results of their own, longer than a processor looks ahead. What
// is as clear or whole as it was is finished at once; of other pixels smoothing asks how much their
// neighbours change, so that they wait until the row below has been seen.
template <class Source, class Formula>
class KeyPass {
 public:
  using Bounds = typename Source::Bounds;
  struct Inputs {
    const LitPlate& plate;
    std::span<const std::uint8_t> garbage, core;
    float noise;                   // of alpha, one sigma; 0 = no smoothing
    std::span<const Bounds> bare;  // what is screen at a glance, of each 8x8 pixels; or empty
  };
  KeyPass(const Source& source,
          const Formula& formula,
          const Inputs& in,
          KeyScratch& scratch,
          const KeyStore::Outputs& out)
      : source_(source),
        formula_(formula),
        in_(in),
        scratch_(scratch),
        store_(in.plate, in.noise, scratch, out),
        across_(store_.across()) {
    const std::size_t stride = (across_ + 2) * key_lanes;
    scratch.change.assign(3 * stride, 0);
    for (std::size_t i = 0; i < 3; ++i) change_[i] = scratch.change.data() + key_lanes + i * stride;
    for (auto& places : scratch.places) places.resize(across_);
    for (auto& waiting : scratch.waiting) waiting.resize(across_);
    for (auto& changed : scratch.changed) changed.clear(), changed.reserve(across_);
    smooths_ = in.noise > 0 && scratch.has_previous;
  }

  // Returns how many pixels are neither clear nor whole.
  std::int64_t run() {
    const int height = in_.plate.height;
    for (int y = 0; y < height; ++y) {
      if (y % 8 == 0) glance(y);
      see_row(y);
      if (y > 0) finish_row(y - 1);
    }
    finish_row(height - 1);
    scratch_.has_previous = true;
    return store_.soft();
  }
  // Of pixels deep within persons, how many lie in eights of which half or more are so.
  std::int64_t thin() const { return thin_; }

 private:
  static constexpr std::size_t together = 16;  // blocks: they stay in the nearest cache

  float* change(int y) const { return change_[static_cast<std::size_t>(y) % 3]; }
  // Where a row of pixels lies in the plate.
  struct PlateRow {
    const float* above;  // cells
    const float* below;
    float down;  // of the way between them
  };
  PlateRow plate_row(int y) const {
    const LitPlate& plate = in_.plate;
    const float at =
        std::clamp((static_cast<float>(y) + 0.5F) / static_cast<float>(plate.step) - 0.5F, 0.0F,
                   static_cast<float>(plate.rows - 1));
    const int row = static_cast<int>(at);
    return {plate.cell(row, 0), plate.cell(std::min(row + 1, plate.rows - 1), 0),
            at - static_cast<float>(row)};
  }

  // The plate at eight pixels: cells blended downwards, then across.
  std::array<F8, 4> plate_at_lanes(const PlateRow& row, int x) const {
    const LitPlate& plate = in_.plate;
    std::array<F8, 4> p;
    if (plate.step == 1) {
      const auto cell = [&](int i) {
        return load_four(row.above + 4 * std::min(x + i, plate.columns - 1));
      };
      const auto first = transposed(cell(0), cell(1), cell(2), cell(3));
      const auto second = transposed(cell(4), cell(5), cell(6), cell(7));
      for (std::size_t c = 0; c < 4; ++c)
        p[c] = __builtin_shufflevector(first[c], second[c], 0, 1, 2, 3, 4, 5, 6, 7);
      return p;
    }
    // Pixels lie between the centres of cells of 4 at eighths. Pairs of neighbours, blended
    // downwards:
    const auto pair = [&](const float* above, const float* below) {
      const F8 top = load_lanes(above), low = load_lanes(below);
      return between(top, low, all_of(row.down));
    };
    const int first = x / 4 - 1;
    F8 a, b, c;
    if (first >= 0 && first + 3 < plate.columns) {
      const float *above = row.above + 4 * first, *below = row.below + 4 * first;
      a = pair(above, below), c = pair(above + 8, below + 8);
    } else {
      std::array<float, 16> top, low;
      for (int i = 0; i < 4; ++i) {
        const int column = 4 * std::clamp(first + i, 0, plate.columns - 1);
        std::copy_n(row.above + column, 4, &top[static_cast<std::size_t>(4 * i)]);
        std::copy_n(row.below + column, 4, &low[static_cast<std::size_t>(4 * i)]);
      }
      a = pair(top.data(), low.data()), c = pair(top.data() + 8, low.data() + 8);
    }
    b = __builtin_shufflevector(a, c, 4, 5, 6, 7, 8, 9, 10, 11);
    constexpr F8 across{.625F, .875F, .125F, .375F, .625F, .875F, .125F, .375F};
    const auto level = [&](F8 left, F8 right) { return between(left, right, across); };
    p[0] = level(__builtin_shufflevector(a, b, 0, 0, 8, 8, 4, 4, 12, 12),
                 __builtin_shufflevector(b, c, 0, 0, 8, 8, 4, 4, 12, 12));
    p[1] = level(__builtin_shufflevector(a, b, 1, 1, 9, 9, 5, 5, 13, 13),
                 __builtin_shufflevector(b, c, 1, 1, 9, 9, 5, 5, 13, 13));
    p[2] = level(__builtin_shufflevector(a, b, 2, 2, 10, 10, 6, 6, 14, 14),
                 __builtin_shufflevector(b, c, 2, 2, 10, 10, 6, 6, 14, 14));
    p[3] = level(__builtin_shufflevector(a, b, 3, 3, 11, 11, 7, 7, 15, 15),
                 __builtin_shufflevector(b, c, 3, 3, 11, 11, 7, 7, 15, 15));
    return p;
  }

  // Of eight rows from `top` on, which eights of pixels are not bare screen at a glance, or were
  // not clear before.
  void glance(int top) {
    const int width = in_.plate.width, rows = std::min(8, in_.plate.height - top);
    const unsigned all = (1U << rows) - 1;
    const int whole = in_.bare.empty() ? 0 : width / key_lanes;
    const std::size_t band = static_cast<std::size_t>(top / 8) * across_;
    std::array<std::size_t, 8> count{};
    int x = 0;
    for (std::size_t i = 0; i < across_; ++i, x += key_lanes) {
      unsigned live = all;
      if (x < whole * key_lanes) {
        const unsigned bare = source_.rows_within(top, x, rows, in_.bare[band + i]);
        live &= ~bare;
        if (store_.has_any_before(band + i)) live |= store_.settle(top, x, bare);
      }
      if (live != 0) prefetch_plate(top, x);
      for (; live != 0; live &= live - 1) {
        const auto row = static_cast<std::size_t>(std::countr_zero(live));
        scratch_.places[row][count[row]++] = x;
      }
    }
    count_ = count;
  }

  // The plate's cells about 8x8 pixels, some time before they are needed.
  void prefetch_plate(int top, int x) const {
    const LitPlate& plate = in_.plate;
    const int first = top / plate.step, column = std::min(x / plate.step + 1, plate.columns - 1);
    for (int row = first; row < std::min(first + 3, plate.rows); ++row)
      __builtin_prefetch(plate.cell(row, column));
  }

  void see_row(int y) {
    const std::size_t row = static_cast<std::size_t>(y) % 8;
    const std::span<const int> places = std::span(scratch_.places[row]).first(count_[row]);
    const PlateRow plate_here = plate_row(y);
    const NearRow near_here(in_.plate.near, y);
    forget_change(y);
    waiting_[static_cast<std::size_t>(y) % 2] = 0;
    for (std::size_t first = 0; first < places.size(); first += together)
      see_blocks(y, plate_here, near_here,
                 places.subspan(first, std::min(together, places.size() - first)));
    float* const change_here = change(y);
    change_here[-1] = change_here[0];
    change_here[in_.plate.width] = change_here[in_.plate.width - 1];
  }

  void see_blocks(int y,
                  const PlateRow& plate_here,
                  const NearRow& near_here,
                  std::span<const int> places) {
    std::array<KeyBlock, together> blocks;
    std::array<F8, together> plate_last;
    std::array<TexelShare<F8>, together> share;
    const std::span<KeyBlock> row = std::span(blocks).first(places.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
      KeyBlock& block = row[i];
      block.x = places[i];
      __builtin_prefetch(store_.previous(y, block.x));
      block.count = std::min(key_lanes, in_.plate.width - block.x);
      source_.load(y, block.x, block.count, block.light);
      const auto p = plate_at_lanes(plate_here, block.x);
      block.plate = {p[0], p[1], p[2]};
      plate_last[i] = p[3];
    }
    for (std::size_t i = 0; i < row.size(); ++i)
      share[i] = formula_.share(row[i].light, row[i].plate, plate_last[i]);
    if constexpr (Formula::knows_near) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        if (near_here.is_deep(row[i].x)) share[i].square = KeyTable::deep(share[i].square);
      }
    }
    for (std::size_t i = 0; i < row.size(); ++i)
      row[i].matte = formula_.matte(row[i].light, row[i].plate, plate_last[i], share[i]);
    if constexpr (Formula::knows_near) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        if (near_here.is_even(row[i].x)) continue;
        const F8 near = near_here.at(row[i].x);
        row[i].matte = formula_.matte_between(plate_last[i], near, share[i]);
      }
    }
    if (!in_.garbage.empty() || !in_.core.empty()) {
      for (KeyBlock& block : row) apply_masks(y, block);
    }
    for (const KeyBlock& block : row) {
      const F8 alpha = block.matte.alpha;
      const KeyPast past = store_.past(y, block.x);
      const bool clear = past == KeyPast::clear && !any_of(alpha > 0.0F);
      const bool whole = past == KeyPast::whole && !any_of(alpha < 1.0F);
      if (clear || whole || !(in_.noise > 0)) {
        put(y, block);
      } else {
        wait(y, block, past);
      }
    }
  }

  void forget_change(int y) {
    float* const change_here = change(y);
    std::vector<int>& changed = scratch_.changed[static_cast<std::size_t>(y) % 3];
    for (const int x : changed) store_lanes(change_here + x, F8{});
    changed.clear();
    change_here[in_.plate.width] = 0;
  }

  void wait(int y, const KeyBlock& block, KeyPast past) {
    const auto slot = static_cast<std::size_t>(y) % 2;
    F8 before = all_of(past == KeyPast::whole ? 1 : 0);
    if (past == KeyPast::mixed || past == KeyPast::faint)
      before = KeyStore::load(store_.previous(y, block.x));
    const F8 d = block.matte.alpha - before;
    store_lanes(change(y) + block.x, d < 0.0F ? -d : d);
    scratch_.changed[static_cast<std::size_t>(y) % 3].push_back(block.x);
    KeyBlock& waiting = scratch_.waiting[slot][waiting_[slot]++];
    // One by one: a copy of the whole is slow.
    waiting.x = block.x, waiting.count = block.count;
    for (std::size_t c = 0; c < 3; ++c)
      waiting.light[c] = block.light[c], waiting.plate[c] = block.plate[c];
    waiting.matte.alpha = block.matte.alpha, waiting.matte.spill = block.matte.spill;
    waiting.before = before;
  }

  void apply_masks(int y, KeyBlock& block) const {
    for (int i = 0; i < block.count; ++i) {
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(in_.plate.width) +
          static_cast<std::size_t>(block.x + i);
      F8& alpha = block.matte.alpha;
      if (!in_.core.empty())
        alpha[i] = std::max(alpha[i], static_cast<float>(in_.core[pixel]) / 255);
      if (!in_.garbage.empty()) alpha[i] *= 1 - static_cast<float>(in_.garbage[pixel]) / 255;
    }
  }

  void finish_row(int y) {
    const auto slot = static_cast<std::size_t>(y) % 2;
    const std::span<KeyBlock> row = std::span(scratch_.waiting[slot]).first(waiting_[slot]);
    if (smooths_) smooth(y, row);
    for (KeyBlock& block : row) store_.keep(y, block);
    for (const KeyBlock& block : row) put(y, block);
  }

  // Alpha over frames.
  void smooth(int y, std::span<KeyBlock> row) const {
    const std::array<const float*, 3> around{change(std::max(y - 1, 0)), change(y),
                                             change(std::min(y + 1, in_.plate.height - 1))};
    const float per_noise = 1 / (9 * in_.noise);
    const F8 zero{}, one = all_of(1);
    for (KeyBlock& block : row) {
      F8 sum{};
      for (const float* from : around) {
        from += block.x;
        sum += load_lanes(from - 1) + load_lanes(from) + load_lanes(from + 1);
      }
      const F8 moved = (sum * per_noise - calm) * (1 / (moving - calm));
      const F8 gain =
          least_gain_of_change + (1 - least_gain_of_change) * least(most(moved, zero), one);
      const F8 old = block.before;
      const F8 alpha = between(old, block.matte.alpha, gain);
      // What never gets there in codes of 1/65535 is there.
      block.matte.alpha = alpha < 0.002F ? zero : alpha > 0.998F ? one : alpha;
    }
  }

  void put(int y, const KeyBlock& block) {
    if (!any_of(block.matte.alpha > 0.0F)) return store_.clear_pixels(y, block.x, block.count);
    store_.mark_written(y, block.x);
    const bool mostly_soft =
        store_.write(formula_.foreground(block.light, block.plate, block.matte), block.count,
                     store_.pixels(y, block.x));
    if (mostly_soft && in_.plate.near.at(y, block.x + key_lanes / 2) <= 0) thin_ += key_lanes;
  }

  const Source& source_;
  const Formula& formula_;
  const Inputs in_;
  KeyScratch& scratch_;
  KeyStore store_;
  std::size_t across_;                    // blocks of a row
  std::array<std::size_t, 8> count_{};    // of blocks that are not bare, of eight rows
  std::array<std::size_t, 2> waiting_{};  // of blocks, of two rows
  std::array<float*, 3> change_{};
  bool smooths_ = false;
  std::int64_t thin_ = 0;
};

}  // namespace compositing
