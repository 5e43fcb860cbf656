// Whole pictures of interlaced ones, through libavfilter. For the files that wrap libav.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "capture/libav.h"

struct AVFilterContext;
struct AVFilterGraph;

namespace capture {

// Takes the field that came first, and makes the rows of the other from the rows around them, in
// the picture and in those before and after it, by libavfilter's bwdif. Each field's chroma is of
// its own rows. A picture's bits depend on it and these two alone. Not thread-safe.
//
// bwdif is T. Mundt's (2016), after M. Niedermayer's yadif and M. Weston's three-field filter of
// BBC R&D (w3fdif).
class Deinterlacer {
 public:
  Deinterlacer();
  ~Deinterlacer();
  Deinterlacer(const Deinterlacer&) = delete;
  Deinterlacer& operator=(const Deinterlacer&) = delete;

  // Turns a picture whose samples lie packed, which the filter does not take, into one of the same
  // samples in planes, where libav has such a format; leaves others as they are.
  void unpack(libav::FrameHandle& picture);

  // The picture, made whole: good until the next call. Null if it cannot be: why_not() says.
  // `before` and `after` are null where there are none, and count as none if their size or format
  // is another. Without one before, the rows are made from those around them alone.
  const AVFrame* make_whole(const AVFrame* before,
                            const AVFrame& picture,
                            const AVFrame* after,
                            bool top_field_first);
  const std::string& why_not() const { return why_not_; }

 private:
  struct Graph;
  void forget();
  bool build(const AVFrame& like);
  bool give(const AVFrame& picture, bool interlaced, bool top_field_first);
  bool filter(const AVFrame& before,
              const AVFrame& picture,
              const AVFrame& after,
              bool top_field_first);

  std::unique_ptr<Graph> graph_;  // of like_; null = none that works
  bool is_fresh_ = false;         // the graph has made no picture
  std::string why_not_;
  libav::FrameHandle like_;   // size and format; without a picture
  libav::FrameHandle given_;  // on its way into the graph
  libav::FrameHandle whole_;
  libav::Scaler scaler_;
  libav::FrameHandle packed_like_;  // what scaler_ takes
  std::int64_t stamp_ = 0;          // of the picture given last
};

}  // namespace capture
