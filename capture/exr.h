// OpenEXR files: takes written, pictures and maps read.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/colour.h"
#include "capture/frame.h"
#include "capture/image.h"

namespace capture {

// SMPTE ST 12-1 hours:minutes:seconds:frames. The file has room for frames 0 to 39; above 30 frames
// per second, the standard counts pairs of frames and marks the second of each.
struct ExrTimecode {
  int hours = 0;
  int minutes = 0;
  int seconds = 0;
  int frames = 0;
  bool drop_frame = false;
  bool second_of_pair = false;  // the field mark
  friend bool operator==(const ExrTimecode&, const ExrTimecode&) = default;
};

enum class ExrCompression {
  none,  // fastest
  rle,   // quick; good for mattes and empty ground
  zip,   // slow to write, small
  piz,   // slow, smallest for noisy pictures
};

// Of one frame's pixel: variance = gain * light + floor, scene-linear.
struct LightNoise {
  float gain = 0;
  float floor = 0;
  friend bool operator==(const LightNoise&, const LightNoise&) = default;
};

// Of light that a camera's measured response tells.
inline constexpr std::string_view by_response = "response";

struct ExrOptions {
  ExrCompression compression = ExrCompression::none;
  std::optional<ExrTimecode> timecode{};
  std::optional<Rational> frames_per_second{};
  Rational pixel_aspect{1, 1};  // a pixel's width over its height
  // Of the frames that the picture is a mean of: attribute "frameNoise", V2f of gain and floor.
  std::optional<LightNoise> noise{};
  // By what their codes became light: attribute "frameTransfer", a curve's name or by_response.
  std::string transfer{};
  // Of the lens that filmed the picture, in words that whoever reads it understands: attribute
  // "frameLens", a string of at most most_lens_text printable ASCII characters, tabs and new lines.
  std::string lens{};
};

inline constexpr std::size_t most_lens_text = std::size_t{256} << 10;

// An image's channels under these names, in its order.
struct ExrPlanes {
  const HalfImage& image;
  std::vector<std::string> names;
};

// Writes one scan-line file with the channels of all images, bits as they are, and Rec.709
// chromaticities. It is written beside `path` first and takes its name once complete, so that no
// reader ever sees half a file. Throws std::invalid_argument if there are no images, sizes differ,
// names do not match channels or come twice, the time code is out of range, or the lens is no such
// text; std::runtime_error with path and reason if it cannot be written.
void write_exr(const std::string& path,
               std::span<const ExrPlanes> planes,
               const ExrOptions& options = {});

// The same for one float image of 1 (Y), 3 (RGB) or 4 (RGBA) channels, as 32-bit floats.
void write_exr(const std::string& path, const Image& image, const ExrOptions& options = {});

struct ExrLimits {
  std::size_t image_bytes = std::size_t{2} << 30;  // 16,384 x 8,192 RGBA
  std::chrono::milliseconds time{60'000};
};

// Reads the picture of a file that anyone may have made: (height, width, channels), channels 1 (Y),
// 3 or 4 (RGB, A), floats, linear Rec.709 (other chromaticities, XYZ too, are converted, see
// primaries.h). The display window is the picture: data outside are cut off, and what the data
// window leaves out is 0. Of a multi-part file the first part is read, of a tiled one the finest
// level; luminance-chroma files become RGB. NaN and infinity come as they are: whoever makes light
// of the image counts and removes them. Only before a conversion limit_infinite() comes, which
// would make nothing of infinity less infinity.
//
// OpenEXR decodes in a confined child process (sandbox.h), since hostile files are known to crash
// it. Throws std::runtime_error with path and reason: missing, damaged, too large (a side over
// 16,384 pixels, or the limits), deep data, other channels than these.
Image read_exr(const std::string& path, const ExrLimits& limits = {});

// The same, with what the file says of its pixels' shape.
struct ExrPicture {
  Image image;
  Rational pixel_aspect{1, 1};  // width over height; 1/1 where the file's is none of 1/16 to 16
};
ExrPicture read_exr_picture(const std::string& path, const ExrLimits& limits = {});

// Infinite values, of light that was beyond the file's format, become as much as the picture's
// largest finite one, or 65504, the largest half, if that is more. Alpha stays.
void limit_infinite(Image& image);

// What a file tells of its frames' noise (ExrOptions::noise), if it does and both are finite and
// not negative. Throws as read_exr, of what comes before the pixels.
std::optional<LightNoise> read_exr_noise(const std::string& path, const ExrLimits& limits = {});

// The same of ExrOptions::transfer; "" if it is none of ours.
std::string read_exr_transfer(const std::string& path, const ExrLimits& limits = {});

// The same of ExrOptions::lens; "" if the file has none. What it has must be such a text, else this
// throws std::runtime_error with path and reason: a note that cannot be read is not passed over,
// for its reader would take what it contradicts. Pictures are read whatever is noted.
std::string read_exr_lens(const std::string& path, const ExrLimits& limits = {});

}  // namespace capture
