// Brings a camera back that went away, on a thread of its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "capture/aravis_stream.h"

namespace capture {

// Closes what is left of a stream, and opens the same camera again with the same settings, trying
// until it succeeds.
class AravisSearch {
 public:
  AravisSearch(std::unique_ptr<AravisStream> gone, AravisDevice device, AravisRequest request);
  // Waits for what it is at: seconds, if the camera does not answer.
  ~AravisSearch();
  AravisSearch(const AravisSearch&) = delete;
  AravisSearch& operator=(const AravisSearch&) = delete;

  // The camera, if it is back by then; else null.
  std::unique_ptr<AravisStream> wait_until(std::chrono::steady_clock::time_point time);
  // Why it could not be opened the last time; "" = it was not tried yet, or did not answer.
  std::string last_fault() const;

 private:
  void search(std::unique_ptr<AravisStream> gone);

  AravisDevice device_;
  AravisRequest request_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<AravisStream> found_;
  std::string fault_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace capture
