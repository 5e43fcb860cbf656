// Pixel formats of V4L2.
#include "capture/v4l2_format.h"

#include <algorithm>
#include <array>

#include <linux/videodev2.h>

extern "C" {
#include <libavutil/pixfmt.h>
}

namespace capture {
namespace {

constexpr PixelCoding video(std::uint32_t fourcc, AVPixelFormat format) {
  return {fourcc, PixelKind::video, format, {}};
}

constexpr PixelCoding jpeg(std::uint32_t fourcc) { return {fourcc, PixelKind::jpeg, -1, {}}; }

constexpr PixelCoding raw(std::uint32_t fourcc, BayerPattern pattern, Packing packing, int bits) {
  return {fourcc, PixelKind::raw, -1, {pattern, packing, bits}};
}

using enum BayerPattern;
using enum Packing;

constexpr std::array codings{
    video(V4L2_PIX_FMT_YUYV, AV_PIX_FMT_YUYV422),
    video(V4L2_PIX_FMT_UYVY, AV_PIX_FMT_UYVY422),
    video(V4L2_PIX_FMT_NV12, AV_PIX_FMT_NV12),
    video(V4L2_PIX_FMT_YUV420, AV_PIX_FMT_YUV420P),
    video(V4L2_PIX_FMT_RGB24, AV_PIX_FMT_RGB24),
    video(V4L2_PIX_FMT_BGR24, AV_PIX_FMT_BGR24),
    jpeg(V4L2_PIX_FMT_MJPEG),
    jpeg(V4L2_PIX_FMT_JPEG),
    raw(V4L2_PIX_FMT_SRGGB16, rggb, words, 16),
    raw(V4L2_PIX_FMT_SGRBG16, grbg, words, 16),
    raw(V4L2_PIX_FMT_SGBRG16, gbrg, words, 16),
    raw(V4L2_PIX_FMT_SBGGR16, bggr, words, 16),
    raw(V4L2_PIX_FMT_SRGGB14, rggb, words, 14),
    raw(V4L2_PIX_FMT_SGRBG14, grbg, words, 14),
    raw(V4L2_PIX_FMT_SGBRG14, gbrg, words, 14),
    raw(V4L2_PIX_FMT_SBGGR14, bggr, words, 14),
    raw(V4L2_PIX_FMT_SRGGB12, rggb, words, 12),
    raw(V4L2_PIX_FMT_SGRBG12, grbg, words, 12),
    raw(V4L2_PIX_FMT_SGBRG12, gbrg, words, 12),
    raw(V4L2_PIX_FMT_SBGGR12, bggr, words, 12),
    raw(V4L2_PIX_FMT_SRGGB12P, rggb, mipi12, 12),
    raw(V4L2_PIX_FMT_SGRBG12P, grbg, mipi12, 12),
    raw(V4L2_PIX_FMT_SGBRG12P, gbrg, mipi12, 12),
    raw(V4L2_PIX_FMT_SBGGR12P, bggr, mipi12, 12),
    raw(V4L2_PIX_FMT_SRGGB10, rggb, words, 10),
    raw(V4L2_PIX_FMT_SGRBG10, grbg, words, 10),
    raw(V4L2_PIX_FMT_SGBRG10, gbrg, words, 10),
    raw(V4L2_PIX_FMT_SBGGR10, bggr, words, 10),
    raw(V4L2_PIX_FMT_SRGGB10P, rggb, mipi10, 10),
    raw(V4L2_PIX_FMT_SGRBG10P, grbg, mipi10, 10),
    raw(V4L2_PIX_FMT_SGBRG10P, gbrg, mipi10, 10),
    raw(V4L2_PIX_FMT_SBGGR10P, bggr, mipi10, 10),
    raw(V4L2_PIX_FMT_SRGGB8, rggb, bytes, 8),
    raw(V4L2_PIX_FMT_SGRBG8, grbg, bytes, 8),
    raw(V4L2_PIX_FMT_SGBRG8, gbrg, bytes, 8),
    raw(V4L2_PIX_FMT_SBGGR8, bggr, bytes, 8),
    raw(V4L2_PIX_FMT_Y16, none, words, 16),
    raw(V4L2_PIX_FMT_Y14, none, words, 14),
    raw(V4L2_PIX_FMT_Y12, none, words, 12),
    raw(V4L2_PIX_FMT_Y10, none, words, 10),
    raw(V4L2_PIX_FMT_Y10P, none, mipi10, 10),
    video(V4L2_PIX_FMT_GREY, AV_PIX_FMT_GRAY8),
};

bool is_printable(char c) { return c >= ' ' && c <= '~'; }

}  // namespace

std::span<const PixelCoding> pixel_codings() { return codings; }

const PixelCoding* coding_of(std::uint32_t fourcc) {
  const auto found = std::ranges::find(codings, fourcc, &PixelCoding::fourcc);
  return found == codings.end() ? nullptr : &*found;
}

std::string name_of_fourcc(std::uint32_t fourcc) {
  std::string name;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const char c = static_cast<char>(fourcc >> shift & 0x7fU);
    name += is_printable(c) ? c : '?';
  }
  name.erase(name.find_last_not_of(' ') + 1);
  return name + ((fourcc & 0x80000000U) != 0 ? "-BE" : "");
}

std::optional<std::uint32_t> fourcc_of_name(std::string_view name) {
  if (name == "MJPEG") return V4L2_PIX_FMT_MJPEG;
  if (name.empty() || name.size() > 4 || !std::ranges::all_of(name, is_printable)) {
    return std::nullopt;
  }
  std::uint32_t fourcc = 0;
  for (unsigned i = 0; i < 4; ++i) {
    const char c = i < name.size() ? name[i] : ' ';
    fourcc |= static_cast<std::uint32_t>(static_cast<unsigned char>(c)) << (8 * i);
  }
  return fourcc;
}

}  // namespace capture
