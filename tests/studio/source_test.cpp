// Cameras by the show's clock, and brackets that roll.
#include "studio/source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include "studio/probe_source.h"
#include "studio/quantiles.h"
#include "studio/rolling_bracket.h"
#include "tests/studio/made_show.h"

namespace studio {
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
      EXPECT_LE(frame->time, time);
      EXPECT_GT(capture::time_of_frame(frame->number + 1, {fps, 1}), time);
    }
  }
}

TEST(Source, EndsWhenItsLastFrameHasBeenShownForAsLongAsTheOthers) {
  Source source = grey_source(3, 10);
  EXPECT_EQ(source.at(capture::Time{299'999'999})->number, 2);
  EXPECT_FALSE(source.at(capture::Time{300'000'000}));
}

TEST(Source, ShowsASinglePictureForEver) {
  Source source = grey_source(1, 25);
  EXPECT_TRUE(source.is_still());
  EXPECT_TRUE(source.at(std::chrono::hours(100)));
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
    for (capture::Frame& frame : source.advance(capture::Time::max())) came.push_back(frame);
  }
  EXPECT_TRUE(std::ranges::is_sorted(came, {}, &capture::Frame::number));
  EXPECT_FALSE(source.at(capture::Time::max())) << "it has ended";
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
    const double exact = all[static_cast<std::size_t>(share * 4999)];
    EXPECT_NEAR(quantiles.at(share) / exact, 1, 0.011) << share;
  }
  EXPECT_EQ(Quantiles().at(0.5), 0);
}

// A shot of a scene of constant radiance, clipped at 1.
std::shared_ptr<const capture::Image> shot_of(double radiance, double exposure_s) {
  capture::Image shot = capture::make_image(4, 6);
  for (float& v : shot.pixels) v = static_cast<float>(std::min(1.0, radiance * exposure_s));
  return std::make_shared<const capture::Image>(std::move(shot));
}

TEST(RollingBracket, MergesRadianceFromTheNewestShotOfEachExposure) {
  const std::vector<double> exposures_s{0.001, 0.01, 0.1};
  RollingBracket bracket(exposures_s.size());
  std::int64_t number = 0;
  for (const double radiance : {0.05, 3.0, 60.0, 700.0}) {
    for (const double exposure_s : exposures_s) {
      bracket.add(shot_of(radiance, exposure_s), exposure_s, number++);
    }
    for (const float v : bracket.merge()->radiance.pixels)
      EXPECT_NEAR(v / radiance, 1, 0.01) << radiance;
  }
}

TEST(RollingBracket, LeavesOutWhatDoesNotComeAgain) {
  RollingBracket bracket(2);
  for (std::int64_t n = 0; n < 20; ++n) {
    const double exposure_s = n == 0 ? 0.5 : n % 2 == 0 ? 0.001 : 0.01;
    bracket.add(shot_of(3, exposure_s), exposure_s, n);
    EXPECT_EQ(bracket.shots(), n == 0 ? 1U : n == 1 ? 2U : n < 17 ? 3U : 2U) << n;
  }
}

TEST(RollingBracket, RefusesShotsOfTwoSizes) {
  RollingBracket bracket(2);
  bracket.add(std::make_shared<capture::Image>(capture::make_image(4, 6)), 0.01, 0);
  const auto turned = std::make_shared<capture::Image>(capture::make_image(6, 4));
  EXPECT_THROW(bracket.add(turned, 0.1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace studio
