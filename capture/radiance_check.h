// Whether a frame's light fits the exposure that it is said to have, by what frames before it saw.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "capture/hdr.h"
#include "capture/image.h"

namespace capture {

// A few linear values of a picture, (rows, columns, channels), 1 = saturated. The first and the
// last row hold those of the picture, so that a picture that changes its exposure somewhere shows
// it in one of them. Values that are not finite count as not taken.
struct Thumbnail {
  int rows = 0;
  int columns = 0;
  int channels = 3;
  std::vector<float> values;

  std::size_t row_size() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(channels);
  }
};

// The means of rows x columns cells; fewer where the picture has fewer pixels. So dark pictures, in
// which no pixel rises above the noise, tell their exposure all the same. A mean of saturated and
// other pixels follows no exposure, and is no value (NaN). Throws std::invalid_argument for an
// empty picture, or rows or columns below 1.
Thumbnail thumbnail_of(const Image& image,
                       int rows = 16,
                       int columns = 16,
                       double saturation = NoiseModel{}.saturation);
// The noise of such values, where `noise` is that of the picture's pixels.
NoiseModel noise_of_thumbnail(
    const NoiseModel& noise, int width, int height, int rows = 16, int columns = 16);

// An exposure that a frame may have had, and those it is to be told from.
struct TriedExposure {
  double exposure_s = 0;
  double shorter_s = 0;  // the nearest in play; 0 = none
  double longer_s = 0;
  // In effect shortly before or after, 0 = none: a picture that changes in the middle is made of
  // the tried exposure and one of these.
  std::array<double, 3> partners_s{};
};

enum class Fit {
  agrees,
  contradicts,  // another exposure, or other light
  silent,       // black or saturated: looks the same with the next shorter or longer exposure
};

struct FitResult {
  Fit fit = Fit::silent;
  bool tells = false;    // the next shorter and longer exposures would look different
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
// A picture that changes its exposure in the middle differs in rows that begin at the first one or
// end at the last: it contradicts in part if at one end, in rows of 4 to 8 votes or more, at most a
// quarter agrees, and those that do not have the values of an exposure in effect shortly before or
// after (to 25 %); if they do not, something moved.
class RadianceReference {
 public:
  // Light that changes by up to `light_drift` a frame (relative) everywhere is allowed for.
  RadianceReference(const NoiseModel& noise, double light_drift);

  bool empty() const { return radiance_.empty(); }
  void clear();
  // Takes what the frame says, where it says more than is known, or something else.
  void take(const Thumbnail& thumbnail, double exposure_s, std::int64_t number);
  // Thumbnails have the size of the first one since it was empty: std::invalid_argument if not.
  FitResult check(const Thumbnail& thumbnail,
                  std::int64_t number,
                  const TriedExposure& tried) const;

 private:
  struct Limits;
  struct Votes;
  Limits limits_of(const Thumbnail& thumbnail,
                   std::int64_t number,
                   const TriedExposure& tried) const;
  bool made_by_partner(const Thumbnail& thumbnail,
                       const TriedExposure& tried,
                       const Limits& limits,
                       std::size_t rows,
                       bool top) const;
  Votes votes_against(double other_s, const TriedExposure& tried, const Limits& limits) const;

  float read_, shot_, relative_squared_, saturation_;  // the noise model's
  float drift_squared_;  // the relative variance that a frame of drifting light adds
  int rows_ = 0;
  std::size_t row_size_ = 0;
  std::int64_t first_number_ = 0;
  std::vector<float> radiance_;
  std::vector<float> variance_;         // of it; infinite = not known
  std::vector<std::int32_t> taken_at_;  // number of the frame less first_number_
};

}  // namespace capture
