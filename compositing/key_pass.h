// A whole frame, row by row, eight pixels at a time: for keyer.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "capture/half.h"
#include "capture/image.h"
#include "compositing/key_lanes.h"
#include "compositing/key_scratch.h"
#include "compositing/key_texel.h"

namespace compositing {

// How smoothing tells noise from motion: mean change of alpha over 3x3 pixels, in units of the
// noise; what is below `calm` moves by `least_gain` of the way, what is above `moving` at once.
inline constexpr float calm = 1.0F, moving = 2.0F, least_gain_of_change = 0.2F;
// Alpha below this share of the noise is none; from twice of it on it is as it was.
inline constexpr float haze_of_noise = 0.6F;
// One pixel alone of eight in a row is a speck of noise up to so many times of that: what is bare
// then stays bare over wide stretches, which rays pass at once.
inline constexpr float speck_of_haze = 3, most_of_speck = 0.25F;

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
  // (height, width, 4), and where it may not be 0: see KeyedFrame.
  struct Outputs {
    capture::Half* pixels;
    std::uint8_t* written;
  };

  KeyPass(const Source& source,
          const Formula& formula,
          const Inputs& in,
          KeyScratch& scratch,
          const Outputs& out)
      : source_(source),
        formula_(formula),
        in_(in),
        scratch_(scratch),
        out_(out),
        across_(static_cast<std::size_t>((in.plate.width + key_lanes - 1) / key_lanes)) {
    const std::size_t stride = (across_ + 2) * key_lanes;
    scratch.change.assign(3 * stride, 0);
    for (std::size_t i = 0; i < 3; ++i) change_[i] = scratch.change.data() + key_lanes + i * stride;
    for (auto& places : scratch.places) places.resize(across_);
    for (auto& waiting : scratch.waiting) waiting.resize(across_);
    for (auto& changed : scratch.changed) changed.clear(), changed.reserve(across_);
    const std::size_t rows = 8 * static_cast<std::size_t>((in.plate.height + 7) / 8);
    if (scratch.past.size() != across_ * rows || !scratch.has_previous) {
      scratch.previous.assign(across_ * rows * key_lanes, 0);
      scratch.past.assign(across_ * rows, KeyPast::clear);
      scratch.has_previous = false;
    }
    smooths_ = in.noise > 0 && scratch.has_previous;
    haze_ = in.noise * haze_of_noise;
    const auto order = channels_of(in.plate.colour);
    for (std::size_t i = 0; i < 3; ++i) place_of_[static_cast<std::size_t>(order[i])] = i;
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
    return soft_;
  }

 private:
  static constexpr std::size_t together = 16;  // blocks: they stay in the nearest cache

  float* change(int y) const { return change_[static_cast<std::size_t>(y) % 3]; }
  std::uint16_t* previous(int y) const {
    return scratch_.previous.data() + static_cast<std::size_t>(y) * across_ * key_lanes;
  }
  std::size_t block_at(int y, int x) const {
    return 8 * (static_cast<std::size_t>(y / 8) * across_ + static_cast<std::size_t>(x / 8)) +
           static_cast<std::size_t>(y % 8);
  }
  capture::Half* pixels(int y, int x) const {
    return out_.pixels +
           4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(in_.plate.width) +
                static_cast<std::size_t>(x));
  }
  void clear_pixels(int y, int x, int count) {
    std::uint8_t& written = out_.written[block_at(y, x)];
    if (written == 0) return;
    std::fill_n(pixels(y, x), 4 * count, capture::Half{0});
    written = 0;
  }

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
        std::uint64_t past, written;
        std::memcpy(&past, &scratch_.past[8 * (band + i)], sizeof past);
        std::memcpy(&written, out_.written + 8 * (band + i), sizeof written);
        if ((past | written) != 0) live |= settle(top, x, bare);
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

  // Clears what has become bare screen, of the rows whose bits are set; returns those that the
  // person has just left, and which are to be smoothed.
  unsigned settle(int top, int x, unsigned bare) {
    unsigned left = 0;
    for (; bare != 0; bare &= bare - 1) {
      const int row = std::countr_zero(bare), y = top + row;
      KeyPast& past = scratch_.past[block_at(y, x)];
      if (past > KeyPast::faint) {
        left |= 1U << row;
        continue;
      }
      past = KeyPast::clear;
      clear_pixels(y, x, key_lanes);
    }
    return left;
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
      __builtin_prefetch(previous(y) + block.x);
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
      const KeyPast past = scratch_.past[block_at(y, block.x)];
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
      before = load_previous(previous(y) + block.x);
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

  static F8 load_previous(const std::uint16_t* from) {
    using U8 = std::uint16_t __attribute__((vector_size(16)));
    U8 codes;
    std::memcpy(&codes, from, sizeof codes);
    return __builtin_convertvector(codes, F8) * (1.0F / 65535);
  }
  // Keeps smoothed alpha; alpha of bare screen is noise, which is above 0 only, and so would leave
  // a haze: it is taken away.
  void keep(int y, KeyBlock& block) {
    F8& alpha = block.matte.alpha;
    KeyPast past = KeyPast::mixed;
    if (!any_of(alpha < 1.0F)) past = KeyPast::whole;
    if (!any_of(alpha > haze_)) past = any_of(alpha > 0.0F) ? KeyPast::faint : KeyPast::clear;
    scratch_.past[block_at(y, block.x)] = past;
    if (past == KeyPast::mixed || past == KeyPast::faint)
      store_previous(previous(y) + block.x, alpha);
    alpha = least(alpha, most(2 * (alpha - haze_), F8{}));
    if (count_of(alpha > 0.0F) == 1 &&
        !any_of(alpha > std::min(speck_of_haze * haze_, most_of_speck)))
      alpha = F8{};
  }

  static void store_previous(std::uint16_t* to, F8 alpha) {
    using U8 = std::uint16_t __attribute__((vector_size(16)));
    const U8 codes = __builtin_convertvector(to_int_lanes(alpha * 65535.0F + 0.5F), U8);
    std::memcpy(to, &codes, sizeof codes);
  }

  void finish_row(int y) {
    const auto slot = static_cast<std::size_t>(y) % 2;
    const std::span<KeyBlock> row = std::span(scratch_.waiting[slot]).first(waiting_[slot]);
    if (smooths_) smooth(y, row);
    for (KeyBlock& block : row) keep(y, block);
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
    if (!any_of(block.matte.alpha > 0.0F)) return clear_pixels(y, block.x, block.count);
    out_.written[block_at(y, block.x)] = 1;
    write(formula_.foreground(block.light, block.plate, block.matte), block.count,
          pixels(y, block.x));
  }

  void write(const KeyedTexel<F8>& texel, int count, capture::Half* to) {
    const auto channel = [&](std::size_t place) {
      const F8 v = place == 0 ? texel.first : place == 1 ? texel.second : texel.third;
      return least(v, all_of(capture::half_max));
    };
    const std::array<F8, 4> rgba{channel(place_of_[0]), channel(place_of_[1]),
                                 channel(place_of_[2]), texel.alpha};
    const F8 part = texel.alpha * (1.0F - texel.alpha);
    const I8 soft = part > 0.0475F;  // .05 < alpha < .95
    if (count == key_lanes) {
      soft_ += count_of(soft);
      write_eight(rgba, to);
      return;
    }
    for (int i = 0; i < count; ++i) {
      soft_ -= soft[i];
      for (std::size_t c = 0; c < 4; ++c) *to++ = capture::half_from_float(rgba[c][i]);
    }
  }

  static void write_eight(const std::array<F8, 4>& rgba, capture::Half* to) {
#if defined(__F16C__) && defined(__AVX2__)
    __m128i h[4];
    for (std::size_t c = 0; c < 4; ++c) {
      h[c] = _mm256_cvtps_ph(std::bit_cast<__m256>(rgba[c]), _MM_FROUND_TO_NEAREST_INT);
    }
    const __m128i rg0 = _mm_unpacklo_epi16(h[0], h[1]), rg1 = _mm_unpackhi_epi16(h[0], h[1]);
    const __m128i ba0 = _mm_unpacklo_epi16(h[2], h[3]), ba1 = _mm_unpackhi_epi16(h[2], h[3]);
    auto* out = reinterpret_cast<__m128i*>(to);
    _mm_storeu_si128(out, _mm_unpacklo_epi32(rg0, ba0));
    _mm_storeu_si128(out + 1, _mm_unpackhi_epi32(rg0, ba0));
    _mm_storeu_si128(out + 2, _mm_unpacklo_epi32(rg1, ba1));
    _mm_storeu_si128(out + 3, _mm_unpackhi_epi32(rg1, ba1));
#else
    for (int i = 0; i < key_lanes; ++i) {
      for (std::size_t c = 0; c < 4; ++c) *to++ = capture::half_from_float(rgba[c][i]);
    }
#endif
  }

  const Source& source_;
  const Formula& formula_;
  const Inputs in_;
  KeyScratch& scratch_;
  const Outputs out_;
  std::size_t across_;                     // blocks of a row
  std::array<std::size_t, 8> count_{};     // of blocks that are not bare, of eight rows
  std::array<std::size_t, 2> waiting_{};   // of blocks, of two rows
  std::array<std::size_t, 3> place_of_{};  // of red, green and blue in the keyer's order
  std::array<float*, 3> change_{};
  bool smooths_ = false;
  float haze_ = 0;  // alpha that is none
  std::int64_t soft_ = 0;
};

}  // namespace compositing
