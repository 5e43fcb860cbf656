// Keyed pixels on their way into a frame, eight of a row at a time, and what the next frame needs
// of them: for the passes over frames.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "capture/half.h"
#include "compositing/key_lanes.h"
#include "compositing/key_scratch.h"
#include "compositing/key_texel.h"

namespace compositing {

// How smoothing tells noise from motion: mean change of alpha over 3x3 pixels, in units of the
// noise; what is below `calm` moves by `least_gain_of_change` of the way, what is above `moving` at
// once.
inline constexpr float calm = 1.0F, moving = 2.0F, least_gain_of_change = 0.2F;
// Alpha below this share of the noise is none; from twice of it on it is as it was.
inline constexpr float haze_of_noise = 0.6F;
// More would take from alpha of 1, too.
inline constexpr float most_haze = 0.5F;
// One pixel alone of eight in a row is a speck of noise up to so many times of that: what is bare
// then stays bare over wide stretches, which rays pass at once.
inline constexpr float speck_of_haze = 3, most_of_speck = 0.25F;

class KeyStore {
 public:
  // (height, width, 4), and where it may not be 0: see KeyedFrame.
  struct Outputs {
    capture::Half* pixels;
    std::uint8_t* written;
  };

  // Forgets the frame before if it was of another size. `noise` is of alpha, one sigma.
  KeyStore(const LitPlate& plate, float noise, KeyScratch& scratch, const Outputs& out)
      : scratch_(scratch),
        out_(out),
        width_(static_cast<std::size_t>(plate.width)),
        across_((width_ + key_lanes - 1) / key_lanes),
        haze_(std::min(noise * haze_of_noise, most_haze)) {
    const std::size_t rows = 8 * static_cast<std::size_t>((plate.height + 7) / 8);
    if (scratch.past.size() != across_ * rows || !scratch.has_previous) {
      scratch.previous.assign(across_ * rows * key_lanes, 0);
      scratch.past.assign(across_ * rows, KeyPast::clear);
      scratch.has_previous = false;
    }
    const auto order = channels_of(plate.colour);
    for (std::size_t i = 0; i < 3; ++i) place_of_[static_cast<std::size_t>(order[i])] = i;
  }

  std::size_t across() const { return across_; }  // blocks of a row
  // How many pixels were put that are neither clear nor whole.
  std::int64_t soft() const { return soft_; }

  KeyPast past(int y, int x) const { return scratch_.past[block_at(y, x)]; }
  const std::uint16_t* previous(int y, int x) const { return &scratch_.previous[alpha_at(y, x)]; }
  static F8 load(const std::uint16_t* from) {
    using U8 = std::uint16_t __attribute__((vector_size(16)));
    U8 codes;
    std::memcpy(&codes, from, sizeof codes);
    return __builtin_convertvector(codes, F8) * (1.0F / 65535);
  }

  // Calls for the memory of 8x8 pixels some time before it is needed.
  void prefetch(int top, int x, int rows) const {
    const std::size_t block = block_at(top, x) / 8;
    const std::uint16_t* const alpha = &scratch_.previous[8 * key_lanes * block];
    __builtin_prefetch(alpha), __builtin_prefetch(alpha + 4 * key_lanes);
    for (int row = 0; row < rows; ++row) __builtin_prefetch(pixels(top + row, x), 1);
  }

  // Whether anything of a block of 8x8 pixels was not clear, or may still be written.
  bool has_any_before(std::size_t block) const {
    std::uint64_t past, written;
    std::memcpy(&past, &scratch_.past[8 * block], sizeof past);
    std::memcpy(&written, out_.written + 8 * block, sizeof written);
    return (past | written) != 0;
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

  // Keeps smoothed alpha; alpha of bare screen is noise, which is above 0 only, and so would leave
  // a haze: it is taken away.
  void keep(int y, KeyBlock& block) { keep(y, block.x, block.matte.alpha); }
  void keep(int y, int x, F8& alpha) {
    KeyPast past = KeyPast::mixed;
    if (!any_of(alpha < 1.0F)) past = KeyPast::whole;
    if (!any_of(alpha > haze_)) past = any_of(alpha > 0.0F) ? KeyPast::faint : KeyPast::clear;
    scratch_.past[block_at(y, x)] = past;
    if (past == KeyPast::mixed || past == KeyPast::faint)
      store(&scratch_.previous[alpha_at(y, x)], alpha);
    alpha = least(alpha, most(2 * (alpha - haze_), F8{}));
    if (count_of(alpha > 0.0F) == 1 &&
        !any_of(alpha > std::min(speck_of_haze * haze_, most_of_speck)))
      alpha = F8{};
  }
  // The same of row `row` of a block of 8x8 pixels, in halves and without a branch or a look for
  // specks; and what alpha was.
  void keep_quickly(std::size_t block, std::size_t row, F8& alpha) {
    scratch_.past[8 * block + row] = any_of(alpha > haze_) ? KeyPast::mixed : KeyPast::faint;
    store_halves(&scratch_.previous[key_lanes * (8 * block + row)], alpha);
    alpha = least(alpha, most(2 * (alpha - haze_), F8{}));
  }
  F8 quick_before(std::size_t block, std::size_t row) const {
    const auto past = static_cast<std::size_t>(scratch_.past[8 * block + row]);
    return load_halves(&scratch_.previous[key_lanes * (8 * block + row)], past);
  }
  // The same of a block of 8x8 pixels that are whole.
  void keep_whole(std::size_t block) {
    static_assert(sizeof(KeyPast) == 1);
    std::memset(&scratch_.past[8 * block], static_cast<int>(KeyPast::whole), 8);
  }

  void clear_pixels(int y, int x, int count) {
    std::uint8_t& written = out_.written[block_at(y, x)];
    if (written == 0) return;
    std::fill_n(pixels(y, x), 4 * count, capture::Half{0});
    written = 0;
  }
  void mark_written(int y, int x) { out_.written[block_at(y, x)] = 1; }
  // The first rows of a block, which at the lower edge has no more.
  void mark_written(std::size_t block, int rows) {
    std::memset(out_.written + 8 * block, 1, static_cast<std::size_t>(rows));
  }
  void mark_written(std::size_t block, std::size_t row, bool written) {
    out_.written[8 * block + row] = written ? 1 : 0;
  }

  // Returns whether there are eight, of which half or more are neither clear nor whole.
  bool write(const KeyedTexel<F8>& texel, int count, capture::Half* to) {
    const F8 part = texel.alpha * (1.0F - texel.alpha);
    const I8 soft = part > 0.0475F;  // .05 < alpha < .95
    if (count == key_lanes) {
      const int softs = count_of(soft);
      soft_ += softs;
      write_eight(in_order(texel), to);
      return 2 * softs >= key_lanes;
    }
    const auto rgba = in_order(texel);
    for (int i = 0; i < count; ++i) {
      soft_ -= soft[i];
      for (std::size_t c = 0; c < 4; ++c) *to++ = capture::half_from_float(rgba[c][i]);
    }
    return false;
  }
  // Eight that are whole, in the picture's order.
  static void write_whole(const std::array<F8, 3>& rgb, capture::Half* to) {
    const F8 limit = all_of(capture::half_max);
    write_eight({least(rgb[0], limit), least(rgb[1], limit), least(rgb[2], limit), all_of(1)}, to);
  }

  capture::Half* pixels(int y, int x) const {
    return out_.pixels + 4 * (static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x));
  }

 private:
  std::size_t block_at(int y, int x) const {
    return 8 * (static_cast<std::size_t>(y / 8) * across_ + static_cast<std::size_t>(x / 8)) +
           static_cast<std::size_t>(y % 8);
  }
  std::size_t alpha_at(int y, int x) const { return key_lanes * block_at(y, x); }
  static void store(std::uint16_t* to, F8 alpha) {
    using U8 = std::uint16_t __attribute__((vector_size(16)));
    const U8 codes = __builtin_convertvector(to_int_lanes(alpha * 65535.0F + 0.5F), U8);
    std::memcpy(to, &codes, sizeof codes);
  }

  // Halves of alpha, for quick keying; as read, 0 of what was clear and 1 of what was whole.
  static void store_halves(std::uint16_t* to, F8 alpha) {
#if defined(__F16C__)
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to),
                     _mm256_cvtps_ph(std::bit_cast<__m256>(alpha), _MM_FROUND_TO_NEAREST_INT));
#else
    for (int i = 0; i < key_lanes; ++i) to[i] = capture::half_from_float(alpha[i]);
#endif
  }
  static F8 load_halves(const std::uint16_t* from, std::size_t past) {
    static constexpr std::array<std::uint64_t, 4> kept{0, ~std::uint64_t{0}, ~std::uint64_t{0}, 0};
    static constexpr std::array<std::uint64_t, 4> set{0, 0, 0, 0x3C003C003C003C00U};
    std::array<std::uint64_t, 2> codes;
    std::memcpy(codes.data(), from, sizeof codes);
    for (std::uint64_t& code : codes) code = (code & kept[past]) | set[past];
#if defined(__F16C__)
    return std::bit_cast<F8>(_mm256_cvtph_ps(std::bit_cast<__m128i>(codes)));
#else
    std::array<std::uint16_t, key_lanes> halves;
    std::memcpy(halves.data(), codes.data(), sizeof codes);
    F8 alpha{};
    for (int i = 0; i < key_lanes; ++i)
      alpha[i] = capture::float_from_half(halves[static_cast<std::size_t>(i)]);
    return alpha;
#endif
  }

  // Red, green, blue and alpha, within what halves hold.
  std::array<F8, 4> in_order(const KeyedTexel<F8>& texel) const {
    const auto channel = [&](std::size_t place) {
      const F8 v = place == 0 ? texel.first : place == 1 ? texel.second : texel.third;
      return least(v, all_of(capture::half_max));
    };
    return {channel(place_of_[0]), channel(place_of_[1]), channel(place_of_[2]), texel.alpha};
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

  KeyScratch& scratch_;
  const Outputs out_;
  std::size_t width_;                      // pixels
  std::size_t across_;                     // blocks of a row
  float haze_;                             // alpha that is none
  std::array<std::size_t, 3> place_of_{};  // of red, green and blue in the keyer's order
  std::int64_t soft_ = 0;
};

}  // namespace compositing
