// Still pictures, by libav's decoders.
#include "capture/still.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>

#include "capture/libav.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/imgutils.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

namespace capture {
namespace {

constexpr int max_size = 16384;

[[noreturn]] void fail(const std::string& name, const std::string& why) {
  throw std::runtime_error("cannot read " + name + ": " + why);
}

bool begins_with(std::span<const std::byte> bytes, std::string_view magic) {
  return bytes.size() >= magic.size() && std::memcmp(bytes.data(), magic.data(), magic.size()) == 0;
}

AVCodecID codec_of(std::span<const std::byte> bytes, const std::string& name) {
  if (begins_with(bytes, "\x89PNG\r\n\x1a\n")) {
    return AV_CODEC_ID_PNG;
  }
  if (begins_with(bytes, "\xff\xd8\xff")) {
    return AV_CODEC_ID_MJPEG;
  }
  fail(name, "neither PNG nor JPEG; convert it to one of them");
}

libav::FrameHandle decode(std::span<const std::byte> bytes, const std::string& name) {
  libav::gather_log();
  libav::forget_log();
  const AVCodec* codec = avcodec_find_decoder(codec_of(bytes, name));
  if (codec == nullptr) {
    fail(name, "this libavcodec has no decoder for it; install Debian's libavcodec59");
  }
  const libav::CodecContext context(avcodec_alloc_context3(codec));
  if (!context) {
    throw std::bad_alloc();
  }
  context->thread_count = 1;
  context->max_pixels = std::int64_t{max_size} * max_size;
  context->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
  if (const int error = avcodec_open2(context.get(), codec, nullptr); error < 0) {
    fail(name, libav::reason(error));
  }
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max() / 2)) {
    fail(name, "larger than 1 GiB");
  }
  const libav::PacketHandle packet = libav::make_packet();
  if (av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0) {
    throw std::bad_alloc();
  }
  std::memcpy(packet->data, bytes.data(), bytes.size());
  libav::FrameHandle frame = libav::make_frame();
  int error = avcodec_send_packet(context.get(), packet.get());
  if (error >= 0) {
    avcodec_send_packet(context.get(), nullptr);
    error = avcodec_receive_frame(context.get(), frame.get());
  }
  if (error < 0) {
    fail(name, libav::reason(error) + "; is the file whole?");
  }
  if (frame->width > max_size || frame->height > max_size) {
    fail(name, "larger than 16384 a side");
  }
  return frame;
}

}  // namespace

Still8 decode_still8(std::span<const std::byte> file_bytes, const std::string& name) {
  const libav::FrameHandle frame = decode(file_bytes, name);
  const auto format = static_cast<AVPixelFormat>(frame->format);
  const AVPixFmtDescriptor* description = av_pix_fmt_desc_get(format);
  const bool alpha = (description->flags & AV_PIX_FMT_FLAG_ALPHA) != 0 || format == AV_PIX_FMT_PAL8;

  Still8 still{frame->width, frame->height, alpha ? 4 : 3, {}};
  const int stride = still.width * still.channels;
  still.texels.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(still.height));
  const libav::Scaler scaler(sws_getContext(
      frame->width, frame->height, format, frame->width, frame->height,
      alpha ? AV_PIX_FMT_RGBA : AV_PIX_FMT_RGB24,
      SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr));
  if (!scaler) {
    fail(name, std::string("pixels of a kind not handled: ") + description->name);
  }
  std::uint8_t* const to = still.texels.data();
  sws_scale(scaler.get(), frame->data, frame->linesize, 0, frame->height, &to, &stride);
  return still;
}

}  // namespace capture
