// A whole frame, quickly, 8x8 pixels at a time: for keyer.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "compositing/key_lanes.h"
#include "compositing/key_scratch.h"
#include "compositing/key_store.h"
#include "compositing/key_texel.h"
#include "compositing/plate_cells.h"
#include "compositing/quick_light.h"

namespace compositing {

// One frame before a screen of one primary, by the table. As KeyPass, but
// - 8x8 pixels that have none of the screen's colour, and are not beside bare screen, are the
//   person as seen: nothing is asked of plate or table, what is green of them is limited;
// - what is screen at a glance is told from means of two rows;
// - elsewhere the plate is that of the nearest 4x4 pixels, and the table is asked once for the mean
//   of four pixels below each other, in the one part that the block lies in; each of the four has
//   as much more or less alpha as it has less or more of the screen's colour;
// - smoothing asks how much 3x4 pixels around change, within four rows of a block, and what is a
//   speck of noise stays.
template <class Source>
class QuickPass {
 public:
  using Bounds = typename Source::Bounds;
  struct Inputs {
    const LitPlate& plate;  // its size and colour
    const QuickLight& light;
    const KeyDials& dials;
    std::span<const std::uint8_t> garbage, core;
    std::span<const std::uint8_t> masked;  // of each 8x8 pixels whether a mask is; or empty
    float noise;                           // of alpha, one sigma; 0 = no smoothing
    std::span<const Bounds> bare;          // what is screen at a glance, of each 8x8 pixels
  };

  QuickPass(const Source& source,
            const Inputs& in,
            KeyScratch& scratch,
            const KeyStore::Outputs& out)
      : source_(source),
        in_(in),
        scratch_(scratch),
        store_(in.plate, in.noise, scratch, out),
        across_(static_cast<int>(store_.across())),
        primary_(channels_of(in.plate.colour)[0]),
        smooths_(in.noise > 0 && scratch.has_previous) {
    for (auto& looks : scratch.looks) looks.assign(store_.across() + 2, {});
  }

  // Returns how many pixels are neither clear nor whole.
  std::int64_t run() {
    const int bands = (in_.plate.height + 7) / 8;
    glance(0);
    for (int band = 0; band < bands; ++band) {
      if (band + 1 < bands) glance(band + 1);
      key_band(band, bands);
      key_halves();
    }
    scratch_.has_previous = true;
    return store_.soft();
  }
  // Of pixels deep within persons, how many lie in eights of which half or more are so.
  std::int64_t thin() const { return thin_; }

 private:
  static constexpr std::size_t together = 8;  // halves: they stay in the nearest cache

  // By band; the first and last stand for what lies beyond the picture.
  std::vector<KeyLook>& looks(int band) const {
    return scratch_.looks[static_cast<std::size_t>(band) % 3];
  }

  void glance(int band) {
    const int top = 8 * band, rows = std::min(8, in_.plate.height - top);
    const int whole = in_.plate.width / key_lanes;
    KeyLook* const look = looks(band).data() + 1;
    const std::size_t first = static_cast<std::size_t>(band) * store_.across();
    for (int i = 0; i < across_; ++i) {
      const std::size_t block = first + static_cast<std::size_t>(i);
      look[i] = {};
      look[i].open = !in_.masked.empty() && in_.masked[block] != 0;
      if (i >= whole || look[i].open) continue;
      look[i].bare =
          static_cast<std::uint8_t>(source_.pairs_within(top, 8 * i, rows, in_.bare[block]));
      look[i].open = look[i].bare != 0;
      if (!look[i].open) look[i].plain = source_.lacks_first(top, 8 * i, rows, in_.bare[block]);
      if (look[i].bare != (1U << rows) - 1) {
        in_.light.prefetch(block);
        store_.prefetch(top, 8 * i, rows);
      }
    }
  }

  void key_band(int band, int bands) {
    const int top = 8 * band, rows = std::min(8, in_.plate.height - top);
    const unsigned all = (1U << rows) - 1;
    const std::size_t first = static_cast<std::size_t>(band) * store_.across();
    const KeyLook* const here = looks(band).data();
    const KeyLook* const above = looks(std::max(band - 1, 0)).data();
    const KeyLook* const below = looks(std::min(band + 1, bands - 1)).data();
    for (int i = 0; i < across_; ++i) {
      const std::size_t block = first + static_cast<std::size_t>(i);
      const KeyLook& look = here[i + 1];
      unsigned live = all & ~static_cast<unsigned>(look.bare);
      if (look.plain && closed(above + i) && closed(here + i) && closed(below + i)) {
        put_whole(top, 8 * i, rows, block);
        continue;
      }
      if (look.bare != 0 && store_.has_any_before(block))
        live |= store_.settle(top, 8 * i, look.bare);
      if (live == 0) continue;
      for (std::size_t half = 0; half < 2; ++half) {
        const unsigned of_half = live >> 4 * half & 15U;
        if (of_half != 0) add_half(top, i, half, of_half, block);
      }
    }
  }

  // Whether none of three blocks beside each other shows bare screen.
  static bool closed(const KeyLook* look) {
    return !(look[0].open || look[1].open || look[2].open);
  }

  void put_whole(int top, int x, int rows, std::size_t block) {
    store_.mark_written(block, rows);
    // Without smoothing nothing is kept, and so nothing would take it back.
    if (in_.noise > 0) store_.keep_whole(block);
    switch (primary_) {
      case 0:
        return put_whole<0>(top, x, rows);
      case 1:
        return put_whole<1>(top, x, rows);
      default:
        return put_whole<2>(top, x, rows);
    }
  }

  // As foreground_of() without spill.
  template <std::size_t primary>
  void put_whole(int top, int x, int rows) {
    constexpr std::size_t second = primary == 0 ? 1 : 0, third = primary == 2 ? 1 : 2;
    const float despill = in_.dials.despill;
    const float harder = std::max(despill - 1, 0.0F), kept = std::max(1 - despill, 0.0F);
    const F8 of_greater = all_of(1 - harder), of_both = all_of(0.5F * harder);
    for (int row = 0; row < rows; ++row) {
      std::array<F8, 3> rgb;
      source_.load_rgb(top + row, x, rgb);
      const F8 greater = most(rgb[second], rgb[third]), both = rgb[second] + rgb[third];
      const F8 limit =
          times_plus(greater, of_greater, times_plus(both, of_both, kept * rgb[primary]));
      rgb[primary] = least(rgb[primary], limit);
      KeyStore::write_whole(rgb, store_.pixels(top + row, x));
    }
  }

  // Four rows of a block. Everything is done for all of them, also for those that are bare or
  // beyond the picture: what a branch would save costs more where it is not foreseen, and in hair
  // none is.
  struct Half {
    std::size_t block, first;  // row within it
    int x, y, rows, count;     // of pixels that are in the picture
    unsigned live;             // rows that are not bare, a bit each
    std::array<std::array<F8, 3>, 4> light;
    std::array<F8, 3> plate;
    F8 over_excess;
    TexelShare<F8> share;  // of the mean of the four
    TexelMatte<F8> matte;
    std::array<F8, 4> alpha;
  };

  void add_half(int top, int column, std::size_t half, unsigned live, std::size_t block) {
    Half& h = halves_[count_++];
    h.block = block, h.first = 4 * half, h.live = live;
    h.x = key_lanes * column, h.y = top + static_cast<int>(h.first);
    h.rows = std::min(4, in_.plate.height - h.y);
    h.count = std::min(key_lanes, in_.plate.width - h.x);
    if (count_ == together) key_halves();
  }

  // In short loops, as KeyPass does it.
  void key_halves() {
    const std::span<Half> all = std::span(halves_).first(count_);
    count_ = 0;
    for (Half& h : all) look_at(h);
    for (Half& h : all) h.matte = matte_of(h.share, h.over_excess, in_.dials);
    for (Half& h : all) find_alpha(h);
    if (in_.noise > 0) {
      if (smooths_) {
        for (Half& h : all) smooth(h);
      }
      for (Half& h : all) {
        for (std::size_t i = 0; i < 4; ++i) store_.keep_quickly(h.block, h.first + i, h.alpha[i]);
      }
    }
    for (const Half& h : all) put(h);
  }

  void look_at(Half& h) const {
    for (std::size_t i = 0; i < 4; ++i)
      source_.load(h.y + std::min(static_cast<int>(i), h.rows - 1), h.x, h.count, h.light[i]);
    const F8 p = in_.light.plate(h.block)[h.first / 4], gain = all_of(in_.light.gain(h.block));
    h.plate = {gain * __builtin_shufflevector(p, p, 0, 0, 0, 0, 4, 4, 4, 4),
               gain * __builtin_shufflevector(p, p, 1, 1, 1, 1, 5, 5, 5, 5),
               gain * __builtin_shufflevector(p, p, 2, 2, 2, 2, 6, 6, 6, 6)};
    h.over_excess = __builtin_shufflevector(p, p, 3, 3, 3, 3, 7, 7, 7, 7) / gain;
    std::array<F8, 3> mean;
    for (std::size_t c = 0; c < 3; ++c)
      mean[c] = 0.25F * ((h.light[0][c] + h.light[1][c]) + (h.light[2][c] + h.light[3][c]));
    h.share = share_of<false>(mean, h.plate, h.over_excess, in_.dials);
    if (!in_.light.is_near(h.block)) h.share.square = KeyTable::deep(h.share.square);
  }

  void find_alpha(Half& h) const {
    const F8 zero{}, one = all_of(1);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& [first, second, third] = h.light[i];
      const F8 more =
          less_times(h.share.share, screen_excess<false>(first, second, third), h.over_excess);
      h.alpha[i] = least(most(times_plus(more, all_of(in_.dials.scale), h.matte.alpha), zero), one);
    }
    if (!in_.masked.empty() && in_.masked[h.block] != 0) {
      for (int i = 0; i < h.rows; ++i)
        apply_masks(h.y + i, h.x, h.count, h.alpha[static_cast<std::size_t>(i)]);
    }
    if (h.live == 15U) return;
    for (std::size_t i = 0; i < 4; ++i) h.alpha[i] = (h.live >> i & 1U) != 0 ? h.alpha[i] : zero;
  }

  void put(const Half& h) {
    for (int i = 0; i < h.rows; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const F8 alpha = h.alpha[row];
      store_.mark_written(h.block, h.first + row, any_of(alpha > 0.0F));
      const bool mostly_soft = store_.write(
          foreground_of<false>(h.light[row], h.plate, {alpha, h.matte.spill}, in_.dials), h.count,
          store_.pixels(h.y + i, h.x));
      if (mostly_soft && !in_.light.is_near(h.block)) thin_ += key_lanes;
    }
  }

  void apply_masks(int y, int x, int count, F8& alpha) const {
    const std::size_t first =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(in_.plate.width) +
        static_cast<std::size_t>(x);
    for (int i = 0; i < count; ++i) {
      const std::size_t pixel = first + static_cast<std::size_t>(i);
      if (!in_.core.empty())
        alpha[i] = std::max(alpha[i], static_cast<float>(in_.core[pixel]) / 255);
      if (!in_.garbage.empty()) alpha[i] *= 1 - static_cast<float>(in_.garbage[pixel]) / 255;
    }
  }

  // Alpha over frames, of four rows.
  void smooth(Half& h) const {
    std::array<F8, 4>& alpha = h.alpha;
    std::array<F8, 4> before, size;
    for (std::size_t i = 0; i < 4; ++i) {
      before[i] = store_.quick_before(h.block, h.first + i);
      size[i] = size_of(alpha[i] - before[i]);
    }
    // Of two rows and half of the next two, and three pixels across; those at the ends stand for
    // what is beyond.
    const float per_noise = 1 / (9 * in_.noise);
    const F8 zero{}, one = all_of(1);
    const F8 upper = size[0] + size[1], lower = size[2] + size[3];
    for (std::size_t pair = 0; pair < 2; ++pair) {
      const F8 change = pair == 0 ? upper + 0.5F * lower : lower + 0.5F * upper;
      const F8 sum = change + __builtin_shufflevector(change, change, 0, 0, 1, 2, 3, 4, 5, 6) +
                     __builtin_shufflevector(change, change, 1, 2, 3, 4, 5, 6, 7, 7);
      const F8 moved = (sum * per_noise - calm) * (1 / (moving - calm));
      const F8 gain =
          least_gain_of_change + (1 - least_gain_of_change) * least(most(moved, zero), one);
      for (std::size_t i = 2 * pair; i < 2 * pair + 2; ++i) {
        const F8 a = between(before[i], alpha[i], gain);
        alpha[i] = a < 0.002F ? zero : a > 0.998F ? one : a;
      }
    }
  }

  const Source& source_;
  const Inputs in_;
  KeyScratch& scratch_;
  KeyStore store_;
  int across_;   // blocks of a row
  int primary_;  // channel of the screen's colour
  bool smooths_;
  std::array<Half, together> halves_;  // that wait
  std::size_t count_ = 0;
  std::int64_t thin_ = 0;
};

}  // namespace compositing
