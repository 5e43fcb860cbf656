// Keying whole frames, and how sure that is.
#include "compositing/keyer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "compositing/background_subtraction.h"
#include "compositing/key_glance.h"
#include "compositing/key_pass.h"
#include "compositing/quick_pass.h"

namespace compositing {
namespace {

using capture::HalfImage;

using Three = std::array<F8, 3>;

template <bool two_primaries>
struct ScreenFormula {
  KeyDials dials;
  static constexpr bool knows_near = true;  // how near the screen is matters
  TexelShare<F8> share(const Three& c, const Three& p, F8 over_excess) const {
    return share_of<two_primaries>(c, p, over_excess, dials);
  }
  TexelMatte<F8> matte(const Three&, const Three&, F8 over_excess, const TexelShare<F8>& s) const {
    return matte_of(s, over_excess, dials);
  }
  TexelMatte<F8> matte_between(F8 over_excess, F8 near, const TexelShare<F8>& s) const {
    return compositing::matte_between(s, over_excess, near, dials);
  }
  KeyedTexel<F8> foreground(const Three& c, const Three& p, const TexelMatte<F8>& matte) const {
    return foreground_of<two_primaries>(c, p, matte, dials);
  }
};

// What has no screen behind it has no colour of one to take out.
constexpr KeyDials no_despill{.despill = 0};

struct DifferenceFormula {
  KeyDials dials;
  static constexpr bool knows_near = false;
  TexelShare<F8> share(const Three&, const Three&, F8) const { return TexelShare<F8>(); }
  TexelMatte<F8> matte(const Three& c, const Three& p, F8 over_noise, const TexelShare<F8>&) const {
    return difference_matte(c, p, over_noise, dials);
  }
  KeyedTexel<F8> foreground(const Three& c, const Three& p, const TexelMatte<F8>& matte) const {
    return foreground_of<true>(c, p, matte, no_despill);
  }
};

const KeyTable& shipped_table() {
  static const KeyTable table(shipped_key_table());
  return table;
}

PlateUse use_of(KeyMethod method) {
  return method == KeyMethod::screen ? PlateUse::screen : PlateUse::difference;
}

void check(const KeySettings& s) {
  const auto within = [](float value, float low, float high, const char* name) {
    if (value >= low && value <= high) return;
    throw std::invalid_argument("key setting " + std::string(name) + " is " +
                                std::to_string(value) + ", not " + std::to_string(low) + " to " +
                                std::to_string(high));
  };
  within(s.screen, 0, 0.95F, "screen");
  within(s.core, 0.05F, 1, "core");
  if (!(s.core > s.screen)) throw std::invalid_argument("key setting core is not above screen");
  within(s.edge, -1, 1, "edge");
  within(s.despill, 0, 2, "despill");
  within(s.smoothing, 0, 4, "smoothing");
}

// Of each 8x8 pixels whether any is covered; empty if none is.
std::vector<std::uint8_t> masked_blocks(const KeyMasks& masks, int height, int width) {
  const std::size_t across = (static_cast<std::size_t>(width) + 7) / 8;
  std::vector<std::uint8_t> masked;
  for (const auto* mask : {&masks.garbage, &masks.core}) {
    for (std::size_t i = 0; i < mask->size(); ++i) {
      if ((*mask)[i] == 0) continue;
      masked.resize(across * ((static_cast<std::size_t>(height) + 7) / 8));
      const std::size_t y = i / static_cast<std::size_t>(width);
      masked[y / 8 * across + (i % static_cast<std::size_t>(width)) / 8] = 1;
    }
  }
  return masked;
}

// The camera is looked for in every so many frames; so far it may be off, in pixels.
constexpr int frames_between_looks = 3;
constexpr float shift_still_px = 1;

// Up to which value a key is sure, and from which on it is not at all.
struct Fall {
  float good, bad;
  // 1 up to `good`, 0 from `bad` on.
  float of(float value) const { return std::clamp((bad - value) / (bad - good), 0.0F, 1.0F); }
};

// What lowers the confidence. What the made scenes and stressors show of each is in
// keying_measured.md (Confidence).
// Share of the plate's screen in sight: made persons leave .64 of it and more. The other way about:
// up to the first it is as if none were, from the second on it lowers nothing.
constexpr Fall screen_in_sight{0.03F, 0.25F};
// Share of that which is at the camera's limit: none in the made scenes but "over-exposed", where
// nearly all is, and edges are twice as wrong as in "plain".
constexpr Fall screen_clipped{0.05F, 0.6F};
constexpr float least_if_clipped = 0.5F;
// Share of the screen with its colour, but less than a fourth of its light: at most .0014 in the
// made scenes, .008 to .015 under a shadow of .75.
constexpr Fall screen_shadowed{0.003F, 0.012F};
// Noise of the screen's share at a pixel: .02 in "plain", .07 in "noise"; .12 under 40 times the
// variance of "plain", where the error is five times as great.
constexpr Fall noise_of_share{0.06F, 0.2F};
// How far the screen is off the plate as lit, as a share of it: .01 in "plain", .04 in "noise"; .14
// where the screen has 3 % of display white.
constexpr Fall screen_unlike_plate{0.06F, 0.16F};
// Share of pixels that are neither screen nor person: .08 in "plain", .16 in "glass", .25 under
// such noise.
constexpr Fall neither_share{0.15F, 0.45F};
// Share of pixels deep within persons, single ones aside, that are neither screen nor person, where
// those are a hundredth of the picture and 16 cells or more: at most .24 in the made scenes, .26 in
// "green clothes", .56 to .66 of pale green, mint, olive and lime that come out half transparent.
constexpr Fall thin_within{0.3F, 0.85F};
constexpr float least_deep = 0.01F, least_deep_px = 16 * 64;
// Of a camera that was pushed, in pixels where it shows most: a look is right to a quarter of one,
// and found up to five (PlateWatch tests).
constexpr Fall camera_shift_px{shift_still_px, 4};
constexpr float least_if_moved = 0.5F, more_if_hardly_moved = 0.4F;
// What stands around is not where it was, and no camera's movement tells where it is.
constexpr float confidence_if_scattered = 0.55F;
// Share of the picture that shows the screen where the plate shows something else: none in the made
// scenes. What has gone stays as large a ghost, which is whole.
constexpr Fall screen_in_gaps{0.001F, 0.01F};
// Light over the plate's, and, with its sign changed, under it: .88 to 1.07 in the made scenes, .45
// before a plate too bright by 1.2, which changes nothing.
constexpr Fall gain_above_plate{1.7F, 2.3F}, gain_below_plate{-0.45F, -0.2F};

CleanPlate coloured(CleanPlate plate, std::optional<ScreenColour> colour) {
  plate.colour = colour.value_or(plate.colour);
  return plate;
}

}  // namespace

// Skin of tests and made persons, dark and light, has .79 to 1.02 and .36 to .6 of the others'
// mean, and .52 and .25 of its red at least.
SkinPrimary skin_before(ScreenColour colour) {
  if (colour == ScreenColour::green) return {0.8F, 0.5F};
  if (colour == ScreenColour::blue) return {0.46F, 0.22F};
  return {};  // red: skin has more of it than of the others
}

std::string_view name_of(KeyStatus status) {
  constexpr std::array<std::string_view, 11> names{"good",  "hidden", "clipped",  "shadowed",
                                                   "noisy", "misfit", "thin",     "moved",
                                                   "ghost", "unlit",  "no screen"};
  return names[static_cast<std::size_t>(status)];
}

Keyer::Keyer(CleanPlate plate, const KeySettings& settings, KeyMasks masks)
    : light_(coloured(std::move(plate), settings.screen_colour), use_of(settings.method)),
      watch_(light_.plate()),
      settings_(settings),
      masks_(std::move(masks)) {
  check(settings);
  const LitPlate& lit = light_.lit();
  const std::size_t pixels =
      static_cast<std::size_t>(lit.height) * static_cast<std::size_t>(lit.width);
  for (const auto& [mask, name] :
       {std::pair{&masks_.garbage, "garbage"}, std::pair{&masks_.core, "core"}}) {
    if (mask->empty() || mask->size() == pixels) continue;
    throw std::invalid_argument(std::string(name) + " mask has " + std::to_string(mask->size()) +
                                " pixels, the clean plate " + std::to_string(lit.width) + "x" +
                                std::to_string(lit.height));
  }
  masked_ = masked_blocks(masks_, lit.height, lit.width);
  gaps_.emplace(light_.bare(), masked_);
  dials_ = {settings.learned ? &shipped_table() : nullptr,
            settings.screen,
            1 / (settings.core - settings.screen),
            settings.edge,
            settings.despill,
            lit.colour == ScreenColour::yellow,
            skin_before(lit.colour)};
  if (settings.effort == KeyEffort::quick && settings.method == KeyMethod::screen &&
      settings.learned && !has_two_primaries(lit.colour)) {
    quick_.emplace(light_.bare(), light_.tolerance(), light_.spread());
  }
}

Keyer::Target Keyer::target(KeyedFrame& keyed) const {
  keyed.resize(light_.lit().height, light_.lit().width);
  return {keyed.image_.pixels.data(), keyed.written_.data()};
}

Keyer::Target Keyer::target(HalfImage& keyed) {
  const auto height = static_cast<std::size_t>(light_.lit().height);
  const auto width = static_cast<std::size_t>(light_.lit().width);
  keyed.height = light_.lit().height, keyed.width = light_.lit().width, keyed.channels = 4;
  keyed.pixels.assign(4 * height * width, 0);
  scratch_.written.assign(((height + 7) / 8) * 8 * ((width + 7) / 8), 0);
  return {keyed.pixels.data(), scratch_.written.data()};
}

KeyReport Keyer::key(const capture::Image& frame, KeyedFrame& keyed) {
  light_.check_size(frame.height, frame.width);
  return key_light(frame, target(keyed));
}
KeyReport Keyer::key(const CodedFrame& frame, KeyedFrame& keyed) {
  light_.check_size(frame.height, frame.width);
  return key_codes(frame, target(keyed));
}
KeyReport Keyer::key(const capture::Image& frame, HalfImage& keyed) {
  light_.check_size(frame.height, frame.width);
  return key_light(frame, target(keyed));
}
KeyReport Keyer::key(const CodedFrame& frame, HalfImage& keyed) {
  light_.check_size(frame.height, frame.width);
  return key_codes(frame, target(keyed));
}

KeyReport Keyer::key_light(const capture::Image& frame, const Target& target) {
  light_.check(frame);
  const LightRows rows(frame, channels_of(light_.plate().colour));
  if (quick_) {
    const PlateSight sight = quick_->update(rows, settings_.follows_light);
    watch(rows, sight.gain);
    return report(sight,
                  key_quickly(rows, std::span(quick_->light_bounds()), sigma(sight), target));
  }
  const PlateSight sight = light_.update(frame, settings_.follows_light);
  watch(rows, sight.gain);
  scratch_.bare_light.clear();
  if (glances()) bound_screen(light_.lit(), scratch_.bare_light);
  return report(sight, key_rows(rows, scratch_.bare_light, target));
}

KeyReport Keyer::key_codes(const CodedFrame& frame, const Target& target) {
  const auto order = channels_of(light_.plate().colour);
  light_.check(frame);
  const CodeRows rows(frame.rgba.data(), frame.width, order, light_polynomial(frame.transfer));
  if (quick_) {
    const PlateSight sight = quick_->update(rows, settings_.follows_light);
    watch(rows, sight.gain);
    const std::span bare(quick_->code_bounds(frame.transfer));
    return report(sight, key_quickly(rows, bare, sigma(sight), target));
  }
  const PlateSight sight = light_.update(frame, settings_.follows_light);
  watch(rows, sight.gain);
  scratch_.bare_codes.clear();
  if (glances()) bound_screen(light_.lit(), frame.transfer, order, scratch_.bare_codes);
  return report(sight, key_rows(rows, scratch_.bare_codes, target));
}

// One frame may be shaken; a camera that was pushed stays where it is, also while nothing tells.
template <class Rows>
void Keyer::watch(const Rows& rows, float gain) {
  if (looks_moved_ > 0) ++moved_for_;
  if (until_look_-- > 0) return;
  until_look_ = frames_between_looks;
  ghost_ = gaps_->look(rows, gain);
  const PlateShift seen = watch_.look(rows);
  looks_scattered_ = seen.scattered ? looks_scattered_ + 1 : 0;
  if (!seen.known) return;
  shift_ = seen;
  const bool off = shift_.farthest_px > shift_still_px + 4 * shift_.farthest_sigma_px;
  looks_moved_ = off ? looks_moved_ + 1 : 0;
  if (looks_moved_ < 2) moved_for_ = looks_moved_;
}

// Whether pixels may be told to be screen before they are keyed.
bool Keyer::glances() const {
  return masks_.core.empty() && settings_.method == KeyMethod::screen && settings_.learned &&
         !has_two_primaries(light_.lit().colour);
}

std::shared_ptr<const FilteredPlate> Keyer::shared_filtered() {
  if (!filtered_) filtered_ = std::make_shared<const FilteredPlate>(light_.bare());
  return filtered_;
}

KeyReport Keyer::follow(const capture::Image& frame) {
  const PlateSight sight = light_.update(frame, settings_.follows_light);
  watch(LightRows(frame, channels_of(light_.plate().colour)), sight.gain);
  return report(sight, {});
}

Keyer::Soft Keyer::soft_of(std::int64_t soft,
                           std::int64_t thin,
                           std::int64_t deep,
                           std::size_t pixels) {
  const auto all = static_cast<float>(pixels);
  return {static_cast<float>(soft) / all,
          static_cast<float>(thin) /
              std::max({static_cast<float>(deep), least_deep * all, least_deep_px})};
}

template <class Source>
Keyer::Soft Keyer::key_rows(const Source& source,
                            std::span<const typename Source::Bounds> bare,
                            const Target& target) {
  const LitPlate& lit = light_.lit();
  const std::size_t pixels =
      static_cast<std::size_t>(lit.height) * static_cast<std::size_t>(lit.width);
  const auto run = [&](const auto& formula) {
    using Pass = KeyPass<Source, std::decay_t<decltype(formula)>>;
    const float noise = settings_.smoothing * lit.sigma;
    Pass pass(source, formula, {lit, masks_.garbage, masks_.core, noise, bare}, scratch_,
              {target.pixels, target.written});
    const std::int64_t soft = pass.run();
    const auto& cells = lit.near.cells;
    const std::int64_t deep = std::count(cells.begin(), cells.end(), 0.0F);
    return soft_of(soft, pass.thin(), deep * ScreenNear::cell * ScreenNear::cell, pixels);
  };
  if (settings_.method == KeyMethod::difference) return run(DifferenceFormula{dials_});
  if (has_two_primaries(lit.colour)) return run(ScreenFormula<true>{dials_});
  return run(ScreenFormula<false>{dials_});
}

template <class Source>
Keyer::Soft Keyer::key_quickly(const Source& source,
                               std::span<const typename Source::Bounds> bare,
                               float sigma,
                               const Target& target) {
  const LitPlate& plate = light_.bare();
  const float noise = settings_.smoothing * sigma;
  QuickPass<Source> pass(
      source, {plate, *quick_, dials_, masks_.garbage, masks_.core, masked_, noise, bare}, scratch_,
      {target.pixels, target.written});
  const std::int64_t soft = pass.run();
  return soft_of(soft, pass.thin(), 64 * quick_->deep_blocks(),
                 static_cast<std::size_t>(plate.height) * static_cast<std::size_t>(plate.width));
}

KeyReport Keyer::report(const PlateSight& sight, const Soft& soft) const {
  KeyReport report;
  report.sight = sight;
  report.shift = shift_;
  report.moved = looks_moved_ > 1;
  report.moved_for = report.moved ? moved_for_ : 0;
  report.scattered = !report.moved && looks_scattered_ > 1;
  report.ghost = ghost_;
  report.soft = soft.soft;
  report.thin = soft.thin;
  const auto lower = [&](float by, KeyStatus status) {
    if (by < 1 && (report.confidence >= 1 || by < report.confidence)) report.status = status;
    report.confidence = std::min(report.confidence, by);
  };
  if (!sight.has_screen) {
    lower(0, KeyStatus::no_screen);
    return report;
  }
  lower(1 - screen_in_sight.of(sight.screen), KeyStatus::hidden);
  if (settings_.method == KeyMethod::screen) {
    lower(least_if_clipped + (1 - least_if_clipped) * screen_clipped.of(sight.clipped),
          KeyStatus::clipped);
    lower(screen_shadowed.of(sight.shadowed), KeyStatus::shadowed);
    lower(noise_of_share.of(sigma(sight)), KeyStatus::noisy);
    lower(thin_within.of(soft.thin), KeyStatus::thin);
  }
  lower(screen_unlike_plate.of(sight.mismatch), KeyStatus::misfit);
  lower(neither_share.of(soft.soft), KeyStatus::misfit);
  if (report.moved) {
    lower(least_if_moved + more_if_hardly_moved * camera_shift_px.of(shift_.farthest_px),
          KeyStatus::moved);
  }
  if (report.scattered) lower(confidence_if_scattered, KeyStatus::misfit);
  // Where a pushed camera shows the screen beside itself, that is why.
  lower(screen_in_gaps.of(ghost_), report.moved ? KeyStatus::moved : KeyStatus::ghost);
  lower(gain_above_plate.of(sight.gain) * gain_below_plate.of(-sight.gain), KeyStatus::unlit);
  return report;
}

namespace {

// What a texel shows of itself and of its cell of the plate, in the keyer's order.
template <class V>
KeyedTexel<V> key_before(const LitPlate& plate,
                         const KeyDials& dials,
                         const std::array<V, 3>& c,
                         const std::array<V, 3>& p,
                         V last,
                         V near) {
  if (plate.use == PlateUse::difference)
    return foreground_of<true>(c, p, difference_matte(c, p, last, dials), no_despill);
  if (has_two_primaries(plate.colour)) {
    return foreground_of<true>(c, p, matte_of<true>(c, p, last, near, dials), dials);
  }
  return foreground_of<false>(c, p, matte_of<false>(c, p, last, near, dials), dials);
}

}  // namespace

std::array<float, 4> key_texel(
    const LitPlate& plate, const KeyDials& dials, int y, int x, const std::array<float, 3>& light) {
  const float* cell = plate.cell(y / plate.step, x / plate.step);
  return key_texel(plate, dials, {y, x, light, {cell[0], cell[1], cell[2], cell[3]}});
}

std::array<float, 4> key_texel(const LitPlate& plate,
                               const KeyDials& dials,
                               const KeyPlace& place) {
  const auto& [y, x, light, cell] = place;
  const auto order = channels_of(plate.colour);
  const auto at = [&](std::size_t i) { return static_cast<std::size_t>(order[i]); };
  std::array<float, 3> c{};
  for (std::size_t i = 0; i < 3; ++i) {
    const float value = light[at(i)];
    c[i] = value > 0 && value < 1e9F ? value : 0;
  }
  const float near = plate.use == PlateUse::screen ? plate.near.at(y, x) : 0;
  const KeyedTexel<float> keyed =
      key_before<float>(plate, dials, c, {cell[0], cell[1], cell[2]}, cell[3], near);
  std::array<float, 4> rgba{0, 0, 0, keyed.alpha};
  rgba[at(0)] = keyed.first, rgba[at(1)] = keyed.second, rgba[at(2)] = keyed.third;
  return rgba;
}

void key_texels(const LitPlate& plate,
                const KeyDials& dials,
                std::span<const KeyPlace> places,
                std::span<std::array<float, 4>, key_lanes> rgba) {
  const auto order = channels_of(plate.colour);
  const auto at = [&](std::size_t i) { return static_cast<std::size_t>(order[i]); };
  std::array<std::array<float, key_lanes>, 3> light{};
  std::array<std::array<float, key_lanes>, 4> cells{};
  std::array<float, key_lanes> near{};
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto& [y, x, seen, cell] = places[k];
    for (std::size_t i = 0; i < 4; ++i) cells[i][k] = cell[i];
    for (std::size_t i = 0; i < 3; ++i) light[i][k] = seen[at(i)];
    if (plate.use == PlateUse::screen) near[k] = plate.near.at(y, x);
  }
  Three c, p;
  for (std::size_t i = 0; i < 3; ++i) {
    const F8 value = load_lanes(light[i].data());
    c[i] = (value > 0.0F) & (value < 1e9F) ? value : F8{};
    p[i] = load_lanes(cells[i].data());
  }
  const KeyedTexel<F8> keyed =
      key_before<F8>(plate, dials, c, p, load_lanes(cells[3].data()), load_lanes(near.data()));
  for (std::size_t k = 0; k < places.size(); ++k) {
    rgba[k][at(0)] = keyed.first[k], rgba[k][at(1)] = keyed.second[k];
    rgba[k][at(2)] = keyed.third[k], rgba[k][3] = keyed.alpha[k];
  }
}

}  // namespace compositing
