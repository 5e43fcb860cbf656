// Handles of libav, and its log.
#include "capture/libav.h"

#include <array>
#include <cstdarg>
#include <mutex>
#include <new>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libswresample/swresample.h>
#include <libswscale/swscale.h>
}

namespace capture::libav {
namespace {

thread_local std::string last_complaint;

void keep_complaint(void* /*context*/, int level, const char* format, va_list arguments) {
  if (level > AV_LOG_ERROR) {
    return;
  }
  std::array<char, 256> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  last_complaint = text.data();
  while (!last_complaint.empty() &&
         (last_complaint.back() == '\n' || last_complaint.back() == '.' ||
          last_complaint.back() == ' ')) {
    last_complaint.pop_back();
  }
}

}  // namespace

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

void forget_log() { last_complaint.clear(); }

std::string reason(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  std::string words = text.data();
  if (!last_complaint.empty()) {
    words += " (" + last_complaint + ")";
  }
  return words;
}

}  // namespace capture::libav
