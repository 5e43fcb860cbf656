// Whether a frame's light fits the exposure that it is said to have, by what frames before it saw.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "capture/hdr.h"
#include "capture/thumbnail.h"

namespace capture {

// An exposure that a frame may have had, and those it is to be told from.
struct TriedExposure {
  double exposure_s = 0;
  double shorter_s = 0;  // the nearest in play; 0 = none
  double longer_s = 0;
  // That may have been in effect before, in upper rows, or come into effect in lower ones; 0 =
  // none.
  std::array<double, 8> before_s{};
  std::array<double, 8> after_s{};
};

enum class Fit {
  agrees,
  contradicts,  // another exposure, or other light
  silent,       // black or saturated: looks the same with the next shorter or longer exposure
};

struct FitResult {
  Fit fit = Fit::silent;
  bool tells = false;    // the next shorter and longer exposures would look different
  bool near = false;     // tells finely, too: values are those expected, not only nearest to them
  bool in_part = false;  // contradicts: other rows agree
  double agreeing = 0;   // the least share of values that do, over the exposures to tell it from
  int telling_least =
      0;  // values that tell the tried exposure from the one hardest to tell it from
};

// The radiance of a thumbnail's values as the newest frames tell it, with its uncertainty.
//
// A value v of an exposure t tells the radiance v / t with the noise model's variance. A frame that
// is tried with exposure t should have the values L t. For each other exposure a that it may have
// had, those values tell that lie three deviations (of noise, of the radiance, and of light that
// drifts) on the other side of a threshold; the threshold is half-way to the nearest other exposure
// (in stops), or three deviations away if that is more, but below saturation wherever the value
// should be. A value votes by the side on which it lies.
// Noise alone misleads one vote of 700; persons and lamps mislead those that they cover or light.
// So a frame agrees if 60 % of at least 16 votes do, against every such exposure. Where fewer
// values tell, those count against it that are off what is known by three deviations.
//
// Such votes are wide where exposures are far apart. So 40 % of the values with little noise must
// also be within 10 % of what is expected (and 3 % for each frame since), wherever 16 or more are:
// light that jumps is not taken for light as known.
//
// A picture that changes its exposure in the middle differs in rows that begin at the first one or
// end at the last. Of the values there that tell the tried exposure from the other (three
// deviations of both apart), those that are the other's and not the tried one's vote for the other:
// twice if 5.5 deviations away. It contradicts in part if from one end on there are two votes or
// more, and values as tried are at most an eighth of them; a value that is saturated, as it should
// be, counts a quarter, since all that is bright looks so. One value may be enough; so now and then
// something that moved into the only value that tells is taken for it.
//
// Light seen long ago may have drifted far, too far to tell what is nearly saturated from what is.
// But drift is of all light: the median of eight values or more that were seen as long ago, of
// little noise, tells it, and leaves a quarter of its uncertainty.
class RadianceReference {
 public:
  // Light that changes by up to `light_drift` a frame (relative) everywhere is allowed for.
  RadianceReference(const NoiseModel& noise, double light_drift);

  bool empty() const { return radiance_.empty(); }
  void clear();
  // Takes what the frame says, where it says more than is known, or something else.
  void take(const Thumbnail& thumbnail, double exposure_s, std::int64_t number);
  // How many times as bright this light is as the other, in the median of values that both know to
  // 10 %; 1 where fewer than 16 are.
  double brighter_than(const RadianceReference& other) const;
  // Thumbnails have the size of the first one since it was empty: std::invalid_argument if not.
  FitResult check(const Thumbnail& thumbnail,
                  std::int64_t number,
                  const TriedExposure& tried) const;

 private:
  struct Limits;
  struct Votes;
  struct Band;
  struct Expected;
  struct Variance;
  struct Nearness {
    int telling = 0, agreeing = 0;
  };
  Limits limits_of(const Thumbnail& thumbnail,
                   std::int64_t number,
                   const TriedExposure& tried) const;
  void follow_drift(const Thumbnail& thumbnail,
                    std::int64_t number,
                    float exposure_s,
                    Limits& limits) const;
  bool made_in_part(double partner_s,
                    const Thumbnail& thumbnail,
                    const TriedExposure& tried,
                    const Limits& limits,
                    bool top) const;
  Expected expect(
      float radiance, float variance, float scale, float exposure_s, const Variance& noise) const;
  Band band_of(std::size_t i, float exposure_s, const Limits& limits, const Variance& noise) const;
  Nearness nearness_of(const Thumbnail& thumbnail,
                       const TriedExposure& tried,
                       const Limits& limits) const;
  Votes votes_against(double other_s, const TriedExposure& tried, const Limits& limits) const;

  float read_, shot_, relative_squared_, saturation_;  // the noise model's
  float drift_squared_;  // the relative variance that a frame of drifting light adds
  int rows_ = 0;
  std::size_t row_size_ = 0;
  std::int64_t first_number_ = 0;
  std::vector<float> radiance_;
  std::vector<float> variance_;         // of it; infinite = not known
  std::vector<std::int32_t> taken_at_;  // number of the frame less first_number_
  std::vector<float> scale_;            // of the noise model's variance
};

}  // namespace capture
