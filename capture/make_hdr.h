// From files of a bracket, or of one HDR picture, to a radiance image.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/bracket_check.h"
#include "capture/image.h"
#include "capture/response.h"

namespace capture {

struct HdrOptions {
  // One per shot; empty = from the files' EXIF data, marks snapped to what they mean (exif.h),
  // other f-numbers and ISO than the first shot's counted as exposure.
  std::vector<double> exposures_s;
  // "auto": recovered from the shots, together with the true exposures (one or two shots count as
  // sRGB). "sRGB", "linear", or the path of a .rsp or .toml file
  // (camera_response.h): taken as it is, exposures as they are.
  std::string response = "auto";
};

struct HdrResult {
  Image radiance;                       // (height, width, 3), sensor units per second
  std::vector<double> exposures_s;      // used, in the files' order; empty for a single HDR picture
  Response response;                    // light of codes; unused for HDR pictures
  std::optional<double> heldout_error;  // of a recovered response (ResponseFit)
  std::vector<ResponseCandidate> candidates;  // that were tried, if it was recovered
  BracketShares shares;                       // of stills
  std::vector<std::string> warnings;          // what to know before it is used
  double time_ms = 0;
};

// Merges JPEG or PNG shots (8 bit; one or more, of one size, in any order) or converts one EXR or
// Radiance picture, whose infinite values become finite (limit_infinite) and whose values that are
// no numbers become 0, with a warning. EXR or Radiance files as shots of a bracket count as linear,
// 1 = saturated, and need stated exposures. Throws std::invalid_argument for no paths or exposures
// that do not match them; std::runtime_error naming the file and the reason otherwise, such as
// shots of two sizes or without exposure times.
HdrResult make_hdr(std::span<const std::string> paths, const HdrOptions& options = {});

// How many of a picture's values are no numbers, in words; "" if none are.
std::string warning_of_nan(const Image& image);

// The range of luminance in stops, without the faintest and the brightest thousandth of those
// pixels that are brighter than black; 0 if there are none.
double range_stops(const Image& radiance);

}  // namespace capture
