// Recordings of cameras: folders that replay: plays again, the very same frames.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>

#include "capture/frame.h"

namespace capture {

struct RecordingStatistics {
  std::int64_t frames = 0;   // in the recording; the following are among them
  std::int64_t lost = 0;     // that the camera lost
  std::int64_t skipped = 0;  // that the disk was too slow for: recorded as lost
  std::int64_t bytes = 0;    // of pictures
};

// Writes frames.csv (see replay.h) and a .coded file for each frame. A list's line is written after
// its picture, so that a recording that is cut off plays up to there. Files are written by a
// thread of its own; one thread calls.
class FrameRecording {
 public:
  // Makes the folder. Throws std::runtime_error with path and reason if it cannot be made, or
  // holds a recording.
  explicit FrameRecording(const std::filesystem::path& folder);
  ~FrameRecording();
  FrameRecording(const FrameRecording&) = delete;
  FrameRecording& operator=(const FrameRecording&) = delete;

  // Does not wait for the disk: a frame that comes while too many are still unwritten is recorded
  // as lost. Throws std::invalid_argument for a frame without the bytes that came
  // (CameraOptions::keep_coded), unless it is lost; std::runtime_error with path and reason once a
  // file could not be written.
  void add(const Frame& frame);
  // Waits until all is written. Throws as add().
  void finish();
  // Once a file could not be written, `frames` are those before it: they play.
  RecordingStatistics statistics() const;

 private:
  void write_all();
  void write(const Frame& frame);
  void rethrow() const;

  std::filesystem::path folder_;
  std::ofstream list_;
  Time first_{};
  std::int64_t written_ = 0;  // of the writing thread

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> queue_;
  std::int64_t kept_ = 0;  // frames that were written whole
  bool finishing_ = false;
  std::string failure_;
  RecordingStatistics statistics_;
  std::thread writer_;
};

}  // namespace capture
