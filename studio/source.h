// A camera read by the show's clock.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera.h"
#include "capture/live_reader.h"

namespace studio {

// Gives the newest frame whose time is not after a time asked for (of a file: by more than a
// microsecond, for times are rounded); frames in between are passed over. So two sources of
// different rates stay together, and one that stalls shows its last frame.
// A live camera is read on a thread of its own: only what has come counts, and nobody waits. It
// keeps no more than a few frames whose time has not come; where these are more, the first of them
// comes before its time.
class Source {
 public:
  // Reads the first frame. Throws std::runtime_error if there is none.
  explicit Source(std::unique_ptr<capture::Camera> camera);

  const capture::CameraInfo& info() const;
  capture::CameraStatistics statistics() const;
  const capture::Frame& first() const { return first_; }
  // A single picture, which is there for ever.
  bool is_still() const { return still_; }
  bool is_live() const { return live_ != nullptr; }

  // Times asked for must not fall. Before the first frame's time: the first frame. Nothing once the
  // camera has ended and its last frame was due for longer than a frame lasts. One frame is read
  // ahead, so that the next call finds it decoded.
  std::optional<capture::Frame> at(capture::Time time);

  // Every frame since the last call, or the last at(), up to and including those of this time, but
  // no more than `most`: then there are others. A show that was held up may be late by thousands.
  std::vector<capture::Frame> advance(capture::Time time, std::size_t most);
  // The frame that at() or advance() came to last, though the source has ended.
  const capture::Frame& current() const { return current_.frame; }
  // Whether it has no more frames, and its last was due for longer than a frame lasts.
  bool has_ended(capture::Time time) const;
  // By how much after a time a frame may be stamped and still counts as of that time.
  capture::Time early() const;
  // Of the frame that comes next; nothing at the end, and before a live one has come.
  std::optional<capture::Time> next_time() const;

  // Of a live camera: the newest frame that has come. Waits, until `until` on the monotonic clock
  // or the camera's end, for one that at() and advance() have not given, of `soonest` or later.
  const capture::Frame& wait_for_newer(capture::Time until, capture::Time soonest = {});
  // Of a live camera: when the frame that at() gave last was there, on the monotonic clock.
  capture::Time arrived() const { return current_.arrived; }

  // Reads ahead as far as the sound up to this time takes, but no more than a few frames; nothing
  // where there is no sound, and of a live camera.
  void read_sound_to(capture::Time time);
  // The sound up to a time, and no further than the frames that were read so far, that was not
  // taken yet; none of a live camera.
  std::optional<capture::Sound> take_sound(capture::Time until);

 private:
  void read_ahead();
  bool step(capture::Time time);
  void fetch(capture::Time until);
  const capture::Frame& newest() const;

  std::unique_ptr<capture::Camera> camera_;    // null = a live one
  std::unique_ptr<capture::LiveReader> live_;  // null = a file's
  capture::Frame first_;
  capture::Arrival current_;
  std::deque<capture::Arrival> next_;  // a file's next frame; all that have come of a live one
  capture::Time period_{};             // between the last two frames
  bool still_ = false;
};

}  // namespace studio
