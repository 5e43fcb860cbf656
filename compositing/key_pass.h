// A whole frame, row by row, eight pixels at a time: for keyer.cpp.
#pragma once

#include <algorithm>
#include <array>
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

// One frame through `Formula`, which tells the share of the screen, of that a matte, and of that a
// foreground.
//
// Three rows are in flight: one is finished when the one below it has been seen. What is not screen
// at a glance is done eight pixels at a time, by short loops over a row: in one loop, each eight
// would wait for results of their own, longer than a processor looks ahead.
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
          capture::HalfImage& keyed)
      : source_(source),
        formula_(formula),
        in_(in),
        scratch_(scratch),
        keyed_(keyed),
        across_(static_cast<std::size_t>((in.plate.width + key_lanes - 1) / key_lanes)) {
    const std::size_t stride = (across_ + 2) * key_lanes;
    scratch.change.resize(3 * stride);
    for (std::size_t i = 0; i < 3; ++i) change_[i] = scratch.change.data() + key_lanes + i * stride;
    for (auto& blocks : scratch.blocks) blocks.resize(across_);
    const std::size_t pixels = across_ * key_lanes * static_cast<std::size_t>(in.plate.height);
    if (scratch.previous.size() != pixels) {
      scratch.previous.assign(pixels, 0);
      scratch.has_previous = false;
    }
    smooths_ = in.noise > 0 && scratch.has_previous;
    const auto order = channels_of(in.plate.colour);
    for (std::size_t i = 0; i < 3; ++i) place_of_[static_cast<std::size_t>(order[i])] = i;
  }

  // Returns how many pixels are neither clear nor whole.
  std::int64_t run() {
    const int height = in_.plate.height;
    for (int y = 0; y < height; ++y) {
      see_row(y);
      if (y > 0) finish_row(y - 1);
    }
    finish_row(height - 1);
    scratch_.has_previous = true;
    return soft_;
  }

 private:
  float* change(int y) const { return change_[static_cast<std::size_t>(y) % 3]; }
  // Those of a row that are not clear.
  std::span<KeyBlock> blocks(int y) const {
    const auto slot = static_cast<std::size_t>(y) % 2;
    return std::span(scratch_.blocks[slot]).first(count_[slot]);
  }
  std::uint16_t* previous(int y) const {
    return scratch_.previous.data() + static_cast<std::size_t>(y) * across_ * key_lanes;
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
    // Pixels lie between the centres of cells of 4 at eighths.
    const auto cell = [&](int i) {
      const int column = 4 * std::clamp(x / 4 + i, 0, plate.columns - 1);
      const F4 top = load_four(row.above + column), low = load_four(row.below + column);
      return top + row.down * (low - top);
    };
    constexpr F8 across{.625F, .875F, .125F, .375F, .625F, .875F, .125F, .375F};
    const auto cells = transposed(cell(-1), cell(0), cell(1), cell(2));
    for (std::size_t c = 0; c < 4; ++c) {
      const F8 left = __builtin_shufflevector(cells[c], cells[c], 0, 0, 1, 1, 1, 1, 2, 2);
      const F8 right = __builtin_shufflevector(cells[c], cells[c], 1, 1, 2, 2, 2, 2, 3, 3);
      p[c] = left + across * (right - left);
    }
    return p;
  }

  // Of each eight pixels of a row, which are not bare screen at a glance, or were not clear before.
  void find_blocks(int y) {
    const auto slot = static_cast<std::size_t>(y) % 2;
    KeyBlock* const blocks = scratch_.blocks[slot].data();
    const std::uint16_t* const before = previous(y);
    const int width = in_.plate.width, whole = in_.bare.empty() ? 0 : width / key_lanes;
    const Bounds* const bare =
        in_.bare.empty() ? nullptr : in_.bare.data() + static_cast<std::size_t>(y / 8) * across_;
    std::size_t count = 0;
    int x = 0;
    for (int i = 0; i < whole; ++i, x += key_lanes) {
      std::array<std::uint64_t, 2> codes;
      std::memcpy(codes.data(), before + x, sizeof codes);
      const bool was_clear = (codes[0] | codes[1]) == 0;
      blocks[count].x = x;
      blocks[count].count = key_lanes;
      count += !(source_.within(y, x, bare[i]) & was_clear);
    }
    for (; x < width; x += key_lanes) {
      blocks[count].x = x;
      blocks[count].count = std::min(key_lanes, width - x);
      ++count;
    }
    count_[slot] = count;
  }

  void see_row(int y) {
    find_blocks(y);
    const std::span<KeyBlock> row = blocks(y);
    const PlateRow plate_here = plate_row(y);
    for (KeyBlock& block : row) {
      source_.load(y, block.x, block.count, block.light);
      const auto p = plate_at_lanes(plate_here, block.x);
      block.plate = {p[0], p[1], p[2]};
      block.plate_last = p[3];
    }
    for (KeyBlock& block : row)
      block.share = formula_.share(block.light, block.plate, block.plate_last);
    for (KeyBlock& block : row)
      block.matte = formula_.matte(block.light, block.plate, block.plate_last, block.share);
    if (!in_.garbage.empty() || !in_.core.empty()) {
      for (KeyBlock& block : row) apply_masks(y, block);
    }
    if (smooths_) tell_change(y, row);
  }

  void tell_change(int y, std::span<const KeyBlock> row) {
    float* const change_here = change(y);
    const std::uint16_t* const before = previous(y);
    std::fill_n(change_here, across_ * key_lanes, 0.0F);
    for (const KeyBlock& block : row) {
      const F8 d = block.matte.alpha - load_previous(before + block.x);
      store_lanes(change_here + block.x, d < 0.0F ? -d : d);
    }
    change_here[-1] = change_here[0];
    change_here[in_.plate.width] = change_here[in_.plate.width - 1];
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
  static void store_previous(std::uint16_t* to, F8 alpha) {
    using U8 = std::uint16_t __attribute__((vector_size(16)));
    const U8 codes = __builtin_convertvector(to_int_lanes(alpha * 65535.0F + 0.5F), U8);
    std::memcpy(to, &codes, sizeof codes);
  }

  void finish_row(int y) {
    const std::span<KeyBlock> row = blocks(y);
    if (smooths_) smooth(y, row);
    if (in_.noise > 0) {
      std::uint16_t* const before = previous(y);
      // Noise of bare screen is above 0 only, and so would leave a haze.
      const float haze = in_.noise * haze_of_noise;
      for (KeyBlock& block : row) {
        F8& alpha = block.matte.alpha;
        store_previous(before + block.x, alpha);
        alpha = least(alpha, most(2 * (alpha - haze), F8{}));
      }
    }
    capture::Half* const to = &keyed_.pixels[keyed_.index(y, 0)];
    std::fill_n(to, 4 * static_cast<std::size_t>(in_.plate.width), capture::Half{0});
    for (const KeyBlock& block : row) {
      if (!any_of(block.matte.alpha > 0.0F)) continue;
      write(formula_.foreground(block.light, block.plate, block.matte), block.count,
            to + 4 * block.x);
    }
  }

  // Alpha over frames.
  void smooth(int y, std::span<KeyBlock> row) const {
    const std::array<const float*, 3> around{change(std::max(y - 1, 0)), change(y),
                                             change(std::min(y + 1, in_.plate.height - 1))};
    const std::uint16_t* const before = previous(y);
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
      const F8 old = load_previous(before + block.x);
      const F8 alpha = old + gain * (block.matte.alpha - old);
      // What never gets there in codes of 1/65535 is there.
      block.matte.alpha = alpha < 0.002F ? zero : alpha > 0.998F ? one : alpha;
    }
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
  capture::HalfImage& keyed_;
  std::size_t across_;                     // blocks of a row
  std::array<std::size_t, 2> count_{};     // of blocks that are not clear
  std::array<std::size_t, 3> place_of_{};  // of red, green and blue in the keyer's order
  std::array<float*, 3> change_{};
  bool smooths_ = false;
  std::int64_t soft_ = 0;
};

}  // namespace compositing
