// Handles of libav that free themselves, and its errors in words. For the files that wrap libav.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

struct AVCodecContext;
struct AVCodecParameters;
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

// The largest pictures that are decoded: a hostile header cannot claim more memory than these.
inline constexpr int max_side = 16384;
inline constexpr std::int64_t max_image_bytes = std::int64_t{1} << 30;  // as floats

// Throws std::runtime_error, without a file name, if a picture is larger than that.
void check_size(int width, int height);

// Throw std::bad_alloc where libav returns null.
FrameHandle make_frame();
PacketHandle make_packet();

// What a decoder complained about, from whichever of its threads.
class Complaints {
 public:
  void add(std::string complaint);
  // The last one since the previous call; "" if none.
  std::string take();

 private:
  std::mutex mutex_;
  std::string last_;
};

// A decoder that is not yet open: `threads` of them at most, sizes bounded. Its complaints go to
// `complaints`, if any, which must outlive it. `preferred`: the name of the one to take if libav
// has it, null = its first. Throws std::runtime_error, without a file name, if
// libav has none for it.
CodecContext make_decoder(int codec_id,
                          int threads,
                          Complaints* complaints,
                          const char* preferred = nullptr);

// From now on libav writes nothing to stderr; its complaints in each thread are kept for
// `reason`. Cheap to call again.
void gather_log();
// Forgets this thread's complaints.
void forget_log();
// What went wrong: libav's words for `error`, and its complaints in this thread, if any.
std::string reason(int error);

}  // namespace capture::libav
