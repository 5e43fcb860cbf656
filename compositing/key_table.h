// What a colour before a screen is most likely to be: alpha and share of the plate, learned.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compositing/key_lanes.h"
#include "compositing/screen_colour.h"

namespace compositing {

// Where a colour lies in the table: the screen's share k = excess / excess of the plate, then, of
// what is left without k times the plate, how bright the other two channels are against the plate's
// excess, and which of them is more. So bare screen is at k = 1 and 0, however pale it is.
inline constexpr int table_shares = 33, table_lights = 19, table_hues = 17;
// The share at the first place, and over how much more the places go.
inline constexpr float least_table_share = -0.25F, table_share_range = 1.5F;
// Brightness b, the sum of what is left of the two channels, is at b / (b + .3) of this many
// places: up to 2.65, for cloth that is yellow or pale green is told from a mixture by being
// brighter than what shines through half could be.
inline constexpr float table_half_light = 0.3F, table_light_scale = 20;

template <class V>
struct TablePlace {
  V share;  // 0 .. table_shares - 1
  V light;  // 0 .. table_lights - 1
  V hue;    // 0 .. table_hues - 1, of which the nearest counts
};

inline float lanes_like(float, float value) { return value; }
inline F8 lanes_like(F8, float value) { return all_of(value); }

// `share` = k; `second` and `third`: what is left of those channels, over the plate's excess.
template <class V>
[[gnu::always_inline]] inline TablePlace<V> place_in_table(V share, V second, V third) {
  const V zero = lanes_like(share, 0), one = lanes_like(share, 1);
  const V k = least(most((share - least_table_share) * (1 / table_share_range), zero), one);
  const V sum = most(second + third + 0.05F, zero);
  const V light = least(sum / (sum + table_half_light) * table_light_scale,
                        lanes_like(share, table_lights - 1));
  const V hue = least(most((second - third) / (sum + 0.1F), -one), one);
  return {k * static_cast<float>(table_shares - 1), light,
          (hue * 0.5F + 0.5F) * static_cast<float>(table_hues - 1)};
}

// Alpha, and the share of the plate that is to be taken away: 1 - alpha and the spill.
template <class V>
struct TableEntry {
  V alpha;
  V plate;
};

// Codes 0..255 of alpha and plate at each place.
using PlaceCodes = std::array<std::uint8_t, 2 * table_shares * table_lights * table_hues>;
constexpr std::size_t code_at(int share, int light, int hue) {
  return 2 * static_cast<std::size_t>((hue * table_shares + share) * table_lights + light);
}

// What a colour means depends on where it is seen: what is a thin thing near the screen is mostly
// spill deep within a person.
struct TableCodes {
  PlaceCodes near;
  PlaceCodes deep;
};

// The table that ships: made by train_key_table() (key_training.h), written by make_key_table.
const TableCodes& shipped_key_table();

// Ready for look-up: the four corners of each square together, so that a look-up is two loads.
class KeyTable {
 public:
  explicit KeyTable(const TableCodes& codes);

  // Between four places: which, and how far in shares and lights.
  template <class V>
  struct Square {
    decltype(to_int_lanes(V{})) index;
    V across_shares;
    V across_lights;
  };
  template <class V>
  [[gnu::always_inline]] static Square<V> square_of(const TablePlace<V>& place) {
    const auto share =
        to_int_lanes(least(place.share, lanes_like(place.share, table_shares - 1.5F)));
    const auto light =
        to_int_lanes(least(place.light, lanes_like(place.share, table_lights - 1.5F)));
    const auto hue = to_int_lanes(place.hue + 0.5F);
    return {hue * squares + share * squares_across + light, place.share - to_float_lanes(share),
            place.light - to_float_lanes(light)};
  }
  // Near the screen, or, by deep(), deep within what stands before it.
  template <class V>
  [[gnu::always_inline]] TableEntry<V> at(const Square<V>& square) const {
    const auto both = words(square.index);
    return {blended<V>(both.alpha, square.across_shares, square.across_lights),
            blended<V>(both.plate, square.across_shares, square.across_lights)};
  }
  template <class V>
  [[gnu::always_inline]] static Square<V> deep(Square<V> square) {
    square.index = square.index + squares * table_hues;
    return square;
  }

 private:
  void pack(const PlaceCodes& codes);

  static constexpr int squares_across = table_lights - 1;
  static constexpr int squares = (table_shares - 1) * squares_across;

  // Four codes of alpha and four of plate at each square, lowest byte first: (0, 0), (0, 1), (1,
  // 0), (1, 1) in (share, light).
  template <class I>
  struct Words {
    I alpha;
    I plate;
  };
  [[gnu::always_inline]] Words<std::int32_t> words(std::int32_t at) const {
    const std::uint64_t both = words_[static_cast<std::size_t>(at)];
    return {static_cast<std::int32_t>(both), static_cast<std::int32_t>(both >> 32)};
  }
  [[gnu::always_inline]] Words<I8> words(I8 at) const {
#if defined(__AVX2__)
    // Plain loads: a gather of the processor takes longer.
    alignas(32) std::int32_t i[key_lanes];
    std::memcpy(i, &at, sizeof i);
    const auto word = [&](int lane) {
      return static_cast<long long>(words_[static_cast<std::size_t>(i[lane])]);
    };
    const auto low = std::bit_cast<__m256>(_mm256_set_epi64x(word(5), word(4), word(1), word(0)));
    const auto high = std::bit_cast<__m256>(_mm256_set_epi64x(word(7), word(6), word(3), word(2)));
    return {std::bit_cast<I8>(_mm256_shuffle_ps(low, high, 0x88)),
            std::bit_cast<I8>(_mm256_shuffle_ps(low, high, 0xDD))};
#else
    Words<I8> both{};
    for (int lane = 0; lane < key_lanes; ++lane) {
      const Words<std::int32_t> one = words(at[lane]);
      both.alpha[lane] = one.alpha;
      both.plate[lane] = one.plate;
    }
    return both;
#endif
  }

  template <class V, class I>
  [[gnu::always_inline]] static V blended(I codes, V u, V v) {
    const V a = to_float_lanes(codes & 255), b = to_float_lanes((codes >> 8) & 255);
    const V c = to_float_lanes((codes >> 16) & 255);
    const V d = to_float_lanes((codes >> 24) & 255);
    return between(between(a, b, v), between(c, d, v), u) * (1.0F / 255);
  }

  std::vector<std::uint64_t> words_;  // near, then deep
};

}  // namespace compositing
