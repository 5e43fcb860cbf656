// Live cameras read on a thread of their own, so that nobody else waits for them.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "capture/camera.h"

namespace capture {

// The monotonic clock, which live frames' times are of.
Time monotonic_now();

// A frame and when its last byte was there, on the monotonic clock.
struct Arrival {
  Frame frame;
  Time arrived{};
};

// A camera that throws has ended: its last frame is a lost one that says why.
class LiveReader {
 public:
  // Keeps the newest `most_waiting` frames for whoever takes them, at least 1.
  LiveReader(std::unique_ptr<Camera> camera, std::size_t most_waiting);
  // Waits for the camera's present frame.
  ~LiveReader();
  LiveReader(const LiveReader&) = delete;
  LiveReader& operator=(const LiveReader&) = delete;

  const CameraInfo& info() const { return info_; }

  // All frames that came since the last call, in order. Waits until there is one, the camera has
  // ended, or it is `until` on the monotonic clock.
  std::vector<Arrival> take(Time until = {});
  // Whether no more frames will come.
  bool ended() const;
  CameraStatistics statistics() const;
  // Frames that nobody took in time.
  std::int64_t passed_over() const;

 private:
  void read_all();

  std::unique_ptr<Camera> camera_;  // of the reading thread once it runs
  CameraInfo info_;
  std::size_t most_waiting_;

  mutable std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Arrival> waiting_;
  CameraStatistics statistics_;
  std::int64_t passed_over_ = 0;
  bool ended_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace capture
