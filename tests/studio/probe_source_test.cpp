// The light of a probe that brackets: it follows, and where shots tell nothing the last good one
// stays.
#include "studio/probe_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "calibrate/lens.h"
#include "capture/exr.h"
#include "capture/live_reader.h"
#include "studio/rolling_bracket.h"
#include "tests/capture/made_light_camera.h"
#include "tests/made_files.h"

namespace studio::probe_source_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::array exposures_s{0.016, 0.001, 0.00006};
constexpr capture::Rational rate{75, 1};

// What the scene and the camera do at a frame.
struct Moment {
  double radiance = 100;  // of all pixels; the middle exposure resolves it
  bool lost = false;
  bool labelled = true;
  bool damaged = false;
  bool circle = false;  // the rest of the picture, most of it, is black
};

// A camera of three exposures in turn that films what the test says.
class ScriptedCamera final : public capture::Camera {
 public:
  explicit ScriptedCamera(std::function<Moment(std::int64_t)> script,
                          std::int64_t frames = INT64_MAX,
                          std::int64_t times_each = 1)
      : script_(std::move(script)), frames_(frames), times_each_(times_each) {
    info_.width = 8;
    info_.height = 4;
    info_.rate = rate;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (number_ == frames_) return std::nullopt;
    const Moment moment = script_(number_);
    const double exposure_s = exposures_s[static_cast<std::size_t>(number_ / times_each_ % 3)];
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_, rate);
    ++number_;
    if (moment.lost) {
      frame.status = capture::FrameStatus::lost;
      frame.note = "unplugged";
    } else {
      auto image = std::make_shared<capture::Image>(capture::make_image(4, 8));
      for (float& v : image->pixels) {
        v = static_cast<float>(std::min(moment.radiance * exposure_s, 1.0));
      }
      for (int i = 0; moment.circle && i < 4 * 8; ++i) {
        if (std::hypot(i % 8 - 3.5, i / 8 - 1.5) < 2.05) continue;
        for (int c = 0; c < 3; ++c) image->at(i / 8, i % 8, c) = 0;
      }
      last_ = std::move(image);
      if (moment.labelled) frame.exposure_s = exposure_s;
      if (moment.damaged) frame.status = capture::FrameStatus::damaged;
    }
    frame.image = last_;
    return frame;
  }

 private:
  std::function<Moment(std::int64_t)> script_;
  std::int64_t frames_;
  std::int64_t times_each_;
  capture::CameraInfo info_;
  std::int64_t number_ = 0;
  std::shared_ptr<const capture::Image> last_;
};

class ProbeSourceTest : public testing::Test {
 protected:
  // The light at each frame's time, the first `frames` of them.
  std::vector<double> light_over(std::int64_t frames,
                                 std::function<Moment(std::int64_t)> script,
                                 std::int64_t times_each = 1) {
    capture::register_camera("scripted", [&](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<ScriptedCamera>(script, INT64_MAX, times_each);
    });
    Set set;
    set.probe.emplace();
    set.probe->kind = ProbeSettings::Kind::camera;
    set.probe->source = "scripted:";
    set.probe->lens = lens_;
    ProbeSource source(set);
    std::vector<double> light;
    statuses_.clear();
    for (std::int64_t n = 3; n < frames; ++n) {  // it has read a bracket ahead
      light.push_back(source.at(capture::time_of_frame(n, rate), false).image->at(1, 3, 0));
      statuses_.push_back(source.status());
    }
    return light;
  }

  std::vector<ProbeStatus> statuses_;
  std::optional<calibrate::Lens> lens_;
};

// Light changes at an instant; a probe that stamps it later shows it at that instant all the same.
TEST(ProbeSource, ShowsWhatWasTakenByThenWhateverItsClock) {
  constexpr std::int64_t change = 30;  // its frame
  for (const double offset_s : {-0.2, 0.0, 0.2}) {
    capture::register_camera("scripted", [&](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<ScriptedCamera>(
          [](std::int64_t n) { return Moment{.radiance = n < change ? 100.0 : 2500.0}; });
    });
    Set set;
    set.probe.emplace();
    set.probe->kind = ProbeSettings::Kind::camera;
    set.probe->source = "scripted:";
    set.probe->offset_s = offset_s;
    ProbeSource source(set);
    const auto offset =
        std::chrono::duration_cast<capture::Time>(std::chrono::duration<double>(offset_s));
    for (std::int64_t n = 0; n < 60; ++n) {  // of the probe, on the plate's clock
      const capture::Time time = capture::time_of_frame(n, rate) - offset + 1us;
      const double light = source.at(time, false).image->pixels.front();
      if (n < change) {
        EXPECT_NEAR(light, 100, 1) << offset_s << ", " << n;
      } else if (n >= change + 3) {
        EXPECT_NEAR(light, 2500, 40) << offset_s << ", " << n;
      }
    }
  }
}

// An offset of the wrong sign, or of another take.
TEST(ProbeSource, SaysThatARecordingBeginsLater) {
  capture::register_camera("scripted", [&](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<ScriptedCamera>([](std::int64_t) { return Moment{.radiance = 100}; });
  });
  Set set;
  set.probe.emplace();
  set.probe->kind = ProbeSettings::Kind::camera;
  set.probe->source = "scripted:";
  for (const double offset_s : {-3.0, -0.2}) {
    set.probe->offset_s = offset_s;
    ProbeSource source(set);
    for (std::int64_t n = 0; n < 4; ++n) source.at(capture::time_of_frame(n, rate), false);
    const std::vector<std::string> notes = source.take_notes();
    EXPECT_EQ(std::ranges::count_if(notes,
                                    [](const std::string& note) {
                                      return note.find("begins 3.00 s later") != std::string::npos;
                                    }),
              offset_s < -1 ? 1 : 0);
  }
}

TEST_F(ProbeSourceTest, FollowsLightWithinOneBracket) {
  constexpr std::int64_t change = 15;
  const auto light = light_over(
      40, [](std::int64_t n) { return Moment{.radiance = n < change ? 100.0 : 2500.0}; });
  for (std::int64_t n = 3; n < 40; ++n) {
    const double now = light[static_cast<std::size_t>(n - 3)];
    if (n < change) {
      EXPECT_NEAR(now, 100, 1) << n;
    } else if (n >= change + 3) {  // the shortest exposure resolves it
      EXPECT_NEAR(now, 2500, 40) << n;
    }
  }
  EXPECT_EQ(statuses_.back().shots, 3U);
  EXPECT_EQ(statuses_.back().age, capture::Time{});
  EXPECT_GT(statuses_.back().shares[static_cast<std::size_t>(capture::MergeStatus::good)], 0.99);
}

TEST_F(ProbeSourceTest, KeepsTheLastGoodLightWhileAllIsSaturatedOrBlack) {
  for (const double radiance : {1e7, 0.0}) {
    const auto light = light_over(60, [&](std::int64_t n) {
      return Moment{.radiance = n >= 15 && n < 40 ? radiance : 100.0};
    });
    for (std::int64_t n = 20; n < 40; ++n) {
      EXPECT_NEAR(light[static_cast<std::size_t>(n - 3)], 100, 1) << radiance << " at " << n;
      EXPECT_THAT(statuses_[static_cast<std::size_t>(n - 3)].kept_because,
                  HasSubstr(radiance > 0 ? "saturated" : "black"));
    }
    EXPECT_GE(statuses_[39 - 3].age, 20 * capture::time_of_frame(1, rate)) << "and it grows old";
    EXPECT_NEAR(light.back(), 100, 1);
    EXPECT_EQ(statuses_.back().kept_because, "");
  }
}

// The corners of a fish-eye's picture are black for ever.
TEST_F(ProbeSourceTest, KeepsTheLastGoodLightWhileAllThatItsLensSeesIsSaturated) {
  lens_ = calibrate::Lens{.model = "equisolid",
                          .width = 8,
                          .height = 4,
                          .parameters = {1.45, 3.5, 1.5},
                          .max_angle_rad = 1.5707963};
  const auto light = light_over(60, [](std::int64_t n) {
    return Moment{.radiance = n >= 15 && n < 40 ? 1e7 : 100.0, .circle = true};
  });
  for (std::int64_t n = 20; n < 40; ++n) {
    EXPECT_NEAR(light[static_cast<std::size_t>(n - 3)], 100, 1) << n;
    EXPECT_THAT(statuses_[static_cast<std::size_t>(n - 3)].kept_because, HasSubstr("saturated"));
  }
  EXPECT_EQ(statuses_.back().kept_because, "");
}

TEST_F(ProbeSourceTest, KeepsTheLastGoodLightWhileTheCameraIsAway) {
  const auto light = light_over(60, [](std::int64_t n) {
    return Moment{.radiance = n < 40 ? 100.0 : 300.0, .lost = n >= 15 && n < 40};
  });
  EXPECT_NEAR(light[30 - 3], 100, 1);
  EXPECT_THAT(statuses_[30 - 3].kept_because, HasSubstr("unplugged"));
  EXPECT_EQ(statuses_.back().kept_because, "");
  EXPECT_EQ(statuses_.back().lost, 25);
  EXPECT_NEAR(light.back(), 300, 3);
}

TEST_F(ProbeSourceTest, SaysThatItsCameraHasEnded) {
  capture::register_camera("scripted", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<ScriptedCamera>([](std::int64_t) { return Moment{.radiance = 100}; },
                                            12);
  });
  Set set;
  set.probe.emplace();
  set.probe->kind = ProbeSettings::Kind::camera;
  set.probe->source = "scripted:";
  ProbeSource source(set);
  source.at(capture::time_of_frame(11, rate), false);
  EXPECT_EQ(source.status().kept_because, "");
  source.at(capture::time_of_frame(13, rate), false);
  EXPECT_EQ(source.status().kept_because, "the probe has ended");
}

TEST_F(ProbeSourceTest, LeavesOutShotsWhoseExposureIsNotKnown) {
  const auto light = light_over(
      60, [](std::int64_t n) { return Moment{.radiance = 100, .labelled = n < 10 || n % 4 != 0}; });
  for (const double now : light) EXPECT_NEAR(now, 100, 1);
  EXPECT_EQ(statuses_.back().rejected, 12);
}

TEST_F(ProbeSourceTest, MergesWithoutAMemberThatIsMissingForAWhile) {
  const auto light = light_over(90, [](std::int64_t n) {
    return Moment{.radiance = 100, .lost = n % 3 == 2 && n >= 15 && n < 60};
  });
  for (const double now : light) EXPECT_NEAR(now, 100, 1);
  EXPECT_EQ(statuses_[50 - 3].shots, 2U);
  EXPECT_EQ(statuses_.back().shots, 3U);
}

TEST_F(ProbeSourceTest, MergesABracketWhoseFirstFramesTellNothing) {
  for (const int what : {0, 1, 2}) {
    const auto light = light_over(20, [&](std::int64_t n) {
      const bool first = n < 2;
      return Moment{.radiance = 100,
                    .lost = first && what == 0,
                    .labelled = !first || what != 1,
                    .damaged = first && what == 2};
    });
    for (const double now : light) EXPECT_NEAR(now, 100, 1) << what;
    EXPECT_EQ(statuses_.back().shots, 3U) << what;
  }
}

TEST_F(ProbeSourceTest, MergesABracketThatSendsEachShotTwice) {
  const auto light = light_over(
      20, [](std::int64_t) { return Moment{.radiance = 100}; }, 2);
  for (const double now : light) EXPECT_NEAR(now, 100, 1);
  EXPECT_EQ(statuses_.front().shots, 3U);
}

TEST_F(ProbeSourceTest, MergesFromWhenASecondExposureIsKnown) {
  const auto light =
      light_over(60, [](std::int64_t n) { return Moment{.radiance = 100, .labelled = n >= 30}; });
  EXPECT_NEAR(light[19 - 3], 0.1, 0.001) << "a shot alone, of the middle exposure";
  for (std::int64_t n = 31; n < 60; ++n) {
    EXPECT_NEAR(light[static_cast<std::size_t>(n - 3)], 100, 1) << n;
  }
}

// Frames that were read to find a bracket are shown at their time all the same.
TEST_F(ProbeSourceTest, ShowsWhatHasNoExposuresFrameByFrame) {
  const auto light = light_over(20, [](std::int64_t n) {
    return Moment{.radiance = static_cast<double>(n), .lost = n == 0, .labelled = false};
  });
  for (std::int64_t n = 3; n < 20; ++n) {
    const double shot =
        std::min(static_cast<double>(n) * exposures_s[static_cast<std::size_t>(n % 3)], 1.0);
    EXPECT_NEAR(light[static_cast<std::size_t>(n - 3)], shot, 1e-6) << n;
  }
  EXPECT_EQ(statuses_.back().frames, 20);
}

// A set whose probe is so many pictures of three exposures, of that radiance each.
Set set_of_pictures(int count, bool loops, const std::function<double(int)>& radiance) {
  const std::filesystem::path directory = made::make_temporary_directory();
  for (int n = 0; n < count; ++n) {
    capture::Image shot = capture::make_image(4, 8);
    const double light = radiance(n) * exposures_s.at(static_cast<std::size_t>(n % 3));
    for (float& value : shot.pixels) value = static_cast<float>(std::min(light, 1.0));
    capture::write_exr((directory / ("p" + std::to_string(n) + ".exr")).string(), shot);
  }
  Set set;
  set.camera.loop = loops;
  set.show.fps = rate;
  set.probe.emplace();
  set.probe->kind = ProbeSettings::Kind::camera;
  set.probe->source = "file:" + (directory / "p%d.exr").string();
  set.probe->exposures_s.assign(exposures_s.begin(), exposures_s.end());
  return set;
}

// Of ten pictures the eleventh frame has the first one's exposure again.
TEST(ProbeSource, TakesGivenExposuresByPlacesInARecordingThatLoops) {
  ProbeSource source(set_of_pictures(10, true, [](int) { return 100; }));
  for (std::int64_t n = 0; n < 25; ++n) {
    const auto light = source.at(capture::time_of_frame(n, rate), false);
    EXPECT_NEAR(light.image->pixels.front(), 100, 1) << n;
  }
}

// Beside a live plate, whose times are the monotonic clock's, a recording begins with the show.
TEST(ProbeSource, BeginsARecordingWithAShowOnTheMonotonicClock) {
  for (const bool loops : {false, true}) {
    ProbeSource source(set_of_pictures(24, loops, [](int n) { return n < 12 ? 50 : 100; }));
    const capture::Time begun = std::chrono::hours(7);
    for (std::int64_t n = 0; n < 23; ++n) {
      const auto light = source.at(begun + capture::time_of_frame(n, rate));
      EXPECT_EQ(source.status().kept_because, "") << loops << " " << n;
      if (n < 12) {
        EXPECT_NEAR(light.image->pixels.front(), 50, 1) << n;
      }
      if (n > 14) {
        EXPECT_NEAR(light.image->pixels.front(), 100, 1) << n;
      }
      EXPECT_LT(source.status().age, std::chrono::seconds(1));
      EXPECT_GT(light.time, begun - std::chrono::seconds(1));
    }
  }
}

// The made light camera as time goes by, some five times as fast as its frames' numbers say.
class LiveLightCamera final : public made::LightCamera {
 public:
  explicit LiveLightCamera(const std::shared_ptr<made::LightScript>& script) : LightCamera(script) {
    info_.live = true;
  }
  std::optional<capture::Frame> next() override {
    std::this_thread::sleep_for(3ms);
    auto frame = LightCamera::next();
    frame->time = capture::monotonic_now();
    return frame;
  }
};

class LiveProbeTest : public testing::Test {
 protected:
  ProbeSource open(bool asks_auto) {
    capture::register_camera("light", [this](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<LiveLightCamera>(script_);
    });
    Set set;
    set.probe.emplace();
    set.probe->kind = ProbeSettings::Kind::camera;
    set.probe->source = "light:";
    set.probe->asks_auto = asks_auto;
    return ProbeSource(set);
  }
  // How far the newest light's mean is off, relative.
  double error_of(ProbeSource& source, double gain) const {
    const auto image = source.at(capture::monotonic_now()).image;
    double sum = 0;
    double truth = 0;
    for (const float value : image->pixels) sum += value;
    for (const float value : script_->scene.pixels) truth += gain * value;
    return std::abs(sum / truth - 1);
  }
  template <class Done>
  static bool comes_true(const Done& done) {
    const capture::Time end = capture::monotonic_now() + 60s;
    while (!done() && capture::monotonic_now() < end) std::this_thread::sleep_for(5ms);
    return done();
  }

  std::shared_ptr<made::LightScript> script_ = std::make_shared<made::LightScript>();
};

TEST_F(LiveProbeTest, ItsExposuresFollowTheLight) {
  std::atomic<double> gain = 1;
  script_->gain = [&](std::int64_t) { return gain.load(); };
  script_->scene = made::make_light(2, 60, 300, 4);
  for (const bool asks_auto : {true, false}) {
    gain = 1;
    ProbeSource source = open(asks_auto);
    EXPECT_TRUE(comes_true(
        [&] { return error_of(source, 1) < 0.01 && source.status().exposures_s.size() == 2; }));
    const double longest_s = source.status().exposures_s.back();
    gain = 50;
    EXPECT_TRUE(comes_true([&] {
      return error_of(source, 50) < 0.01 && source.status().exposures_s.back() < longest_s / 10;
    }));
    EXPECT_FALSE(source.status().too_bright || source.status().too_dark);
    gain = 1e5;
    EXPECT_TRUE(comes_true([&] {
      static_cast<void>(source.at(capture::monotonic_now()));
      return source.status().too_bright;
    }));
    gain = 1;
    EXPECT_TRUE(
        comes_true([&] { return error_of(source, 1) < 0.01 && !source.status().too_bright; }));
  }
}

// Whose time begins at 0.
TEST_F(LiveProbeTest, FollowsTheLightUnderAPlateFromAFile) {
  std::atomic<double> gain = 1;
  script_->gain = [&](std::int64_t) { return gain.load(); };
  script_->scene = made::make_light(2, 60, 300, 4);
  ProbeSource source = open(true);
  gain = 3;
  capture::Time time{};
  const auto error = [&] {
    const auto image = source.at(time += 40ms, false).image;
    return std::abs(image->pixels.front() / (3 * script_->scene.pixels.front()) - 1);
  };
  EXPECT_TRUE(comes_true([&] { return error() < 0.05; }));
  EXPECT_LT(source.status().age, 10s);
}

TEST_F(LiveProbeTest, TakesACameraAsItIsUnlessToldOtherwise) {
  script_->settable = false;
  ProbeSource source = open(false);
  EXPECT_NE(source.at(capture::monotonic_now()).image, nullptr);
  EXPECT_TRUE(source.status().exposures_s.empty());
  try {
    static_cast<void>(open(true));
    FAIL();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot be set from frame to frame"));
  }
}

TEST(RollingBracket, KeepsAShotThatDoesNotComeAgainForTwoCycles) {
  const auto image = std::make_shared<capture::Image>(capture::make_image(4, 8));
  RollingBracket bracket(3);
  for (std::int64_t n = 0; n < 3; ++n)
    bracket.add(image, exposures_s.at(static_cast<std::size_t>(n % 3)), n,
                capture::time_of_frame(n, {60, 1}));
  bracket.set_cycle(std::array{0.016, 0.001});
  for (std::int64_t n = 3; n < 12; ++n) {
    bracket.add(image, exposures_s.at(static_cast<std::size_t>(n % 2)), n,
                capture::time_of_frame(n, {60, 1}));
    EXPECT_EQ(bracket.shots(), n <= 2 + 4 ? 3U : 2U) << n;
  }
  EXPECT_THROW(bracket.set_cycle({}), std::invalid_argument);
}

}  // namespace
}  // namespace studio::probe_source_test
