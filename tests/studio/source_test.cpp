// Cameras by the show's clock, and brackets that roll.
#include "studio/source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <thread>

#include "studio/probe_source.h"
#include "studio/quantiles.h"
#include "studio/rolling_bracket.h"
#include "studio/timed_source.h"
#include "tests/studio/made_show.h"

namespace studio::source_test {
namespace {

using namespace std::chrono_literals;

Source grey_source(std::int64_t frames, std::int64_t fps) {
  return Source(std::make_unique<GreyCamera>(frames, capture::Rational{fps, 1}, 0));
}

TEST(Source, GivesTheNewestFrameThatIsNotAfterTheTime) {
  std::mt19937 random(1);
  for (const std::int64_t fps : {7, 25, 60}) {
    Source source = grey_source(1000, fps);
    capture::Time time{};
    for (int i = 0; i < 100; ++i) {
      time += capture::Time(random() % 90'000'000);
      const auto frame = source.at(time);
      ASSERT_TRUE(frame);
      EXPECT_LE(frame->time, time + 1us);
      EXPECT_GT(capture::time_of_frame(frame->number + 1, {fps, 1}), time);
    }
  }
}

TEST(Source, GivesEveryFrameOnceWhicheverItBeginsWith) {
  for (const capture::Rational rate : {capture::Rational{24, 1},
                                       {25, 1},
                                       {30, 1},
                                       {60, 1},
                                       {24000, 1001},
                                       {30000, 1001},
                                       {60000, 1001}}) {
    for (const std::int64_t first : {1, 5, 7, 101}) {
      auto camera = std::make_unique<GreyCamera>(first + 50, rate, 0);
      for (std::int64_t i = 0; i < first; ++i) camera->next();
      Source source(std::move(camera));
      for (std::int64_t n = 0; n < 50; ++n) {
        const auto frame = source.at(source.first().time + capture::time_of_frame(n, rate));
        ASSERT_TRUE(frame);
        ASSERT_EQ(frame->number, first + n) << rate.num << "/" << rate.den;
      }
      EXPECT_FALSE(source.at(source.first().time + capture::time_of_frame(50, rate)));
    }
  }
}

// Tells how many of its pictures there are at once.
class CountedCamera final : public GreyCamera {
 public:
  explicit CountedCamera(std::size_t& most) : GreyCamera(100'000, {25, 1}, 0), most_(most) {}
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    pictures_.push_back(frame->image);
    std::erase_if(pictures_, [](const auto& picture) { return picture.expired(); });
    most_ = std::max(most_, pictures_.size());
    return frame;
  }

 private:
  std::size_t& most_;
  std::vector<std::weak_ptr<const capture::Image>> pictures_;
};

// As after a machine's sleep.
TEST(Source, HoldsFewOfTheFramesThatAShowIsLateBy) {
  std::size_t most = 0;
  Source source(std::make_unique<CountedCamera>(most));
  EXPECT_EQ(source.at(100s)->number, 2500);
  EXPECT_LE(most, 5U);
  int frames = 0;
  for (std::size_t some = 16; some == 16; frames += static_cast<int>(some)) {
    some = source.advance(200s, 16).size();
  }
  EXPECT_EQ(frames, 2500);
  EXPECT_EQ(source.current().number, 5000);
  EXPECT_LE(most, 20U);
}

// Gives a picture every other millisecond, at once.
class QuickCamera final : public GreyCamera {
 public:
  QuickCamera() : GreyCamera(100'000, {500, 1}, 0) { info_.live = true; }
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    frame->time = next_;
    std::this_thread::sleep_for(next_ - capture::monotonic_now());
    next_ += 2ms;
    return frame;
  }

 private:
  capture::Time next_ = capture::monotonic_now();
};

// A camera that is quick, by the time of one whose pictures come late: more are ahead of it than
// are kept.
TEST(Source, MovesOnThoughItIsAheadOfWhoAsks) {
  Source newest(std::make_unique<QuickCamera>()), all(std::make_unique<QuickCamera>());
  const std::int64_t first = newest.current().number;
  std::vector<std::int64_t> numbers;
  const capture::Time end = capture::monotonic_now() + 600ms;
  while (capture::monotonic_now() < end) {
    const capture::Time asked = capture::monotonic_now() - 300ms;
    ASSERT_TRUE(newest.at(asked));
    for (const auto& frame : all.advance(asked, 1000)) numbers.push_back(frame.number);
    std::this_thread::sleep_for(4ms);
  }
  EXPECT_GT(newest.current().number, first + 100);
  EXPECT_GT(newest.current().time, end - 300ms);
  EXPECT_GT(numbers.size(), 50U);
  EXPECT_TRUE(std::ranges::is_sorted(numbers));
}

TEST(Source, EndsWhenItsLastFrameHasBeenShownForAsLongAsTheOthers) {
  Source source = grey_source(3, 10);
  EXPECT_EQ(source.at(299ms)->number, 2);
  EXPECT_FALSE(source.at(300ms));
}

TEST(Source, ShowsASinglePictureForEver) {
  Source source = grey_source(1, 25);
  EXPECT_TRUE(source.is_still());
  EXPECT_TRUE(source.at(std::chrono::hours(100)));
}

TEST(TimedSource, SaysHowOldItsNewestPictureIs) {
  register_grey_camera();
  const auto source_of = [](const char* uri) {
    return TimedSource({uri, "", false, 0, capture::Transfer::linear}, capture::Time{1s}, false);
  };
  TimedSource ending = source_of("grey:3,10,0");
  EXPECT_TRUE(ending.at(500ms));
  EXPECT_EQ(ending.age(), 0s);  // not begun
  EXPECT_TRUE(ending.at(1s + 130ms));
  EXPECT_EQ(ending.age(), 30ms);
  EXPECT_FALSE(ending.at(2s));
  EXPECT_EQ(ending.age(), 900ms);                 // of what was given last
  TimedSource losing = source_of("grey:9,10,2");  // every second one is lost
  EXPECT_TRUE(losing.at(1s + 200ms));
  EXPECT_EQ(losing.age(), 0s);
  EXPECT_TRUE(losing.at(1s + 350ms));
  EXPECT_EQ(losing.age(), 150ms);
  TimedSource still = source_of("grey:1,10,0");
  EXPECT_TRUE(still.at(100s));
  EXPECT_EQ(still.age(), 0s);
}

TEST(TimedSource, GivesFramesThatAreStampedLater) {
  register_grey_camera();
  const auto number_at = [](capture::Time time, capture::Time offset) {
    TimedSource source({"grey:30,10,0", "", false, 0, capture::Transfer::linear}, capture::Time{1s},
                       false);
    source.at(time, offset);
    return source.newest().number;
  };
  EXPECT_EQ(number_at(2s, 0ms), 10);
  EXPECT_EQ(number_at(2s, 250ms), 12);
  EXPECT_EQ(number_at(2s, -250ms), 7);
  EXPECT_EQ(number_at(1s, -250ms), 0);
  TimedSource begins_now({"grey:30,10,0", "", false, 0, capture::Transfer::linear}, {}, false);
  begins_now.at(7s, 250ms);
  EXPECT_EQ(begins_now.newest().number, 2);
  EXPECT_EQ(begins_now.age(), 50ms);
}

// As a still of a late frame asks for it.
TEST(TimedSource, HoldsItsLastPictureThoughNobodyAskedBefore) {
  register_grey_camera();
  TimedSource source({"grey:3,10,0", "", false, 0, capture::Transfer::linear}, capture::Time{},
                     false);
  EXPECT_EQ(source.newest().number, 0);
  EXPECT_FALSE(source.at(5s));
  EXPECT_EQ(source.newest().number, 2);
}

TEST(Source, GivesWhatHasComeOfALiveCameraWithoutWaiting) {
  Source source(std::make_unique<LiveGreyCamera>(1000, capture::Rational{100, 1}, 0));
  ASSERT_TRUE(source.is_live());
  EXPECT_FALSE(source.is_still());
  std::int64_t last = -1;
  for (int i = 0; i < 20; ++i) {
    const capture::Frame newest = source.wait_for_newer(capture::monotonic_now() + 60s);
    EXPECT_GT(newest.number, last);
    const auto frame = source.at(newest.time);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, newest.number);
    EXPECT_GE(source.arrived(), frame->time);
    EXPECT_EQ(source.at(newest.time)->number, newest.number) << "until another one is due";
    last = newest.number;
  }
}

TEST(Source, KeepsTheNewestLiveFramesWhileNobodyAsks) {
  Source source(std::make_unique<LiveGreyCamera>(60, capture::Rational{1000, 1}, 0));
  std::vector<capture::Frame> came;
  while (came.empty() || came.back().number < 59) {
    std::this_thread::sleep_for(100ms);
    for (capture::Frame& frame : source.advance(capture::Time::max(), 60)) came.push_back(frame);
  }
  EXPECT_TRUE(std::ranges::is_sorted(came, {}, &capture::Frame::number));
  EXPECT_FALSE(source.at(capture::Time::max())) << "it has ended";
}

// Of 25 frames a second, with a sample of sound a millisecond.
class HummingCamera final : public GreyCamera {
 public:
  explicit HummingCamera(std::int64_t frames) : GreyCamera(frames, {25, 1}, 0) {
    info_.sound_channels = 1;
    info_.sound_rate = 1000;
  }
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (frame) read_ = frame->time;
    return frame;
  }
  std::optional<capture::Sound> take_sound(capture::Time until) override {
    const auto end = std::min(until, read_) / 1ms;
    if (end <= taken_) return std::nullopt;
    const auto count = static_cast<std::size_t>(end - taken_);
    capture::Sound sound{taken_ * 1ms, 1, 1000, std::vector<float>(count, 0.5F)};
    taken_ = end;
    return sound;
  }

 private:
  capture::Time read_{};
  std::int64_t taken_ = 0;  // samples
};

TEST(Source, ReadsTheSoundOfFramesThatAShowPassesOver) {
  Source source(std::make_unique<HummingCamera>(26));
  const auto take = [](Source& from, capture::Time until) {
    from.read_sound_to(until);
    const auto sound = from.take_sound(until);
    return sound ? sound->samples.size() : 0;
  };
  for (int frame = 0; frame < 5; ++frame) {  // at five frames a second
    ASSERT_TRUE(source.at(frame * 200ms));
    EXPECT_EQ(take(source, (frame + 1) * 200ms), 200U);
  }
  EXPECT_EQ(take(source, 1000s), 0U);
  Source far(std::make_unique<HummingCamera>(100000));
  EXPECT_LT(take(far, 1000s), 1000U) << "no more pictures are held than a few";
}

// A picture that stands for minutes: what is heard meanwhile belongs to the show's frames.
TEST(Source, GivesSoundUpToTheTimeThatIsAskedFor) {
  Source source(std::make_unique<HummingCamera>(100));
  ASSERT_TRUE(source.at(0s));
  source.read_sound_to(300ms);
  const auto first = source.take_sound(100ms);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->samples.size(), 100U);
  EXPECT_FALSE(source.take_sound(100ms));
  const auto second = source.take_sound(250ms);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->time, 100ms);
  EXPECT_EQ(second->samples.size(), 150U);
}

TEST(Source, RefusesACameraWithoutFrames) { EXPECT_THROW(grey_source(0, 25), std::runtime_error); }

TEST(Quantiles, AreRightToOnePercent) {
  std::mt19937 random(2);
  std::lognormal_distribution<double> time(2, 1);
  std::vector<double> all;
  Quantiles quantiles;
  for (int i = 0; i < 5000; ++i) {
    all.push_back(time(random));
    quantiles.add(all.back());
  }
  std::ranges::sort(all);
  for (const double share : {0.0, 0.1, 0.5, 0.9, 0.99, 1.0}) {
    const double exact = all[static_cast<std::size_t>(std::max(share * 5000 - 1, 0.0))];
    EXPECT_NEAR(quantiles.at(share) / exact, 1, 0.011) << share;
  }
  EXPECT_EQ(Quantiles().at(0.5), 0);
}

TEST(Quantiles, AreNotExceededByTheirShareOfAFewValues) {
  Quantiles quantiles;
  for (int count = 1; count <= 120; ++count) {
    quantiles.add(count);
    for (const int percent : {7, 50, 90, 99, 100}) {
      const int rank = (percent * count + 99) / 100;
      EXPECT_NEAR(quantiles.at(0.01 * percent) / rank, 1, 0.011) << percent << " % of " << count;
    }
  }
}

// A shot of a scene of constant radiance, clipped at 1.
std::shared_ptr<const capture::Image> shot_of(double radiance, double exposure_s) {
  capture::Image shot = capture::make_image(4, 6);
  for (float& v : shot.pixels) v = static_cast<float>(std::min(1.0, radiance * exposure_s));
  return std::make_shared<const capture::Image>(std::move(shot));
}

capture::Time at_60(std::int64_t number) { return capture::time_of_frame(number, {60, 1}); }

TEST(RollingBracket, MergesRadianceFromTheNewestShotOfEachExposure) {
  const std::vector<double> exposures_s{0.001, 0.01, 0.1};
  RollingBracket bracket(exposures_s.size());
  std::int64_t number = 0;
  for (const double radiance : {0.05, 3.0, 60.0, 700.0}) {
    for (const double exposure_s : exposures_s) {
      bracket.add(shot_of(radiance, exposure_s), exposure_s, number, at_60(number));
      ++number;
    }
    for (const float v : bracket.merge()->radiance.pixels)
      EXPECT_NEAR(v / radiance, 1, 0.01) << radiance;
  }
}

TEST(RollingBracket, LeavesOutWhatDoesNotComeAgain) {
  RollingBracket bracket(2);
  for (std::int64_t n = 0; n < 20; ++n) {
    const double exposure_s = n == 0 ? 0.5 : n % 2 == 0 ? 0.001 : 0.01;
    bracket.add(shot_of(3, exposure_s), exposure_s, n, at_60(n));
    EXPECT_EQ(bracket.shots(), n == 0 ? 1U : n == 1 ? 2U : n < 17 ? 3U : 2U) << n;
  }
}

// Of a grey scene of two stops, and light that changes from frame to frame; noise as a camera has.
std::shared_ptr<const capture::Image> wide_shot(double light, double exposure_s) {
  static std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  capture::Image shot = capture::make_image(48, 64);
  for (std::size_t i = 0; i < shot.pixels.size(); ++i) {
    const double value = light * exposure_s * (1 + static_cast<double>(i % 64) / 21);
    shot.pixels[i] =
        static_cast<float>(std::min(1.0, value + normal(random) * std::sqrt(1e-6 + 5e-5 * value)));
  }
  return std::make_shared<const capture::Image>(std::move(shot));
}

// How far the merged light goes up and down in the last 30 of 150 frames, relatively.
double swing_of(RollingBracket& bracket, const std::function<double(double)>& light) {
  const std::vector<double> exposures_s{0.0005, 0.002, 0.001};
  double least = 1e9, most = 0;
  for (std::int64_t n = 0; n < 150; ++n) {
    const double exposure_s = exposures_s[static_cast<std::size_t>(n) % 3];
    const double time_s = static_cast<double>(n) / 60;
    bracket.add(wide_shot(light(time_s), exposure_s), exposure_s, n, at_60(n));
    const auto merged = bracket.merge();
    double sum = 0;
    for (const float v : merged->radiance.pixels) sum += static_cast<double>(v);
    if (n < 120) continue;
    least = std::min(least, sum);
    most = std::max(most, sum);
  }
  return most / least - 1;
}

double lamp(double time_s) { return 80 * (1 + 0.3 * std::sin(200 * std::numbers::pi * time_s)); }

TEST(RollingBracket, LevelsLampsThatFlicker) {
  RollingBracket bracket(3);
  EXPECT_LT(swing_of(bracket, lamp), 0.02);  // .6 as it comes
  ASSERT_TRUE(bracket.flicker());
  EXPECT_EQ(bracket.flicker()->light_hz, 100);
  EXPECT_NEAR(bracket.flicker()->modulation, 0.3, 0.05);
}

TEST(RollingBracket, FollowsALampThatIsSwitchedWhileOthersFlicker) {
  RollingBracket bracket(3);
  swing_of(bracket, lamp);
  double light = 0;
  for (std::int64_t n = 150; n < 152; ++n) {  // the newest exposure and the next one
    bracket.add(wide_shot(320, 0.0005), 0.0005, n, at_60(n));
    light = static_cast<double>(bracket.merge()->radiance.pixels[0]);
  }
  EXPECT_NEAR(light, 320, 40);
}

TEST(RollingBracket, LevelsNoOtherLight) {
  RollingBracket bracket(3);
  const double swing = swing_of(bracket, [](double t) { return 80 * std::exp2(-t / 4); });
  EXPECT_FALSE(bracket.flicker());
  EXPECT_NEAR(swing, std::exp2(29.0 / 60 / 4) - 1, 0.02);
}

TEST(RollingBracket, RefusesShotsOfTwoSizes) {
  RollingBracket bracket(2);
  bracket.add(std::make_shared<capture::Image>(capture::make_image(4, 6)), 0.01, 0, at_60(0));
  const auto turned = std::make_shared<capture::Image>(capture::make_image(6, 4));
  EXPECT_THROW(bracket.add(turned, 0.1, 1, at_60(1)), std::invalid_argument);
}

}  // namespace
}  // namespace studio::source_test
