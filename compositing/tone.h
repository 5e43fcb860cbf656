// Tone mapping: a picture brighter than any display, onto one.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "capture/image.h"

namespace compositing {

// Schlick's rational curve of luminance L, out = p L / (p L - L + brightest): 0 stays 0,
// `brightest` and all above come out as 1, display white; the larger p >= 1 is, the brighter what
// is between. p = 1 is a plain scale, and with `brightest` = 1 nothing at all below white. Every
// pixel by itself, its colour kept: all channels by one factor.
//
// Schlick, "Quantization Techniques for Visualization of High Dynamic Range Pictures", Eurographics
// Workshop on Rendering 1994, section 2.
struct ToneCurve {
  float p = 1;
  float brightest = 0;  // luminance; 0 = no tone mapping

  bool is_on() const { return brightest > 0; }
  // 0 to 1 for any luminance; below 0, as much as at 0; NaN as 0.
  float operator()(float luminance) const;
  // By which a colour of that luminance is multiplied; finite.
  float factor(float luminance) const;
  friend bool operator==(const ToneCurve&, const ToneCurve&) = default;
};

// As render::FrameJob::tone carries it. Parameters that are no curve (not finite, below p = 1) are
// none.
std::array<float, 2> parameters_of(const ToneCurve& curve);
ToneCurve curve_of(const std::array<float, 2>& parameters);

// Tone-maps (n, 4) halves; alpha stays, as NaN does; infinities act as the largest half. `toned`
// may be `rgba`. Allocates nothing.
void apply_tone(const ToneCurve& curve,
                std::span<const capture::Half> rgba,
                std::span<capture::Half> toned);

// Luminances of a picture by which its curve is chosen.
struct PictureLevels {
  float darkest = 0;    // that one pixel in a hundred is below
  float middle = 0;     // the geometric mean
  float brightest = 0;  // that one pixel in a thousand is above
};
// Of the pixels of an (height, width, 4) image above 1/1024 and with finite luminance; nothing if
// there are none. The same whatever the number of threads.
std::optional<PictureLevels> measure_levels(const capture::HalfImage& rgba);

// The curve for a picture. Its brightest level becomes white, but what is below display white is
// not stretched to it. p is the least with which its darkest level is no harder to tell from black
// than it was (above one of 256 levels, Schlick's criterion for p), and with which its middle comes
// out at `key`; without a key, at the level that it has, up to 0.5: then a picture without anything
// brighter than white stays as it is. Nothing is brightened more than 64 times.
ToneCurve curve_for(const PictureLevels& levels, std::optional<float> key = std::nullopt);

}  // namespace compositing
