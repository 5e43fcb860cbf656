// The pixel formats of V4L2 that are read.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "capture/raw.h"

namespace capture {

enum class PixelKind { video, jpeg, raw };

// How pictures of one format are read.
struct PixelCoding {
  std::uint32_t fourcc = 0;  // V4L2_PIX_FMT_...
  PixelKind kind = PixelKind::video;
  int libav_format = -1;  // of video: an AVPixelFormat
  RawLayout raw;          // of raw
};

// All that are read, those first that are taken first where several will do: video before JPEG
// (which has lost something), colour before grey, finished pictures before raw ones.
std::span<const PixelCoding> pixel_codings();
// Null if the format is not read.
const PixelCoding* coding_of(std::uint32_t fourcc);

// The four characters, without spaces at the end: "YUYV", "Y10"; what cannot be printed is '?'.
std::string name_of_fourcc(std::uint32_t fourcc);
// Of a name of one to four characters that can be printed; MJPEG means MJPG.
std::optional<std::uint32_t> fourcc_of_name(std::string_view name);

}  // namespace capture
