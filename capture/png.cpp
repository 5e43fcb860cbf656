// PNG files, by libav's encoder.
#include "capture/png.h"

#include <array>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

#include "capture/files.h"
#include "capture/libav.h"

extern "C" {
#include <libavcodec/avcodec.h>
}

namespace capture {
namespace {

constexpr int max_size = 65535;
constexpr std::array<AVPixelFormat, 4> format_of_channels{AV_PIX_FMT_GRAY8, AV_PIX_FMT_YA8,
                                                          AV_PIX_FMT_RGB24, AV_PIX_FMT_RGBA};

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& why) {
  throw std::runtime_error("cannot write " + path.string() + ": " + why);
}

libav::PacketHandle encode(const std::filesystem::path& path,
                           int width,
                           int height,
                           int channels,
                           std::span<const std::uint8_t> texels,
                           Rational pixel_aspect) {
  libav::gather_log();
  libav::forget_log();
  const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_PNG);
  if (codec == nullptr) {
    fail(path, "this libavcodec has no PNG encoder; install Debian's libavcodec59");
  }
  const libav::CodecContext context(avcodec_alloc_context3(codec));
  if (!context) {
    throw std::bad_alloc();
  }
  context->width = width;
  context->height = height;
  context->pix_fmt = format_of_channels[static_cast<std::size_t>(channels - 1)];
  context->time_base = {1, 1};
  // libav writes it as the pixels in a unit across and down, whose ratio is the other way round.
  context->sample_aspect_ratio = {static_cast<int>(pixel_aspect.den),
                                  static_cast<int>(pixel_aspect.num)};
  context->thread_count = 1;
  if (const int error = avcodec_open2(context.get(), codec, nullptr); error < 0) {
    fail(path, libav::reason(error));
  }
  const libav::FrameHandle frame = libav::make_frame();
  frame->width = width;
  frame->height = height;
  frame->format = context->pix_fmt;
  if (const int error = av_frame_get_buffer(frame.get(), 0); error < 0) {
    fail(path, libav::reason(error));
  }
  const auto row_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
  for (int y = 0; y < height; ++y) {
    std::memcpy(frame->data[0] + static_cast<std::ptrdiff_t>(y) * frame->linesize[0],
                texels.data() + static_cast<std::size_t>(y) * row_bytes, row_bytes);
  }
  libav::PacketHandle packet = libav::make_packet();
  if (const int error = avcodec_send_frame(context.get(), frame.get()); error < 0) {
    fail(path, libav::reason(error));
  }
  if (const int error = avcodec_receive_packet(context.get(), packet.get()); error < 0) {
    fail(path, libav::reason(error));
  }
  return packet;
}

}  // namespace

void write_png(const std::filesystem::path& path,
               int width,
               int height,
               int channels,
               std::span<const std::uint8_t> texels,
               Rational pixel_aspect) {
  if (width < 1 || height < 1 || width > max_size || height > max_size || channels < 1 ||
      channels > 4) {
    throw std::invalid_argument("a PNG has 1 to 65535 rows and columns and 1 to 4 channels");
  }
  if (texels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                           static_cast<std::size_t>(channels)) {
    throw std::invalid_argument("a PNG of another size than its texels");
  }
  constexpr std::int64_t most = std::numeric_limits<int>::max();
  if (pixel_aspect.num < 1 || pixel_aspect.den < 1 || pixel_aspect.num > most ||
      pixel_aspect.den > most) {
    throw std::invalid_argument("a PNG's pixels have a width and a height above 0");
  }
  const libav::PacketHandle packet = encode(path, width, height, channels, texels, pixel_aspect);
  const std::span<const std::uint8_t> bytes(packet->data, static_cast<std::size_t>(packet->size));
  write_file(path.string(), std::as_bytes(bytes));
}

}  // namespace capture
