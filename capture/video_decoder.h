// Pictures of a video stream in order, the lost ones among them. For the files that wrap libav.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>

#include "capture/frame.h"
#include "capture/media_file.h"

struct AVFrame;

namespace capture {

struct DecodedPicture {
  const AVFrame* frame = nullptr;   // null if lost; good until the next call
  std::optional<std::int64_t> pts;  // in the stream's time base
  FrameStatus status = FrameStatus::good;
  std::string note;
};

// Decodes the video track of `file`, which must outlive it. At most two threads.
class VideoDecoder {
 public:
  // `alpha`: with that of VP8 and VP9, which only some decoders read. Throws std::runtime_error
  // with path and reason.
  VideoDecoder(MediaFile& file, bool alpha);

  // The next picture in the order of showing; nothing at the end. A packet that the decoder refuses
  // becomes a lost picture in its place; pictures with concealed errors are damaged.
  std::optional<DecodedPicture> next();

  // Ready for the packets of a rewound file.
  void restart();

 private:
  bool feed();
  void take(AVFrame& frame);
  void lose_before(std::optional<std::int64_t> pts);
  void note_error(int error);

  MediaFile& file_;
  libav::Complaints complaints_;
  libav::CodecContext context_;
  libav::FrameHandle frame_;
  std::deque<DecodedPicture> ready_;     // lost ones, and then the frame
  std::multiset<std::int64_t> awaited_;  // pts of packets sent and not seen again
  // Some files stamp pictures that are shown in another order as they are decoded: then the stamps
  // themselves are right, but belong to other pictures. Known from the first packet on.
  std::optional<bool> in_decoding_order_;
  int errors_ = 0;  // reported and not yet matched with a lost picture
  std::string error_note_;
  int stalled_ = 0;  // errors in a row without a packet taken
  bool drained_ = false;
};

}  // namespace capture
