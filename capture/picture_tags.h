// What libav's tags say about the colours of a decoded picture. For the files that wrap libav.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "capture/chroma.h"

struct AVFrame;

namespace capture {

// How light went into a picture's codes, by its tag.
enum class TransferTag {
  display,  // untagged, or one of the curves of standard-range video and sRGB
  linear,
};

// How the codes of a Y'CbCr picture are read.
struct YcbcrTags {
  double kr = 0;
  double kb = 0;
  bool full_range = false;
  Siting across = Siting::first;
  Siting down = Siting::middle;
  std::string description;  // "BT.601 (untagged) limited, chroma left"
};

// Untagged pictures: BT.601 up to 576 rows, else BT.709, limited range unless the format says full;
// chroma as in MPEG-2 (libav tags that of JPEG).
// Throws std::runtime_error, without a file name, for a matrix that is not handled.
YcbcrTags ycbcr_tags(const AVFrame& frame);

// Whether codes of RGB, grey or palette are of limited range; full if untagged.
bool is_limited_rgb(const AVFrame& frame);

// Throws std::runtime_error, without a file name, for curves that are not handled: PQ, HLG, log.
TransferTag transfer_tag(const AVFrame& frame);

// The picture's own display matrix, for turn_of_matrix: of H.264's messages, or of the orientation
// in a JPEG's EXIF data. Nothing if it has none.
std::optional<std::array<std::int32_t, 9>> display_matrix(const AVFrame& frame);

// Whether two pictures have one size, one format and the same tags.
bool are_alike(const AVFrame& a, const AVFrame& b);

}  // namespace capture
