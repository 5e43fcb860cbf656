// A camera read by the show's clock.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "capture/camera.h"

namespace studio {

// Gives the newest frame whose time is not after a time asked for; frames in between are passed
// over. So two sources of different rates stay together, and one that stalls shows its last frame.
class Source {
 public:
  // Reads the first frame. Throws std::runtime_error if there is none.
  explicit Source(std::unique_ptr<capture::Camera> camera);

  const capture::CameraInfo& info() const { return camera_->info(); }
  capture::CameraStatistics statistics() const { return camera_->statistics(); }
  const capture::Frame& first() const { return first_; }
  // A single picture, which is there for ever.
  bool is_still() const { return still_; }

  // Times asked for must not fall. Before the first frame's time: the first frame. Nothing once the
  // camera has ended and its last frame was due for longer than a frame lasts. One frame is read
  // ahead, so that the next call finds it decoded.
  std::optional<capture::Frame> at(capture::Time time);

  // Every frame since the last call, or the last at(), up to and including those of this time.
  std::vector<capture::Frame> advance(capture::Time time);
  // Of the frame that comes next; nothing at the end.
  std::optional<capture::Time> next_time() const;

  // Sound up to the frames that at() has read so far, in order.
  std::vector<capture::Sound> take_sound();

 private:
  void read_ahead();

  std::unique_ptr<capture::Camera> camera_;
  capture::Frame first_;
  capture::Frame current_;
  std::optional<capture::Frame> next_;
  capture::Time period_{};  // between the last two frames
  bool still_ = false;
  std::vector<capture::Sound> sound_;
};

}  // namespace studio
