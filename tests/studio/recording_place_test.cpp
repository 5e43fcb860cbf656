// Places in recordings, whatever their frames' times.
#include "studio/recording_place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/image.h"

namespace studio::recording_place_test {
namespace {

using namespace std::chrono_literals;

// A recording whose frames have these times.
struct Recorded {
  std::vector<capture::Time> times;
  bool begins_anywhere = true;
  int opened = 0;
};

class RecordedCamera final : public capture::Camera {
 public:
  RecordedCamera(Recorded& of, const capture::CameraOptions& options)
      : times_(of.times), next_(static_cast<std::size_t>(options.frame.value_or(0))) {
    ++of.opened;
    if (next_ > 0 && !of.begins_anywhere) throw std::runtime_error("it begins at 0 only");
    info_.width = info_.height = 1;
    info_.frames = static_cast<std::int64_t>(times_.size());
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (next_ >= times_.size()) return std::nullopt;
    capture::Frame frame;
    frame.number = static_cast<std::int64_t>(next_);
    frame.time = times_[next_++];
    frame.image = std::make_shared<capture::Image>(capture::make_image(1, 1));
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::vector<capture::Time> times_;
  std::size_t next_;
};

RecordingPlace place_in(Recorded& recorded, capture::Time time, bool loop = false) {
  capture::register_camera("placed", [&](std::string_view, const capture::CameraOptions& o) {
    return std::make_unique<RecordedCamera>(recorded, o);
  });
  capture::CameraOptions options;
  options.loop = loop;
  recorded.opened = 0;
  return find_place("placed:", options, time);
}

Recorded even(std::int64_t frames) {
  Recorded recorded;
  for (std::int64_t n = 0; n < frames; ++n) recorded.times.push_back(n * 40ms);
  return recorded;
}

TEST(RecordingPlace, IsTheNewestFrameThatIsNotAfterTheTime) {
  Recorded steady = even(10'000), uneven = even(1000);
  for (std::size_t n = 0; n < uneven.times.size(); ++n) {
    const auto k = static_cast<int>(n);
    uneven.times[n] += k * k * 1ms + (k > 400 ? 1h : 0s);
  }
  for (Recorded* recorded : {&steady, &uneven}) {
    for (const std::size_t n : {0U, 1U, 2U, 399U, 400U, 401U, 998U, 999U}) {
      const capture::Time time = recorded->times[n];
      const auto frame = static_cast<std::int64_t>(n);
      EXPECT_EQ(place_in(*recorded, time + 1ms).frame, frame);
      EXPECT_LE(recorded->opened, recorded == &steady ? 5 : 20) << n;
      EXPECT_EQ(place_in(*recorded, time - 1ms).frame, std::max<std::int64_t>(frame - 1, 0));
    }
  }
  EXPECT_EQ(place_in(uneven, 1000h).frame, 999) << "it has ended";
  EXPECT_EQ(place_in(uneven, -1s).frame, 0);
}

TEST(RecordingPlace, CountsThePassesOfOneThatLoops) {
  Recorded recorded = even(100);
  const RecordingPlace place = place_in(recorded, 3 * 4s + 40ms * 70 + 1ms, true);
  EXPECT_EQ(place.frame, 70);
  EXPECT_EQ(place.passed, 3 * 4s);
}

TEST(RecordingPlace, IsTheBeginningWhereNoOtherCanBeHad) {
  Recorded one = even(1), two = even(2), whole = even(100);
  whole.begins_anywhere = false;
  for (Recorded* recorded : {&one, &two, &whole}) {
    const RecordingPlace place = place_in(*recorded, 3s, true);
    EXPECT_EQ(place.frame, 0);
    EXPECT_EQ(place.passed, capture::Time{});
  }
}

}  // namespace
}  // namespace studio::recording_place_test
