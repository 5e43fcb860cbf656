// Live cameras read ahead: nobody waits, and nothing piles up.
#include "capture/live_reader.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace capture::live_reader_test {
namespace {

using namespace std::chrono_literals;

// Gives frames when the test lets it, up to a number.
class SteppedCamera final : public Camera {
 public:
  explicit SteppedCamera(std::atomic<int>& allowed, int frames)
      : allowed_(allowed), frames_(frames) {
    info_.live = true;
  }
  const CameraInfo& info() const override { return info_; }
  std::optional<Frame> next() override {
    if (given_ == frames_) return std::nullopt;
    while (given_ >= allowed_) std::this_thread::sleep_for(1ms);
    Frame frame;
    frame.number = given_++;
    frame.time = monotonic_now();
    statistics_.delivered = given_;
    return frame;
  }
  CameraStatistics statistics() const override { return statistics_; }

 private:
  std::atomic<int>& allowed_;
  int frames_;
  int given_ = 0;
  CameraInfo info_;
  CameraStatistics statistics_;
};

constexpr Time long_time = 60s;

TEST(LiveReader, GivesFramesInOrderAsTheyCome) {
  std::atomic<int> allowed = 0;
  LiveReader reader(std::make_unique<SteppedCamera>(allowed, 100), 8);
  EXPECT_TRUE(reader.take().empty());
  for (int i = 0; i < 5; ++i) {
    ++allowed;
    const std::vector<Arrival> came = reader.take(monotonic_now() + long_time);
    ASSERT_EQ(came.size(), 1U);
    EXPECT_EQ(came[0].frame.number, i);
    EXPECT_GE(came[0].arrived, came[0].frame.time);
    EXPECT_LE(came[0].arrived, monotonic_now());
  }
  EXPECT_EQ(reader.statistics().delivered, 5);
  allowed = 1000;
}

TEST(LiveReader, KeepsTheNewestOfThoseThatNobodyTakes) {
  std::atomic<int> allowed = 50;
  LiveReader reader(std::make_unique<SteppedCamera>(allowed, 50), 3);
  while (reader.statistics().delivered < 50 || reader.passed_over() < 47) {
    std::this_thread::sleep_for(1ms);
  }
  const std::vector<Arrival> came = reader.take();
  ASSERT_EQ(came.size(), 3U);
  EXPECT_EQ(came.front().frame.number, 47);
  EXPECT_EQ(reader.passed_over(), 47);
}

TEST(LiveReader, EndsWithItsCameraOnceAllFramesAreTaken) {
  std::atomic<int> allowed = 2;
  LiveReader reader(std::make_unique<SteppedCamera>(allowed, 2), 8);
  std::size_t came = 0;
  while (!reader.ended()) came += reader.take(monotonic_now() + long_time).size();
  EXPECT_EQ(came, 2U);
  EXPECT_TRUE(reader.take(monotonic_now() + long_time).empty()) << "and does not wait any more";
}

class FailingCamera final : public Camera {
 public:
  FailingCamera() { info_.live = true; }
  const CameraInfo& info() const override { return info_; }
  std::optional<Frame> next() override {
    if (given_ == 2) throw std::invalid_argument("no such exposure");
    Frame frame;
    frame.number = given_++;
    frame.image = image_;
    frame.time = monotonic_now();
    return frame;
  }
  CameraStatistics statistics() const override { return {}; }
  const std::shared_ptr<const Image> image_ = std::make_shared<Image>(make_image(2, 2));

 private:
  int given_ = 0;
  CameraInfo info_;
};

TEST(LiveReader, EndsWithANoteWhateverItsCameraThrows) {
  auto camera = std::make_unique<FailingCamera>();
  const auto image = camera->image_;
  LiveReader reader(std::move(camera), 8);
  std::vector<Frame> frames;
  while (!reader.ended()) {
    for (Arrival& came : reader.take(monotonic_now() + long_time)) frames.push_back(came.frame);
  }
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[2].status, FrameStatus::lost);
  EXPECT_EQ(frames[2].note, "no such exposure");
  EXPECT_EQ(frames[2].number, 2);
  EXPECT_GT(frames[2].time, frames[1].time);
  EXPECT_EQ(frames[2].image, image);
}

TEST(LiveReader, RefusesToKeepNothing) {
  std::atomic<int> allowed = 0;
  EXPECT_THROW(LiveReader(std::make_unique<SteppedCamera>(allowed, 0), 0), std::invalid_argument);
}

}  // namespace
}  // namespace capture::live_reader_test
