// Tags of decoded pictures.
#include "capture/picture_tags.h"

#include <cstring>
#include <stdexcept>

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
}

namespace capture {
namespace {

// Untagged pictures up to this height are standard definition.
constexpr int max_sd_height = 576;

struct LumaWeights {
  double kr;
  double kb;
  const char* name;
};

LumaWeights luma_weights(AVColorSpace space, int height) {
  switch (space) {
    case AVCOL_SPC_UNSPECIFIED:
    case AVCOL_SPC_RESERVED:
      return height <= max_sd_height ? LumaWeights{0.299, 0.114, "BT.601 (untagged)"}
                                     : LumaWeights{0.2126, 0.0722, "BT.709 (untagged)"};
    case AVCOL_SPC_BT709:
      return {0.2126, 0.0722, "BT.709"};
    case AVCOL_SPC_BT470BG:
    case AVCOL_SPC_SMPTE170M:
      return {0.299, 0.114, "BT.601"};
    case AVCOL_SPC_FCC:
      return {0.30, 0.11, "FCC"};
    case AVCOL_SPC_SMPTE240M:
      return {0.212, 0.087, "SMPTE 240M"};
    case AVCOL_SPC_BT2020_NCL:
      return {0.2627, 0.0593, "BT.2020"};
    case AVCOL_SPC_RGB:
      throw std::runtime_error(
          "it has RGB where its format has Y'CbCr; convert it: ffmpeg -i IN -pix_fmt gbrp OUT");
    default: {
      const char* name = av_color_space_name(space);
      throw std::runtime_error(std::string("its matrix, ") + (name ? name : "of a later standard") +
                               ", is not handled; convert it: ffmpeg -i IN -vf "
                               "zscale=matrix=709 OUT");
    }
  }
}

struct Sitings {
  Siting across;
  Siting down;
  const char* name;
};

Sitings sitings(AVChromaLocation location) {
  switch (location) {
    case AVCHROMA_LOC_LEFT:
      return {Siting::first, Siting::middle, "chroma left"};
    case AVCHROMA_LOC_CENTER:
      return {Siting::middle, Siting::middle, "chroma centre"};
    case AVCHROMA_LOC_TOPLEFT:
      return {Siting::first, Siting::first, "chroma top left"};
    case AVCHROMA_LOC_TOP:
      return {Siting::middle, Siting::first, "chroma top"};
    case AVCHROMA_LOC_BOTTOMLEFT:
      return {Siting::first, Siting::last, "chroma bottom left"};
    case AVCHROMA_LOC_BOTTOM:
      return {Siting::middle, Siting::last, "chroma bottom"};
    default:
      return {Siting::first, Siting::middle, "chroma left (untagged)"};
  }
}

bool is_full_range_format(int format) {
  switch (format) {
    case AV_PIX_FMT_YUVJ420P:
    case AV_PIX_FMT_YUVJ422P:
    case AV_PIX_FMT_YUVJ444P:
    case AV_PIX_FMT_YUVJ440P:
    case AV_PIX_FMT_YUVJ411P:
      return true;
    default:
      return false;
  }
}

}  // namespace

YcbcrTags ycbcr_tags(const AVFrame& frame) {
  const LumaWeights weights = luma_weights(frame.colorspace, frame.height);
  const Sitings sited = sitings(frame.chroma_location);
  const bool full = frame.color_range == AVCOL_RANGE_JPEG || is_full_range_format(frame.format);
  return {weights.kr, weights.kb,
          full,       sited.across,
          sited.down, std::string(weights.name) + (full ? " full, " : " limited, ") + sited.name};
}

bool is_limited_rgb(const AVFrame& frame) { return frame.color_range == AVCOL_RANGE_MPEG; }

TransferTag transfer_tag(const AVFrame& frame) {
  switch (frame.color_trc) {
    case AVCOL_TRC_LINEAR:
      return TransferTag::linear;
    case AVCOL_TRC_LOG:
    case AVCOL_TRC_LOG_SQRT:
    case AVCOL_TRC_SMPTE2084:
    case AVCOL_TRC_SMPTE428:
    case AVCOL_TRC_ARIB_STD_B67:
      throw std::runtime_error(std::string("its transfer curve, ") +
                               av_color_transfer_name(frame.color_trc) +
                               ", is not handled; convert it: ffmpeg -i IN -vf "
                               "zscale=transfer=709 OUT");
    default:
      return TransferTag::display;
  }
}

std::optional<std::array<std::int32_t, 9>> display_matrix(const AVFrame& frame) {
  const AVFrameSideData* its = av_frame_get_side_data(&frame, AV_FRAME_DATA_DISPLAYMATRIX);
  std::array<std::int32_t, 9> matrix{};
  if (its == nullptr || its->size < sizeof matrix) return std::nullopt;
  std::memcpy(matrix.data(), its->data, sizeof matrix);
  return matrix;
}

bool are_alike(const AVFrame& a, const AVFrame& b) {
  return a.width == b.width && a.height == b.height && a.format == b.format &&
         a.colorspace == b.colorspace && a.color_range == b.color_range &&
         a.color_trc == b.color_trc && a.chroma_location == b.chroma_location;
}

}  // namespace capture
