// A whole frame, row by row, eight pixels at a time: for keyer.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

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

// One frame through `Formula`, which gives a matte (alpha and spill) of texel and plate, and a
// foreground of them and the matte.
//
// Three rows of alpha are in flight: a row is finished when the one below it has been seen.
template <class Source, class Formula>
class KeyPass {
 public:
  struct Inputs {
    const LitPlate& plate;
    std::span<const std::uint8_t> garbage, core;
    float noise;                       // of alpha, one sigma; 0 = no smoothing
    std::span<const CodeBounds> bare;  // codes of each 8x8 pixels that are screen at a glance
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
        order_(channels_of(in.plate.colour)),
        padded_(
            static_cast<std::size_t>((in.plate.width + key_lanes - 1) / key_lanes * key_lanes)) {
    const std::size_t stride = padded_ + 2 * key_lanes;
    plate_stride_ = padded_ + 4 * key_lanes;
    scratch.rows.resize(stride * 8 + 12 * plate_stride_);
    plate_rows_ = scratch.rows.data() + stride * 8;
    float* row = scratch.rows.data() + key_lanes;
    for (std::size_t i = 0; i < 3; ++i)
      alpha_[i] = row + 2 * i * stride, change_[i] = row + (2 * i + 1) * stride;
    for (std::size_t i = 0; i < 2; ++i) spill_[i] = row + (6 + i) * stride;
    scratch.clear.resize(2 * (padded_ / key_lanes));
    const std::size_t cells = padded_ * static_cast<std::size_t>(in.plate.height);
    if (scratch.previous.size() != cells) {
      scratch.previous.assign(cells, 0);
      scratch.has_previous = false;
    }
    clear_ = scratch.clear.data();
    smooths_ = in.noise > 0 && scratch.has_previous;
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
  std::size_t slot(int y) const { return static_cast<std::size_t>(y) % 3; }
  std::uint16_t* previous(int y) const {
    return scratch_.previous.data() + static_cast<std::size_t>(y) * padded_;
  }
  int count_at(int x) const { return std::min(key_lanes, in_.plate.width - x); }

  // The plate at eight pixels.
  F8 plate_at_lanes(int x, std::size_t channel) const {
    const F8 top = load_lanes(above_ + channel * plate_stride_ + x);
    if (down_ == 0) return top;
    return top + down_ * (load_lanes(below_ + channel * plate_stride_ + x) - top);
  }

  // A row of plate cells, as wide as the frame: four rows of floats, kept while they are near.
  const float* wide_row(int row) {
    const auto slot = static_cast<std::size_t>(row) % 3;
    float* wide = plate_rows_ + slot * 4 * plate_stride_;
    if (wide_rows_[slot] == row) return wide;
    wide_rows_[slot] = row;
    const LitPlate& plate = in_.plate;
    using F4 = float __attribute__((vector_size(16)));
    constexpr F4 weight{.125F, .375F, .625F, .875F};
    for (std::size_t c = 0; c < 4; ++c) {
      float* to = wide + c * plate_stride_;
      const float* cell = plate.cell(row, 0) + c;
      if (plate.step == 1) {
        for (int x = 0; x < plate.columns; ++x) to[x] = cell[4 * x];
        for (std::size_t x = static_cast<std::size_t>(plate.columns); x < padded_; ++x)
          to[x] = to[x - 1];
        continue;
      }
      // Pixels lie between the centres of cells at eighths.
      to[0] = to[1] = cell[0];
      to += 2;
      for (int column = 0; column < plate.columns; ++column, to += 4) {
        const float a = cell[4 * column], b = cell[4 * std::min(column + 1, plate.columns - 1)];
        const F4 four = a + weight * (b - a);
        std::memcpy(to, &four, sizeof four);
      }
      const float* end = wide + c * plate_stride_ + padded_;
      for (; to < end; ++to) *to = to[-1];
    }
    return wide;
  }

  void place_plate(int y) {
    const LitPlate& plate = in_.plate;
    const float at =
        std::clamp((static_cast<float>(y) + 0.5F) / static_cast<float>(plate.step) - 0.5F, 0.0F,
                   static_cast<float>(plate.rows - 1));
    const int row = static_cast<int>(at);
    down_ = at - static_cast<float>(row);
    above_ = wide_row(row);
    below_ = wide_row(std::min(row + 1, plate.rows - 1));
  }

  std::array<F8, 3> plate_colour(int x) const {
    return {plate_at_lanes(x, 0), plate_at_lanes(x, 1), plate_at_lanes(x, 2)};
  }

  void see_row(int y) {
    place_plate(y);
    float* alpha = alpha_[slot(y)];
    float* change = change_[slot(y)];
    float* spill = spill_[static_cast<std::size_t>(y) % 2];
    const std::uint16_t* before = previous(y);
    const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(in_.plate.width);
    for (int x = 0; x < in_.plate.width; x += key_lanes) {
      const int count = count_at(x);
      char& clear = clear_[static_cast<std::size_t>(y) % 2 * (padded_ / key_lanes) +
                           static_cast<std::size_t>(x / key_lanes)];
      clear = is_clear(y, x, count, before + x);
      if (clear) {
        store_lanes(change + x, F8{});
        continue;
      }
      std::array<F8, 3> c;
      source_.load(y, x, count, c);
      TexelMatte<F8> matte = formula_.matte(c, plate_colour(x), plate_at_lanes(x, 3));
      if (!in_.garbage.empty() || !in_.core.empty())
        apply_masks(at + static_cast<std::size_t>(x), count, matte);
      store_lanes(alpha + x, matte.alpha);
      store_lanes(spill + x, matte.spill);
      if (!smooths_) continue;
      const F8 d = matte.alpha - load_previous(before + x);
      store_lanes(change + x, d < 0.0F ? -d : d);
    }
    change[-1] = change[0];
    change[in_.plate.width] = change[in_.plate.width - 1];
  }

  // Whether eight pixels are bare screen at a glance, and were clear before.
  bool is_clear(int y, int x, int count, const std::uint16_t* before) const {
    if constexpr (std::is_same_v<Source, CodeRows>) {
      if (in_.bare.empty() || count < key_lanes) return false;
      const auto block =
          static_cast<std::size_t>(y / 8) * (padded_ / 8) + static_cast<std::size_t>(x / 8);
      if (!source_.within(y, x, in_.bare[block])) return false;
      std::array<std::uint64_t, 2> codes;
      std::memcpy(codes.data(), before, sizeof codes);
      return (codes[0] | codes[1]) == 0;
    }
    return false;
  }

  void apply_masks(std::size_t at, int count, TexelMatte<F8>& matte) const {
    for (int i = 0; i < count; ++i) {
      const std::size_t pixel = at + static_cast<std::size_t>(i);
      if (!in_.core.empty()) {
        matte.alpha[i] = std::max(matte.alpha[i], static_cast<float>(in_.core[pixel]) / 255);
      }
      if (!in_.garbage.empty()) matte.alpha[i] *= 1 - static_cast<float>(in_.garbage[pixel]) / 255;
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
    place_plate(y);
    const int height = in_.plate.height;
    const float* alpha = alpha_[slot(y)];
    const float* spill = spill_[static_cast<std::size_t>(y) % 2];
    const std::array<const float*, 3> around{change_[slot(std::max(y - 1, 0))], change_[slot(y)],
                                             change_[slot(std::min(y + 1, height - 1))]};
    const float per_noise = smooths_ ? 1 / (9 * in_.noise) : 0;
    capture::Half* to = &keyed_.pixels[keyed_.index(y, 0)];
    std::uint16_t* before = previous(y);
    for (int x = 0; x < in_.plate.width; x += key_lanes, to += 4 * key_lanes) {
      const int count = count_at(x);
      if (clear_[static_cast<std::size_t>(y) % 2 * (padded_ / key_lanes) +
                 static_cast<std::size_t>(x / key_lanes)]) {
        write_clear(count, to);
        continue;
      }
      TexelMatte<F8> matte{load_lanes(alpha + x), load_lanes(spill + x)};
      if (smooths_) {
        F8 sum{};
        for (const float* row : around) {
          sum += load_lanes(row + x - 1) + load_lanes(row + x) + load_lanes(row + x + 1);
        }
        const F8 zero{}, one = all_of(1);
        const F8 moved = (sum * per_noise - calm) * (1 / (moving - calm));
        const F8 gain =
            least_gain_of_change + (1 - least_gain_of_change) * least(most(moved, zero), one);
        const F8 old = load_previous(before + x);
        matte.alpha = old + gain * (matte.alpha - old);
        // What never gets there in codes of 1/65535 is there.
        matte.alpha = matte.alpha < 0.002F ? zero : matte.alpha > 0.998F ? one : matte.alpha;
      }
      if (in_.noise > 0) {
        store_previous(before + x, matte.alpha);
        // Noise of bare screen is above 0 only, and so would leave a haze.
        const float haze = in_.noise * haze_of_noise;
        matte.alpha = least(matte.alpha, most(2 * (matte.alpha - haze), F8{}));
      }
      if (!any_of(matte.alpha > 0.0F)) {
        write_clear(count, to);
        continue;
      }
      std::array<F8, 3> c;
      source_.load(y, x, count, c);
      const auto texel = formula_.foreground(c, plate_colour(x), matte);
      write(texel, count, to);
    }
  }

  void write(const KeyedTexel<F8>& texel, int count, capture::Half* to) {
    std::array<F8, 4> rgba;
    rgba[static_cast<std::size_t>(order_[0])] = texel.first;
    rgba[static_cast<std::size_t>(order_[1])] = texel.second;
    rgba[static_cast<std::size_t>(order_[2])] = texel.third;
    for (std::size_t c = 0; c < 3; ++c) rgba[c] = least(rgba[c], all_of(capture::half_max));
    rgba[3] = texel.alpha;
    const F8 part = texel.alpha * (1.0F - texel.alpha);
    const I8 soft = part > 0.0475F;  // .05 < alpha < .95
    if (count == key_lanes) {
      if (any_of(soft)) {
        for (int i = 0; i < key_lanes; ++i) soft_ -= soft[i];
      }
      write_eight(rgba, to);
      return;
    }
    for (int i = 0; i < count; ++i) {
      soft_ -= soft[i];
      for (std::size_t c = 0; c < 4; ++c) *to++ = capture::half_from_float(rgba[c][i]);
    }
  }

  static void write_clear(int count, capture::Half* to) {
    if (count == key_lanes) {
      std::memset(to, 0, 4 * sizeof *to * key_lanes);  // of known size: two stores
    } else {
      std::fill_n(to, 4 * count, capture::Half{0});
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
  std::array<int, 3> order_;
  std::size_t padded_;
  std::array<float*, 3> alpha_{}, change_{};
  std::array<float*, 2> spill_{};
  char* clear_ = nullptr;
  const float* above_ = nullptr;
  const float* below_ = nullptr;
  float down_ = 0;
  float* plate_rows_ = nullptr;
  std::size_t plate_stride_ = 0;
  std::array<int, 3> wide_rows_{-1, -1, -1};
  bool smooths_ = false;
  std::int64_t soft_ = 0;
};

}  // namespace compositing
