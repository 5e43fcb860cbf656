// Plates that come as time goes by: which of their pictures a show takes, and when.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::live_plate_test {
namespace {

using namespace std::chrono_literals;

using LivePlateTest = MadeShowTest;

#ifdef __SANITIZE_THREAD__
constexpr bool is_too_slow_for_live = true;
#else
constexpr bool is_too_slow_for_live = false;
#endif

TEST_F(LivePlateTest, IsFollowed) {
  Show show(made_set("live_grey:40,50"));
  std::vector<std::int64_t> numbers;
  show.run([&](const ShownFrame& shown) {
    numbers.push_back(shown.prepared.job.frame);
    const capture::Time shown_picture = shown.prepared.job.textures[0].time;
    EXPECT_EQ(shown_picture, shown.prepared.job.time) << "each frame is of its picture's time";
  });
  const ShowStatus status = *show.status();
  EXPECT_EQ(numbers.front(), 0);
  EXPECT_TRUE(std::ranges::is_sorted(numbers));
  EXPECT_EQ(status.frames + status.dropped, numbers.back() + 1);
  EXPECT_LE(numbers.back(), 40);
  EXPECT_GT(status.delay_frames, 0);
}

TEST_F(LivePlateTest, IsPassedOverInPartIfItIsFaster) {
  ShowOptions options;
  options.rate = capture::Rational{20, 1};
  Show show(made_set("live_grey:60,100"), options);
  std::vector<capture::Time> times;
  show.run([&](const ShownFrame& shown) { times.push_back(shown.prepared.job.time); });
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_GE(times[i] - times[i - 1], 37ms);
  EXPECT_LE(times.size(), 20U);
}

// Says 50 frames a second, but its frames come as `step` has it, and are counted one by one.
class UnevenCamera final : public GreyCamera {
 public:
  UnevenCamera(std::int64_t frames, std::function<capture::Time(std::int64_t)> step)
      : GreyCamera(frames, {50, 1}, 0), step_(std::move(step)), time_(capture::monotonic_now()) {
    info_.live = true;
  }
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (!frame) return frame;
    frame->time = time_ += step_(frame->number);
    std::this_thread::sleep_for(frame->time - capture::monotonic_now());
    return frame;
  }

 private:
  std::function<capture::Time(std::int64_t)> step_;
  capture::Time time_;
};

// A take's frames are counted by its clock, or it would play too fast.
TEST_F(LivePlateTest, IsCountedByItsClockWhereTheCameraIsAnotherOneThanItSays) {
  if (is_too_slow_for_live) GTEST_SKIP() << "a first frame takes longer than the plate lasts";
  std::function<capture::Time(std::int64_t)> step;
  capture::register_camera("uneven", [&](std::string_view rest, const capture::CameraOptions&) {
    return std::make_unique<UnevenCamera>(std::stol(std::string(rest)), step);
  });
  const auto expect_by_clock = [&](const char* frames) {
    Show show(made_set("uneven:" + std::string(frames)));
    std::optional<capture::Time> first;
    show.run([&](const ShownFrame& shown) {
      const render::FrameJob& job = shown.prepared.job;
      if (!first) first = job.time;
      const double place = 50 * std::chrono::duration<double>(job.time - *first).count();
      EXPECT_NEAR(static_cast<double>(job.frame), place, 2.01);
    });
    EXPECT_GT(show.status()->frames, 5);
  };
  step = [](std::int64_t) { return 50ms; };  // as in the dark
  expect_by_clock("20");
  step = [](std::int64_t n) { return n == 10 ? capture::Time(900ms) : capture::Time(20ms); };
  expect_by_clock("30");
  step = [](std::int64_t) { return 16ms; };
  expect_by_clock("60");
}

// Its pictures are there a while after the time of their stamps, and that is off by up to `jitter`,
// one to one side and the next one to the other. From number `gap` on, four are missing.
class LateCamera final : public GreyCamera {
 public:
  LateCamera(capture::Rational rate, capture::Time delay, capture::Time jitter, std::int64_t gap)
      : GreyCamera(50, rate, 0), delay_(delay), jitter_(jitter), gap_(gap) {
    info_.live = true;
  }
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (!frame) return frame;
    if (frame->number >= gap_) frame->number += 4;
    const capture::Time even = start_ + capture::time_of_frame(frame->number, info_.rate);
    frame->time = frame->number % 2 == 0 ? even + jitter_ : even - jitter_;
    std::this_thread::sleep_for(even + delay_ - capture::monotonic_now());
    return frame;
  }

 private:
  capture::Time start_ = capture::monotonic_now();
  capture::Time delay_, jitter_;
  std::int64_t gap_;
};

TEST_F(LivePlateTest, ShowsEachPictureHoweverUnevenItsStamps) {
  if (is_too_slow_for_live) GTEST_SKIP() << "a first frame takes longer than the plate lasts";
  capture::register_camera("late", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<LateCamera>(capture::Rational{12, 1}, 60ms, 25ms, 1000);
  });
  Show show(made_set("late:1"));
  show.run();
  EXPECT_GE(show.status()->frames, 38);  // busy machines are late for some
}

// One gap, and a show that counted by when pictures usually come would be ahead of them for ever.
TEST_F(LivePlateTest, IsFoundBackToThoughItIsLateByManyFrames) {
  if (is_too_slow_for_live) GTEST_SKIP() << "a first frame takes longer than the plate lasts";
  capture::register_camera("late", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<LateCamera>(capture::Rational{12, 1}, 700ms, 0ms, 15);
  });
  Show show(made_set("late:1"));
  std::int64_t of_their_time = 0;
  show.run([&](const ShownFrame& shown) {
    const render::FrameJob& job = shown.prepared.job;
    of_their_time += job.textures[0].time == job.time ? 1 : 0;
  });
  EXPECT_GE(of_their_time, 38);  // busy machines are late for some
}

TEST_F(LivePlateTest, LosesPicturesThatTheShowIsTooSlowFor) {
  if (is_too_slow_for_live) GTEST_SKIP() << "a first frame takes longer than the plate lasts";
  Show show(made_set("live_grey:60,50"));
  show.run([](const ShownFrame&) { std::this_thread::sleep_for(90ms); });
  EXPECT_GT(show.status()->dropped, 10);
  EXPECT_LT(show.status()->frames, 40);
}

}  // namespace
}  // namespace studio::live_plate_test
