// Shows that are edited: cameras that can be opened only once, or open when a test lets them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>

#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio {

// Of "sole:", which can be opened only once at a time, as devices can.
inline std::atomic<int> open_now = 0, opened = 0;

// What sources wait for, but not for ever.
class Gate {
 public:
  void shut() {
    const std::lock_guard lock(mutex_);
    open_ = overdue_ = false;
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, std::chrono::seconds(5), [&] { return open_; })) overdue_ = true;
  }
  // Whether somebody waited in vain: whoever was to open it waited for that.
  bool overdue() const {
    const std::lock_guard lock(mutex_);
    return overdue_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = true, overdue_ = false;
};
inline Gate opening, closing;  // of "held:" and "late:"

// Frame n is grey by .1 + (n % 50) / 100; 64x32. Of no frames, it is endless.
class SoleCamera : public capture::Camera {
 public:
  SoleCamera(std::int64_t frames, bool live, const capture::CameraOptions& options)
      : frames_(frames),
        number_(options.frame.value_or(0)),
        begin_(live ? capture::monotonic_now() : capture::Time{}) {
    if (++open_now > 1) {
      --open_now;
      throw std::runtime_error("cannot open sole: it is busy");
    }
    ++opened;
    info_.width = 64;
    info_.height = 32;
    info_.rate = {25, 1};
    info_.frames = frames;
    info_.live = live;
  }
  ~SoleCamera() override { --open_now; }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (frames_ > 0 && number_ == frames_) return std::nullopt;
    capture::Frame frame;
    frame.number = number_;
    frame.time = begin_ + capture::time_of_frame(number_, info_.rate);
    auto image = std::make_shared<capture::Image>(capture::make_image(32, 64));
    std::ranges::fill(image->pixels, 0.1F + static_cast<float>(number_++ % 50) / 100);
    frame.image = std::move(image);
    if (info_.live) std::this_thread::sleep_for(frame.time - capture::monotonic_now());
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::int64_t frames_, number_;
  capture::Time begin_;
};

// The same, which opens and closes when it may.
class HeldCamera final : public SoleCamera {
 public:
  HeldCamera(std::int64_t frames, const capture::CameraOptions& options)
      : SoleCamera(frames, false, options) {
    opening.pass();
  }
  ~HeldCamera() override { closing.pass(); }
};

// The same, which is closed by the time that it says that it is busy.
class TardyCamera final : public SoleCamera {
 public:
  TardyCamera(std::int64_t frames, const capture::CameraOptions& options)
      : SoleCamera(frames, false, options) {}
  ~TardyCamera() override { closing.pass(); }
  static void wait_if_open() {
    if (open_now == 0) return;
    closing.open();
    while (open_now > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    throw std::runtime_error("cannot open tardy: it is busy");
  }
};

inline std::atomic<int> recorded_frames_read = 0;

// A recording of grey frames of 64x32, 25 a second: frame n of them is grey by (n + 1) / 1000.
class RecordedCamera final : public capture::Camera {
 public:
  RecordedCamera(std::int64_t frames, const capture::CameraOptions& options)
      : frames_(frames), number_(options.frame.value_or(0)), loop_(options.loop) {
    info_.width = 64;
    info_.height = 32;
    info_.rate = {25, 1};
    info_.frames = loop_ ? 0 : frames;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (!loop_ && number_ >= frames_) return std::nullopt;
    ++recorded_frames_read;
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_, info_.rate);
    auto image = std::make_shared<capture::Image>(capture::make_image(32, 64));
    std::ranges::fill(image->pixels, static_cast<float>(number_++ % frames_ + 1) / 1000);
    frame.image = std::move(image);
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::int64_t frames_, number_;
  bool loop_;
};

// Opens "sole:FRAMES", "live_sole:FRAMES", "held:FRAMES", "tardy:FRAMES", "late:FRAMES" and
// "recorded:FRAMES".
inline void register_show_cameras() {
  for (const bool live : {false, true}) {
    capture::register_camera(live ? "live_sole" : "sole", [live](std::string_view rest,
                                                                 const capture::CameraOptions& o) {
      return std::make_unique<SoleCamera>(std::stol(std::string(rest)), live, o);
    });
  }
  capture::register_camera("held", [](std::string_view rest, const capture::CameraOptions& o) {
    return std::make_unique<HeldCamera>(std::stol(std::string(rest)), o);
  });
  capture::register_camera("tardy", [](std::string_view rest, const capture::CameraOptions& o) {
    TardyCamera::wait_if_open();
    return std::make_unique<TardyCamera>(std::stol(std::string(rest)), o);
  });
  capture::register_camera("late", [](std::string_view rest, const capture::CameraOptions&) {
    opening.pass();
    const std::int64_t frames = std::stol(std::string(rest));
    return std::make_unique<GreyCamera>(frames, capture::Rational{25, 1}, 0);
  });
  capture::register_camera("recorded", [](std::string_view rest, const capture::CameraOptions& o) {
    return std::make_unique<RecordedCamera>(std::stol(std::string(rest)), o);
  });
}

class EditedShowTest : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    register_show_cameras();
  }
  void SetUp() override {
    MadeShowTest::SetUp();
    opened = 0;
  }

  // A person whom a camera shows, before grey; what stands first moves it down in the file.
  Set person_set(const std::string& source,
                 const std::string& more = "height = 2\nposition = [0, 0, 0]\n",
                 const std::string& first = "") {
    return made_set("grey:1,25,0", first + "[[billboard]]\nsource = \"" + source +
                                       "\"\ncolour = \"linear\"\n" + more);
  }
  // A set with a probe that is a camera.
  Set probe_set(const std::string& source, const std::string& probe, const std::string& more = "") {
    const std::string path = write_made_set(dir_, "grey:1,25,0", more);
    std::string text = text_of(path);
    const std::string sky = "source = \"sky.exr\"\nmatch = [1, 1, 1]\n";
    text.replace(text.find(sky), sky.size(), fmt::format("source = \"{}\"\n{}", source, probe));
    std::ofstream(path) << text;
    return read_set(path);
  }
  static std::string text_of(const std::string& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

inline const std::string placed = "height = 2\nposition = [0, 0, 0]\n";

// Makes frames until one is as it is to be, each beside the edit that is on its way; their notes.
inline std::vector<std::string> make_until(FrameMaker& maker,
                                           std::int64_t& number,
                                           const std::function<bool(const PreparedFrame&)>& done) {
  std::vector<std::string> notes;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (std::chrono::steady_clock::now() < end) {
    const PreparedFrame frame = maker.make(number++).value();
    notes.insert(notes.end(), frame.notes.begin(), frame.notes.end());
    if (done(frame)) return notes;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ADD_FAILURE() << "it never is";
  return notes;
}

}  // namespace studio
