// The keyer's formula for one texel, or for eight.
#pragma once

#include <array>
#include <cstddef>

#include "compositing/clean_plate.h"
#include "compositing/key_table.h"

namespace compositing {

// How much of the screen's primary skin has at least, as a share of the mean of its two other
// channels, and of its red: what is dark skin must not pass for less of that with spill on it. 0
// bounds nothing.
struct SkinPrimary {
  float of_others = 0;
  float of_red = 0;
};
SkinPrimary skin_before(ScreenColour colour);

// How keyed alpha becomes the matte: what the settings come to.
struct KeyDials {
  const KeyTable* table = nullptr;  // null: the plain ratio
  float black = 0.01F;              // alpha at which the screen ends
  float scale = 1.02F;              // 1 / (alpha at which the person is whole - black)
  float edge = 0;                   // -1 thinner .. 1 fuller
  float despill = 1;                // share of the spill that is taken away
  bool tells_skin = false;          // of a yellow screen
  SkinPrimary skin{};               // of a screen of one primary
};

// Skin is much more red than green, but has a third or more of the colour of a yellow wall, and
// would be as clear as that. How much of such a wall a texel can be by red and green, which is
// nothing of skin, dark or light, and 1 of the wall; near that more, for the difference of two
// alike is noisy, and what is bare is told better by all three.
template <class V>
[[gnu::always_inline]] inline V share_without_skin(const std::array<V, 3>& c,
                                                   const std::array<V, 3>& p) {
  constexpr float green_of_skin = 0.6F;  // over its red, both over the plate's: of the palest
  constexpr float most_share = 4, more_near_screen = 0.4F;
  const V scale = most(p[0] * p[1] * (1 - green_of_skin), lanes_like(p[0], 1e-12F));
  V share = less_times(c[0] * p[1], c[1] * green_of_skin, p[0]) / scale;
  share = share + more_near_screen * most(share - 0.5F, lanes_like(share, 0));
  return least(most(share, lanes_like(share, -most_share)), lanes_like(share, most_share));
}

// Channels in the keyer's order.
template <class V>
struct KeyedTexel {
  V first, second, third;  // premultiplied
  V alpha;
};

// The matte of a texel before temporal smoothing: alpha, and the light of the screen on the person
// as a share of the plate.
template <class V>
struct TexelMatte {
  V alpha;
  V spill;
};

// How much of the screen a texel is, as far as one look tells: what its matte is made from.
template <class V>
struct TexelShare {
  V share;                     // of the plate's excess
  KeyTable::Square<V> square;  // where the table says what it means; 0 without a table
};

// `c` and `p` are light of texel and plate, scene-linear, in the keyer's order; `over_excess` is
// the last value of the plate's cell.
template <bool two_primaries, class V>
[[gnu::always_inline]] inline TexelShare<V> share_of(const std::array<V, 3>& c,
                                                     const std::array<V, 3>& p,
                                                     V over_excess,
                                                     const KeyDials& dials) {
  TexelShare<V> texel{};
  texel.share = screen_excess<two_primaries>(c[0], c[1], c[2]) * over_excess;
  if constexpr (two_primaries) {
    if (dials.tells_skin) texel.share = least(texel.share, share_without_skin(c, p));
  }
  if (dials.table == nullptr) return texel;
  // Of two primaries, the greater rest stands for the second channel.
  V second = less_times(c[1], texel.share, p[1]);
  if constexpr (two_primaries) second = most(second, less_times(c[0], texel.share, p[0]));
  const V third = less_times(c[2], texel.share, p[2]);
  texel.square =
      KeyTable::square_of(place_in_table(texel.share, second * over_excess, third * over_excess));
  return texel;
}

// The most spill, as a share of a yellow plate, on what red and green say is none of it: there
// skin, dark as it may be, stays within a tenth of itself.
inline constexpr float most_spill_on_skin = 0.012F;

// Alpha and share of the plate, as the table has them for a texel of that share, through the dials.
template <class V>
[[gnu::always_inline]] inline TexelMatte<V> dialled(V alpha,
                                                    V plate,
                                                    V share,
                                                    const KeyDials& dials) {
  const V zero = lanes_like(alpha, 0), one = lanes_like(alpha, 1);
  V spill = most(plate - (one - alpha), zero);
  if (dials.tells_skin) spill = least(spill, most(share, lanes_like(alpha, most_spill_on_skin)));
  alpha = least(most((alpha - dials.black) * dials.scale, zero), one);
  if (dials.edge != 0) alpha = alpha + dials.edge * alpha * (one - alpha);
  // What the dials have made more of the person than it is keeps no more of the screen for that.
  const V mixed = least(most((plate - 0.3F) * (1 / 0.3F), zero), one);
  spill = most(spill, times_plus(mixed, plate, alpha - one));
  return {alpha, spill};
}

// By the one part of the table in which the square lies: near the screen, or KeyTable::deep().
// Alpha is 1 where the plate shows no screen.
template <class V>
[[gnu::always_inline]] inline TexelMatte<V> matte_of(const TexelShare<V>& texel,
                                                     V over_excess,
                                                     const KeyDials& dials) {
  const V zero = lanes_like(over_excess, 0), one = lanes_like(over_excess, 1);
  V alpha = one - texel.share;
  V plate = least(most(texel.share, zero), one);
  if (dials.table != nullptr) {
    const auto entry = dials.table->at(texel.square);
    alpha = over_excess > 0.0F ? entry.alpha : one;
    plate = over_excess > 0.0F ? entry.plate : zero;
  }
  return dialled(alpha, plate, texel.share, dials);
}

// By both parts; `near` as in ScreenNear.
template <class V>
[[gnu::always_inline]] inline TexelMatte<V> matte_between(const TexelShare<V>& texel,
                                                          V over_excess,
                                                          V near,
                                                          const KeyDials& dials) {
  if (dials.table == nullptr) return matte_of(texel, over_excess, dials);
  const V zero = lanes_like(over_excess, 0), one = lanes_like(over_excess, 1);
  const auto deep = dials.table->at(KeyTable::deep(texel.square));
  const auto close = dials.table->at(texel.square);
  const V alpha = over_excess > 0.0F ? between(deep.alpha, close.alpha, near) : one;
  const V plate = over_excess > 0.0F ? between(deep.plate, close.plate, near) : zero;
  return dialled(alpha, plate, texel.share, dials);
}

template <bool two_primaries, class V>
[[gnu::always_inline]] inline TexelMatte<V> matte_of(const std::array<V, 3>& c,
                                                     const std::array<V, 3>& p,
                                                     V over_excess,
                                                     V near,
                                                     const KeyDials& dials) {
  return matte_between(share_of<two_primaries>(c, p, over_excess, dials), over_excess, near, dials);
}

// The most of the plate that can be on a texel if that is skin, dark as it may be, or anything that
// has more of the primary: what it has over skin. Something is likely, a twentieth of the texel;
// and what is redder than any skin is bound by nothing. (Made skin, .02 to .4 of green, and its
// shades: Keyer.DarkSkinKeepsItsColour.)
template <class V>
[[gnu::always_inline]] inline V most_on_skin(const std::array<V, 3>& c,
                                             const std::array<V, 3>& p,
                                             const SkinPrimary& skin) {
  constexpr float always = 0.06F, steep = 4;
  const float half = 0.5F * skin.of_others;
  const V over_skin = less_times(c[0], lanes_like(c[0], half), c[1] + c[2]);
  const V redder = steep * (skin.of_red * c[1] - c[0]);
  const V plate = less_times(p[0], lanes_like(c[0], half), p[1] + p[2]);
  return most(most(over_skin, always * c[0]), redder) / most(plate, lanes_like(plate, 1e-6F));
}

// The most that skin is green over blue, as a share of red over green.
inline constexpr float most_yellow_of_skin = 1.0F;

// The foreground that goes with a matte: what is left of the texel without the plate behind it and
// its spill. Never below 0, and 0 where alpha is.
template <bool two_primaries, class V>
[[gnu::always_inline]] inline KeyedTexel<V> foreground_of(const std::array<V, 3>& c,
                                                          const std::array<V, 3>& p,
                                                          const TexelMatte<V>& matte,
                                                          const KeyDials& dials) {
  const float despill = dials.despill;
  const V zero = lanes_like(matte.alpha, 0), one = lanes_like(matte.alpha, 1);
  const V clear = one - matte.alpha;
  V taken = times_plus(lanes_like(zero, despill < 1 ? despill : 1.0F), matte.spill, clear);
  if constexpr (!two_primaries) {
    if (dials.skin.of_others > 0) taken = most(least(taken, most_on_skin(c, p, dials.skin)), clear);
  }
  V f0 = most(less_times(c[0], taken, p[0]), zero), f1 = most(less_times(c[1], taken, p[1]), zero);
  V f2 = most(less_times(c[2], taken, p[2]), zero);
  if constexpr (!two_primaries) {
    // No more of the primary than of the greater of the two others, or, beyond 1, than their mean.
    const float harder = despill > 1 ? despill - 1 : 0;
    const float kept = despill < 1 ? 1 - despill : 0;
    V limit = most(f1, f2);
    if (harder > 0) limit = limit + harder * (0.5F * (f1 + f2) - limit);
    f0 = least(f0, kept > 0 ? limit + kept * f0 : limit);
  }
  if constexpr (two_primaries) {
    if (dials.tells_skin) {
      // No more yellow than skin is, nor more green than anything else.
      const float share = despill < 1 ? despill : 1.0F;
      const V yellow = least(f0, f1) - f2 - most_yellow_of_skin * most(f1 - f0, zero);
      const V over = share * most(yellow, zero);
      f0 = f0 - over, f1 = f1 - over;
      f0 = f0 - share * most(f0 - most(f1, f2), zero);
    }
  }
  f0 = matte.alpha > 0.0F ? f0 : zero;
  f1 = matte.alpha > 0.0F ? f1 : zero;
  f2 = matte.alpha > 0.0F ? f2 : zero;
  return {f0, f1, f2, matte.alpha};
}

}  // namespace compositing
