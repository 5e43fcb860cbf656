// Pictures as V4L2 cameras deliver them, to light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "capture/crop.h"
#include "capture/image.h"
#include "capture/linearise.h"

namespace capture {

// How a device lays its pictures out, as it told when the format was set.
struct V4l2Layout {
  std::uint32_t fourcc = 0;  // one of pixel_codings()
  int width = 0;
  int height = 0;
  std::size_t row_bytes = 0;  // of the first plane, with what pads it; 0 = nothing does
  // V4L2_COLORSPACE_..., V4L2_YCBCR_ENC_..., V4L2_QUANTIZATION_..., V4L2_XFER_FUNC_...; 0 = untold
  std::uint32_t colour_space = 0;
  std::uint32_t ycbcr_encoding = 0;
  std::uint32_t quantization = 0;
  std::uint32_t transfer = 0;
};

// Codes of video (also JPEG and 8-bit grey) become light as colour.md says. Those of raw formats
// are light themselves, 0 = code 0 and 1 = the highest, unless `curves` has the camera's response.
// Not thread-safe.
class V4l2PictureReader {
 public:
  // Throws std::runtime_error, without the device's name, if the format is not read or its rows
  // overlap.
  V4l2PictureReader(const V4l2Layout& layout, const LightCurves& curves);
  ~V4l2PictureReader();
  V4l2PictureReader(V4l2PictureReader&&) noexcept;
  V4l2PictureReader& operator=(V4l2PictureReader&&) noexcept;

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
