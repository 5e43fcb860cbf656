// Light of the pictures that cameras deliver.
#include "capture/coded_picture.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <linux/videodev2.h>

#include "capture/libav.h"
#include "capture/v4l2_format.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
}

namespace capture {

struct CodedPictureReader::Reader {
  virtual ~Reader() = default;
  virtual std::size_t picture_bytes() const = 0;
  virtual std::string read(std::span<const std::byte> bytes, const Crop& crop, Image& image) = 0;
  virtual std::string description() const = 0;
};

namespace {

AVColorSpace matrix_of(std::uint32_t encoding) {
  switch (encoding) {
    case V4L2_YCBCR_ENC_601:
    case V4L2_YCBCR_ENC_XV601:
      return AVCOL_SPC_SMPTE170M;
    case V4L2_YCBCR_ENC_709:
    case V4L2_YCBCR_ENC_XV709:
      return AVCOL_SPC_BT709;
    case V4L2_YCBCR_ENC_BT2020:
      return AVCOL_SPC_BT2020_NCL;
    case V4L2_YCBCR_ENC_BT2020_CONST_LUM:
      return AVCOL_SPC_BT2020_CL;
    case V4L2_YCBCR_ENC_SMPTE240M:
      return AVCOL_SPC_SMPTE240M;
    default:
      return AVCOL_SPC_UNSPECIFIED;
  }
}

AVColorTransferCharacteristic curve_of(std::uint32_t transfer) {
  switch (transfer) {
    case V4L2_XFER_FUNC_NONE:
      return AVCOL_TRC_LINEAR;
    case V4L2_XFER_FUNC_SMPTE2084:
      return AVCOL_TRC_SMPTE2084;
    default:
      return AVCOL_TRC_UNSPECIFIED;
  }
}

bool is_rgb(std::uint32_t fourcc) {
  return fourcc == V4L2_PIX_FMT_RGB24 || fourcc == V4L2_PIX_FMT_BGR24;
}

// What a device leaves to its colour space is what videodev2.h says of that; a device that does
// not tell its colour space is untagged.
void tag(AVFrame& frame, const CodedLayout& layout) {
  frame.color_trc = curve_of(layout.transfer);
  std::uint32_t encoding = layout.ycbcr_encoding;
  std::uint32_t range = layout.quantization;
  const bool rgb = is_rgb(layout.fourcc) || layout.fourcc == V4L2_PIX_FMT_GREY;
  if (layout.colour_space != V4L2_COLORSPACE_DEFAULT) {
    if (encoding == V4L2_YCBCR_ENC_DEFAULT) {
      encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(layout.colour_space);
    }
    if (range == V4L2_QUANTIZATION_DEFAULT) {
      range = V4L2_MAP_QUANTIZATION_DEFAULT(rgb, layout.colour_space, encoding);
    }
  }
  if (!rgb) frame.colorspace = matrix_of(encoding);
  if (range == V4L2_QUANTIZATION_FULL_RANGE) frame.color_range = AVCOL_RANGE_JPEG;
  if (range == V4L2_QUANTIZATION_LIM_RANGE) frame.color_range = AVCOL_RANGE_MPEG;
}

struct Plane {
  std::size_t row_bytes = 0;
  std::size_t rows = 0;
};

// The planes of a picture of this many bytes per row of the first one; 0 = not padded. They follow
// each other without a gap.
std::vector<Plane> planes_of(const CodedLayout& layout) {
  const auto width = static_cast<std::size_t>(layout.width);
  const auto height = static_cast<std::size_t>(layout.height);
  const std::size_t half_width = (width + 1) / 2;
  const std::size_t half_height = (height + 1) / 2;
  std::size_t least = width;
  switch (layout.fourcc) {
    case V4L2_PIX_FMT_YUYV:
    case V4L2_PIX_FMT_UYVY:
      least = 4 * half_width;
      break;
    case V4L2_PIX_FMT_RGB24:
    case V4L2_PIX_FMT_BGR24:
      least = 3 * width;
      break;
    case V4L2_PIX_FMT_NV12:
      least = 2 * half_width;
      break;
    default:
      break;
  }
  const std::size_t first = layout.row_bytes == 0 ? least : layout.row_bytes;
  if (first < least || first > 8 * least + 65536) {
    throw std::runtime_error("the device tells rows of " + std::to_string(first) +
                             " bytes, which cannot hold " + std::to_string(width) + " pixels");
  }
  if (layout.fourcc == V4L2_PIX_FMT_NV12) return {{first, height}, {first, half_height}};
  if (layout.fourcc == V4L2_PIX_FMT_YUV420) {
    const std::size_t chroma = (first + 1) / 2;
    return {{first, height}, {chroma, half_height}, {chroma, half_height}};
  }
  return {{first, height}};
}

void check_holds(std::span<const std::byte> bytes, std::size_t picture) {
  if (bytes.size() < picture) {
    throw std::runtime_error("the picture is cut short: " + std::to_string(bytes.size()) + " of " +
                             std::to_string(picture) + " bytes came");
  }
}

// Uncompressed pictures that libav has a format for: read where they lie.
class VideoReader final : public CodedPictureReader::Reader {
 public:
  VideoReader(const CodedLayout& layout, int libav_format, const LightCurves& curves)
      : planes_(planes_of(layout)), lineariser_(curves), frame_(libav::make_frame()) {
    frame_->width = layout.width;
    frame_->height = layout.height;
    frame_->format = libav_format;
    tag(*frame_, layout);
  }

  std::size_t picture_bytes() const override {
    std::size_t bytes = 0;
    for (const Plane& plane : planes_) bytes += plane.row_bytes * plane.rows;
    return bytes;
  }

  std::string read(std::span<const std::byte> bytes, const Crop& crop, Image& image) override {
    check_holds(bytes, picture_bytes());
    std::size_t from = 0;
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      // libav's field is not const; nothing is written to it.
      frame_->data[i] = const_cast<std::uint8_t*>(
          reinterpret_cast<const std::uint8_t*>(bytes.subspan(from).data()));
      frame_->linesize[i] = static_cast<int>(planes_[i].row_bytes);
      from += planes_[i].row_bytes * planes_[i].rows;
    }
    lineariser_.linearise(*frame_, crop, image);
    return {};
  }

  std::string description() const override { return lineariser_.description(); }

 private:
  std::vector<Plane> planes_;
  Lineariser lineariser_;
  libav::FrameHandle frame_;
};

class JpegReader final : public CodedPictureReader::Reader {
 public:
  JpegReader(const CodedLayout& layout, const LightCurves& curves)
      : width_(layout.width),
        height_(layout.height),
        lineariser_(curves),
        context_(libav::make_decoder(AV_CODEC_ID_MJPEG, 1, &complaints_)),
        packet_(libav::make_packet()),
        frame_(libav::make_frame()) {
    if (const int error = avcodec_open2(context_.get(), context_->codec, nullptr); error < 0) {
      throw std::runtime_error("JPEG cannot be decoded: " + libav::reason(error));
    }
  }

  std::size_t picture_bytes() const override { return 0; }

  std::string read(std::span<const std::byte> bytes, const Crop& crop, Image& image) override {
    if (bytes.empty()) throw std::runtime_error("an empty picture came");
    libav::forget_log();
    complaints_.take();
    decode(bytes);
    if (frame_->width != width_ || frame_->height != height_) {
      throw std::runtime_error("the picture's size changed to " + std::to_string(frame_->width) +
                               " x " + std::to_string(frame_->height));
    }
    lineariser_.linearise(*frame_, crop, image);
    std::string wrong = complaints_.take();
    // The decoder fills what is missing with grey and says nothing.
    constexpr std::array end_of_image{std::byte{0xff}, std::byte{0xd9}};
    const bool ends = std::find_end(bytes.begin(), bytes.end(), end_of_image.begin(),
                                    end_of_image.end()) != bytes.end();
    if (wrong.empty() && !ends) wrong = "its end is missing";
    return wrong.empty() ? wrong : "decoded with errors: " + wrong;
  }

  std::string description() const override { return "JPEG, " + lineariser_.description(); }

 private:
  void decode(std::span<const std::byte> bytes) {
    if (bytes.size() > std::size_t{1} << 30U ||
        av_new_packet(packet_.get(), static_cast<int>(bytes.size())) < 0) {
      throw std::bad_alloc();
    }
    std::memcpy(packet_->data, bytes.data(), bytes.size());
    int error = avcodec_send_packet(context_.get(), packet_.get());
    av_packet_unref(packet_.get());
    if (error >= 0) error = avcodec_receive_frame(context_.get(), frame_.get());
    if (error < 0) {
      avcodec_flush_buffers(context_.get());
      throw std::runtime_error("the picture is no JPEG that can be decoded: " +
                               libav::reason(error));
    }
  }

  int width_;
  int height_;
  Lineariser lineariser_;
  libav::Complaints complaints_;
  libav::CodecContext context_;
  libav::PacketHandle packet_;
  libav::FrameHandle frame_;
};

constexpr float saturation = 0.98F;  // as NoiseModel has it

class RawReader final : public CodedPictureReader::Reader {
 public:
  RawReader(const CodedLayout& layout, const RawLayout& raw, const LightCurves& curves)
      : raw_(raw),
        by_response_(curves.response.has_value()),
        mark_saturated_(curves.mark_saturated) {
    const std::size_t least = packed_row_bytes(raw.packing, layout.width);
    row_bytes_ = layout.row_bytes == 0 ? least : layout.row_bytes;
    if (row_bytes_ < least || row_bytes_ > 8 * least + 65536) {
      throw std::runtime_error("the device tells rows of " + std::to_string(row_bytes_) +
                               " bytes, which cannot hold " + std::to_string(layout.width) +
                               " codes of " + std::to_string(raw.bits) + " bits");
    }
    if (layout.width < 4 || layout.height < 4) {
      throw std::runtime_error("a raw picture needs 4 pixels a side");
    }
    mosaic_.resize(layout.width, layout.height);
    codes_.resize(static_cast<std::size_t>(layout.width));
    make_tables(curves);
  }

  std::size_t picture_bytes() const override {
    return row_bytes_ * static_cast<std::size_t>(mosaic_.height);
  }

  std::string read(std::span<const std::byte> bytes, const Crop& crop, Image& image) override {
    check_holds(bytes, picture_bytes());
    if (raw_.pattern == BayerPattern::none) {
      read_grey(bytes, crop, image);
      return {};
    }
    for (int y = 0; y < mosaic_.height; ++y) {
      unpack(bytes, y);
      float* const to = mosaic_.row(y);
      const auto table = [&](int x) {
        return tables_[static_cast<std::size_t>(colour_of_site(raw_.pattern, y, x))].data();
      };
      const std::array tables{table(0), table(1)};  // of every second site
      for (std::size_t x = 0; x < codes_.size(); ++x) to[x] = tables[x % 2][codes_[x]];
    }
    demosaic(mosaic_, raw_.pattern, crop, image);
    if (mark_saturated_) mark_saturated(mosaic_, raw_.pattern, saturation, crop, image);
    return {};
  }

  std::string description() const override {
    return std::string(raw_.pattern == BayerPattern::none ? "grey" : "Bayer") + " codes of " +
           std::to_string(raw_.bits) + " bits, " + (by_response_ ? "by its response" : "linear");
  }

 private:
  void make_tables(const LightCurves& curves) {
    const int codes = 1 << raw_.bits;
    for (std::size_t c = 0; c < tables_.size(); ++c) {
      tables_[c].resize(static_cast<std::size_t>(codes));
      for (int code = 0; code < codes; ++code) {
        const double value = static_cast<double>(code) / (codes - 1);
        tables_[c][static_cast<std::size_t>(code)] =
            static_cast<float>(curves.response ? (*curves.response)[c](value) : value);
      }
    }
  }

  void unpack(std::span<const std::byte> bytes, int y) {
    unpack_row(raw_.packing, raw_.bits,
               bytes.subspan(row_bytes_ * static_cast<std::size_t>(y), row_bytes_), codes_);
  }

  void read_grey(std::span<const std::byte> bytes, const Crop& crop, Image& image) {
    image.height = crop.height;
    image.width = crop.width;
    image.channels = 3;
    image.pixels.resize(static_cast<std::size_t>(crop.height) *
                        static_cast<std::size_t>(crop.width) * 3);
    float* to = image.pixels.data();
    for (int y = crop.y; y < crop.y + crop.height; ++y) {
      unpack(bytes, y);
      for (int x = crop.x; x < crop.x + crop.width; ++x) {
        const std::uint16_t code = codes_[static_cast<std::size_t>(x)];
        for (const std::vector<float>& table : tables_) *to++ = table[code];
      }
    }
  }

  RawLayout raw_;
  bool by_response_;
  bool mark_saturated_;
  std::size_t row_bytes_ = 0;
  Mosaic mosaic_;
  std::vector<std::uint16_t> codes_;
  std::array<std::vector<float>, 3> tables_;
};

}  // namespace

CodedPictureReader::CodedPictureReader(const CodedLayout& layout, const LightCurves& curves) {
  libav::check_size(layout.width, layout.height);
  const PixelCoding* coding = coding_of(layout.fourcc);
  if (coding == nullptr) {
    throw std::runtime_error("format " + name_of_fourcc(layout.fourcc) + " is not read");
  }
  switch (coding->kind) {
    case PixelKind::video:
      reader_ = std::make_unique<VideoReader>(layout, coding->libav_format, curves);
      break;
    case PixelKind::jpeg:
      reader_ = std::make_unique<JpegReader>(layout, curves);
      break;
    case PixelKind::raw:
      reader_ = std::make_unique<RawReader>(layout, coding->raw, curves);
      break;
  }
}

CodedPictureReader::~CodedPictureReader() = default;
CodedPictureReader::CodedPictureReader(CodedPictureReader&&) noexcept = default;
CodedPictureReader& CodedPictureReader::operator=(CodedPictureReader&&) noexcept = default;

std::size_t CodedPictureReader::picture_bytes() const { return reader_->picture_bytes(); }

std::string CodedPictureReader::read(std::span<const std::byte> bytes,
                                     const Crop& crop,
                                     Image& image) {
  return reader_->read(bytes, crop, image);
}

std::string CodedPictureReader::description() const { return reader_->description(); }

}  // namespace capture
