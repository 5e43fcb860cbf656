// Pictures of a video stream, deinterlaced. For the files that wrap libav.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "capture/deinterlacer.h"
#include "capture/video_decoder.h"

namespace capture {

enum class Interlacing {
  none,     // one moment's picture, as far as is known
  removed,  // its fields were of two moments, and one was made whole
  left,     // both are in it
  field,    // it is a field of its own, and left as it is
};

struct ProgressivePicture : DecodedPicture {
  Interlacing interlacing = Interlacing::none;
};

// The pictures of a VideoDecoder, one for one with its stamps, statuses and notes. Not thread-safe.
class ProgressiveVideo {
 public:
  // `deinterlace`: all pictures, none of them, or, if it says nothing, those that are marked as
  // interlaced. Throws as VideoDecoder.
  ProgressiveVideo(MediaFile& file, bool alpha, std::optional<bool> deinterlace);

  // As VideoDecoder::next. Reads on to the picture after an interlaced one, as what it is made
  // whole from. `wanted`: else it is only passed over, and may come as it is.
  std::optional<ProgressivePicture> next(bool wanted = true);

  // Ready for the packets of a rewound file.
  void restart();

  // Why the last interlaced picture was left as it is; "" if that is as asked for.
  const std::string& why_left() const { return deinterlacer_.why_not(); }

 private:
  struct Held {
    DecodedPicture picture;    // its frame is not set
    libav::FrameHandle frame;  // null if lost
  };
  bool read();
  const AVFrame* make_whole();
  bool is_interlaced(const AVFrame& picture) const;
  bool has_top_field_first(const AVFrame& picture) const;

  VideoDecoder decoder_;
  std::optional<bool> deinterlace_;
  bool bottom_first_;  // says the stream of pictures that are not marked
  bool codes_fields_;  // marked pictures are single fields
  Deinterlacer deinterlacer_;
  std::deque<Held> ahead_;
  bool ended_ = false;
  libav::FrameHandle shown_;   // of the last call; null before the first
  libav::FrameHandle before_;  // that before it
};

}  // namespace capture
