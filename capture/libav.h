// Handles of libav that free themselves, and its errors in words. For the files that wrap libav.
#pragma once

#include <memory>
#include <string>

struct AVCodecContext;
struct AVFormatContext;
struct AVFrame;
struct AVPacket;
struct SwrContext;
struct SwsContext;

namespace capture::libav {

struct Free {
  void operator()(AVCodecContext* context) const;
  void operator()(AVFormatContext* context) const;  // opened for input
  void operator()(AVFrame* frame) const;
  void operator()(AVPacket* packet) const;
  void operator()(SwrContext* context) const;
  void operator()(SwsContext* context) const;
};

using CodecContext = std::unique_ptr<AVCodecContext, Free>;
using FormatContext = std::unique_ptr<AVFormatContext, Free>;
using FrameHandle = std::unique_ptr<AVFrame, Free>;
using PacketHandle = std::unique_ptr<AVPacket, Free>;
using Resampler = std::unique_ptr<SwrContext, Free>;
using Scaler = std::unique_ptr<SwsContext, Free>;

// Throw std::bad_alloc where libav returns null.
FrameHandle make_frame();
PacketHandle make_packet();

// From now on libav writes nothing to stderr; its last complaint in each thread is kept for
// `reason`. Cheap to call again.
void gather_log();
// Forgets this thread's last complaint.
void forget_log();
// What went wrong: libav's words for `error`, and its last complaint in this thread, if any.
std::string reason(int error);

}  // namespace capture::libav
