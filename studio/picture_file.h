// A file that has the newest picture of a show while it runs, for whatever viewer looks at it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "capture/frame.h"

namespace studio {

// Writes PNG on a thread of its own, each time whole (capture::write_file).
class PictureFile {
 public:
  using Codes = std::shared_ptr<const std::vector<std::uint8_t>>;  // (height, width, 3)

  // `period`: from one writing to the next, at least. `failed` is told on that thread why a picture
  // could not be written, of several in a row only the first one.
  PictureFile(std::string path,
              int width,
              int height,
              std::chrono::milliseconds period,
              std::function<void(const std::string&)> failed,
              capture::Rational pixel_aspect = {1, 1});
  PictureFile(const PictureFile&) = delete;
  PictureFile& operator=(const PictureFile&) = delete;

  // Waits for no file. What comes sooner than it can be written is passed over for the newest.
  void show(Codes rgb8);
  // Once no more comes: writes the last one, if it is not there yet. Throws as capture::write_png.
  void finish();

 private:
  void write_on(const std::stop_token& stop);

  std::string path_;
  int width_, height_;
  std::chrono::milliseconds period_;
  std::function<void(const std::string&)> failed_;
  capture::Rational pixel_aspect_;
  std::mutex mutex_;
  std::condition_variable_any shown_;
  Codes next_;           // not written yet; by mutex_
  std::jthread thread_;  // last: it uses the others
};

}  // namespace studio
