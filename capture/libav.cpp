// Handles of libav, and its log.
#include "capture/libav.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <utility>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libswresample/swresample.h>
#include <libswscale/swscale.h>
}

namespace capture::libav {
namespace {

thread_local std::string complaints_here;
constexpr std::size_t max_kept = 200;  // characters

void keep_complaint(void* context, int level, const char* format, va_list arguments) {
  if (level > AV_LOG_ERROR) {
    return;
  }
  std::array<char, 256> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  std::string complaint = text.data();
  complaint.erase(complaint.find_last_not_of(" .\n") + 1);
  if (complaint.empty()) {
    return;
  }
  if (complaints_here.size() < max_kept) {
    complaints_here += (complaints_here.empty() ? "" : "; ") + complaint;
  }
  const bool by_codec =
      context != nullptr && *static_cast<const AVClass**>(context) == avcodec_get_class();
  if (by_codec && static_cast<AVCodecContext*>(context)->opaque != nullptr) {
    static_cast<Complaints*>(static_cast<AVCodecContext*>(context)->opaque)
        ->add(std::move(complaint));
  }
}

}  // namespace

void check_size(int width, int height) {
  const std::int64_t bytes = std::int64_t{width} * height * 3 * std::int64_t{sizeof(float)};
  if (width < 1 || height < 1 || width > max_side || height > max_side || bytes > max_image_bytes) {
    throw std::runtime_error("a picture of " + std::to_string(width) + " x " +
                             std::to_string(height) +
                             " is too large: at most 16384 a side, and 1 GiB in floats");
  }
}

void Complaints::add(std::string complaint) {
  const std::lock_guard lock(mutex_);
  last_ = std::move(complaint);
}

std::string Complaints::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(last_, {});
}

CodecContext make_decoder(int codec_id,
                          int threads,
                          Complaints* complaints,
                          const char* preferred) {
  gather_log();
  if (codec_id == AV_CODEC_ID_NONE) {
    throw std::runtime_error("what is in it is of no known kind; is the file whole?");
  }
  const AVCodec* codec = preferred == nullptr ? nullptr : avcodec_find_decoder_by_name(preferred);
  if (codec == nullptr) codec = avcodec_find_decoder(static_cast<AVCodecID>(codec_id));
  if (codec == nullptr) {
    throw std::runtime_error(std::string("this libavcodec has no decoder for ") +
                             avcodec_get_name(static_cast<AVCodecID>(codec_id)) +
                             "; convert it with ffmpeg");
  }
  CodecContext context(avcodec_alloc_context3(codec));
  if (!context) {
    throw std::bad_alloc();
  }
  context->thread_count = threads;
  context->max_pixels = max_image_bytes / std::int64_t{3 * sizeof(float)};
  context->opaque = complaints;
  return context;
}

void Free::operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
void Free::operator()(AVFormatContext* context) const { avformat_close_input(&context); }
void Free::operator()(AVFrame* frame) const { av_frame_free(&frame); }
void Free::operator()(AVPacket* packet) const { av_packet_free(&packet); }
void Free::operator()(SwrContext* context) const { swr_free(&context); }
void Free::operator()(SwsContext* context) const { sws_freeContext(context); }

FrameHandle make_frame() {
  FrameHandle frame(av_frame_alloc());
  if (!frame) {
    throw std::bad_alloc();
  }
  return frame;
}

PacketHandle make_packet() {
  PacketHandle packet(av_packet_alloc());
  if (!packet) {
    throw std::bad_alloc();
  }
  return packet;
}

void gather_log() {
  static std::once_flag once;
  std::call_once(once, [] { av_log_set_callback(keep_complaint); });
}

void forget_log() { complaints_here.clear(); }

std::string reason(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  std::string words = text.data();
  if (!complaints_here.empty()) {
    words += " (" + complaints_here + ")";
  }
  return words;
}

}  // namespace capture::libav
