// Pictures as cameras deliver them, to light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "capture/crop.h"
#include "capture/image.h"
#include "capture/linearise.h"

namespace capture {

// How a device lays its pictures out, as it told when the format was set. Formats and tags have
// V4L2's names and numbers, whatever the camera.
struct CodedLayout {
  std::uint32_t fourcc = 0;  // one of pixel_codings()
  int width = 0;
  int height = 0;
  std::size_t row_bytes = 0;  // of the first plane, with what pads it; 0 = nothing does
  // V4L2_COLORSPACE_..., V4L2_YCBCR_ENC_..., V4L2_QUANTIZATION_..., V4L2_XFER_FUNC_...; 0 = untold
  std::uint32_t colour_space = 0;
  std::uint32_t ycbcr_encoding = 0;
  std::uint32_t quantization = 0;
  std::uint32_t transfer = 0;
  friend bool operator==(const CodedLayout&, const CodedLayout&) = default;
};

// A picture as its camera sent it.
struct CodedPicture {
  CodedLayout layout;
  std::vector<std::byte> bytes;
};

// Codes of video (also JPEG and 8-bit grey) become light as colour.md says. Those of raw formats
// are light themselves, 0 = code 0 and 1 = the highest, unless `curves` has the camera's response.
// Not thread-safe.
class CodedPictureReader {
 public:
  // Throws std::runtime_error, without the device's name, if the format is not read or its rows
  // overlap.
  CodedPictureReader(const CodedLayout& layout, const LightCurves& curves);
  ~CodedPictureReader();
  CodedPictureReader(CodedPictureReader&&) noexcept;
  CodedPictureReader& operator=(CodedPictureReader&&) noexcept;

  // Bytes of a whole picture; 0 = they vary (JPEG).
  std::size_t picture_bytes() const;
  // Light of a part of the picture that `bytes` holds. Returns what is wrong with it, or "".
  // Throws std::runtime_error, without the device's name, if there is no picture in them.
  std::string read(std::span<const std::byte> bytes, const Crop& crop, Image& image);
  // How the last picture was read; "" before the first.
  std::string description() const;

  struct Reader;

 private:
  std::unique_ptr<Reader> reader_;
};

}  // namespace capture
