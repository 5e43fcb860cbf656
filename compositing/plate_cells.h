// What cells of a frame show of the plate's light: for the files that follow it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <vector>

#include "compositing/clean_plate.h"
#include "compositing/gap_filler.h"
#include "compositing/key_lanes.h"

namespace compositing {

inline constexpr float least_gain = 0.15F, most_gain = 2.5F;
inline constexpr float clipped_from = 0.985F;
// Of a cell's gain in its neighbourhood's light: deep shadow, and what is too dark to have a
// colour.
inline constexpr float deep_shadow = 0.25F, black_shadow = 0.03F;
// How far from screen in sight a place is near it, and from where on deep within what stands before
// it: in cells of a picture as high as those that the table is learned from. Hair is the wider the
// higher a picture is.
inline constexpr float near_cells = 1, deep_cells = 2, learned_height = 270;

// 1 in the first `count` lanes, 0 beyond.
inline F8 lanes_below(int count) {
  F8 v{};
  for (int i = 0; i < key_lanes; ++i) v[i] = i < count ? 1.0F : 0.0F;
  return v;
}

// Of pairs of neighbours: sums of a's in the lower part of each half, of b's in the upper.
inline F8 pair_sums(F8 a, F8 b) {
  return __builtin_shufflevector(a, b, 0, 2, 8, 10, 4, 6, 12, 14) +
         __builtin_shufflevector(a, b, 1, 3, 9, 11, 5, 7, 13, 15);
}

// The sum of each.
inline F8 sums_of(const std::array<F8, key_lanes>& v) {
  const F8 a = pair_sums(pair_sums(v[0], v[1]), pair_sums(v[2], v[3]));
  const F8 b = pair_sums(pair_sums(v[4], v[5]), pair_sums(v[6], v[7]));
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) +
         __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}

inline F8 chosen(I8 which, F8 value) { return std::bit_cast<F8>(which & std::bit_cast<I8>(value)); }
inline F8 size_of(F8 v) { return std::bit_cast<F8>(std::bit_cast<I8>(v) & 0x7FFFFFFF); }

// What is seen of one cell, in lanes to be summed.
struct CellSums {
  F8 alike{};  // pixels of the plate's colour that are lit by far not more nor less than it
  F8 gain{}, gain_squared{}, off{}, bright{};  // of those; how far off in units of the plate
  F8 dark{};                                   // pixels in deep shadow

  // Eight pixels and the plate's ratios there: 1 / first, and the others over it. `tolerance` is of
  // colour, against the primary.
  [[gnu::always_inline]] void add(const std::array<F8, 3>& c,
                                  const std::array<F8, 3>& ratios,
                                  I8 inside,
                                  float tolerance) {
    const F8 one = all_of(1);
    const F8 q = c[0] * ratios[0];
    const F8 d1 = less_times(c[1], c[0], ratios[1]), d2 = less_times(c[2], c[0], ratios[2]);
    const F8 away = size_of(d1) + size_of(d2);
    const I8 coloured = (away < tolerance * c[0]) & inside;
    const I8 like = coloured & (q > least_gain) & (q < most_gain);
    const F8 its_gain = chosen(like, q);
    dark += chosen(coloured & (q > black_shadow) & (q < deep_shadow), one);
    alike += chosen(like, one);
    gain += its_gain;
    gain_squared = times_plus(its_gain, its_gain, gain_squared);
    off += chosen(like, away * ratios[0]);
    bright += chosen(like & (c[0] >= clipped_from), one);
  }
};

// What is seen of all.
class SightSums {
 public:
  // Of eight cells: their gain, and whether it is known: 1 or 0. Where it is not, both are 0.
  struct Gains {
    F8 gain, known;
  };

  // `pixels` of each were looked at, 0 of those that show no screen; `spread` is of the gain within
  // a cell.
  [[gnu::always_inline]] Gains add(const std::array<CellSums, key_lanes>& cells,
                                   F8 pixels,
                                   float spread) {
    std::array<F8, key_lanes> alike, gain, squared, away, bright;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      alike[k] = cells[k].alike, gain[k] = cells[k].gain, squared[k] = cells[k].gain_squared;
      away[k] = cells[k].off, bright[k] = cells[k].bright;
      dark_ += cells[k].dark;
    }
    const F8 n = sums_of(alike), zero{}, one = all_of(1);
    const F8 over = one / (n > 0.0F ? n : one);
    const F8 gains = sums_of(gain), mean = gains * over;
    const F8 variance = sums_of(squared) * over - mean * mean;
    const F8 most_deviation = 0.02F * mean + spread;
    const I8 shows = pixels > 0.0F;
    const I8 good = shows & (n >= 0.6F * pixels) & (variance <= most_deviation * most_deviation);
    const Gains found{chosen(good, mean), chosen(good, one)};
    screen_ += chosen(shows, one), all_ += most(pixels, zero), seen_ += found.known;
    clipped_ += chosen(good, sums_of(bright) * over);
    off_ += chosen(good, sums_of(away) / most(gains, all_of(least_gain)));
    return found;
  }

  // Without the gain.
  PlateSight sight() const {
    const auto share = [](F8 part, F8 of) {
      const float whole = sum_of(of);
      return whole > 0 ? sum_of(part) / whole : 0.0F;
    };
    PlateSight sight;
    sight.has_screen = sum_of(screen_) > 0;
    sight.screen = share(seen_, screen_);
    sight.clipped = share(clipped_, seen_);
    sight.shadowed = share(dark_, all_);
    sight.mismatch = share(off_, seen_);
    return sight;
  }

 private:
  F8 screen_{}, all_{}, seen_{}, clipped_{}, off_{}, dark_{};
};

// Gains of cells, filled, made smooth. Both are of the filler's size.
void smooth_gains(const GapFiller& filler, std::vector<float>& blurred, std::vector<float>& gains);

// Gain of each cell whose pixels have the plate's colour, all about equally bright, by eight cells
// of a row at a time: look(sums, cell, row, column) adds up what one shows. `pixels` tells of each
// cell how many are looked at, 0 = it shows no screen; `shown` is which are known.
template <class Look>
PlateSight measure_cells(GapFiller& filler,
                         const std::vector<float>& pixels,
                         float spread,
                         std::vector<float>& shown,
                         const Look& look) {
  SightSums all;
  for (int row = 0; row < filler.rows(); ++row) {
    for (int first = 0; first < filler.columns(); first += key_lanes) {
      const int cells = std::min(key_lanes, filler.columns() - first);
      const std::size_t at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(filler.columns()) +
          static_cast<std::size_t>(first);
      const auto bytes = static_cast<std::size_t>(cells) * sizeof(float);
      F8 count{};
      std::memcpy(&count, &pixels[at], bytes);
      std::array<CellSums, key_lanes> sums;
      for (int i = 0; i < cells; ++i) {
        const auto lane = static_cast<std::size_t>(i);
        if (pixels[at + lane] > 0) look(sums[lane], at + lane, row, first + i);
      }
      const auto [gain, known] = all.add(sums, count, spread);
      std::memcpy(filler.value(row, first), &gain, bytes);
      std::memcpy(&filler.weight(row, first), &known, bytes);
      std::memcpy(&shown[at], &known, bytes);
    }
  }
  return all.sight();
}

}  // namespace compositing
