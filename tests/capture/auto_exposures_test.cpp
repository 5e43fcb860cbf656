// Exposures that follow made light: indoors, in the sun, at night, and when it changes.
#include "capture/auto_exposures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/capture/made_light_camera.h"

namespace capture::auto_exposures_test {
namespace {

using made::LightCamera;
using made::LightScript;

constexpr double longest_s = 0.015;
constexpr double asked_error = 0.1;

AutoExposureSettings settings_of(const LightScript& script) {
  AutoExposureSettings settings;
  settings.choice.noise = noise_of(LightCamera::sensor());
  settings.choice.relative_error = asked_error;
  settings.choice.possible = {script.exposures.shortest_s, longest_s};
  return settings;
}

// The camera is told the exposures in turn; labels are the truth, unless there are to be none.
class Follower {
 public:
  explicit Follower(std::shared_ptr<LightScript> script)
      : script_(std::move(script)), camera_(script_), exposures_(settings_of(*script_)) {
    for (const double t : exposures_.exposures_s()) taken_s_.push_back(camera_.set_exposure(t));
  }

  // One frame. Whether exposures changed.
  bool next() {
    const Frame frame = camera_.next().value();
    const double label_s = labelled_ ? script_->made_s.back() : 0;
    const bool changed =
        exposures_.observe(meter_.measure(*frame.image), label_s, taken_s_, script_->lag);
    if (changed) {
      taken_s_.clear();
      for (const double t : exposures_.exposures_s()) {
        taken_s_.push_back(script_->unit_s * std::round(t / script_->unit_s));
      }
    }
    turn_ = (turn_ + 1) % taken_s_.size();
    camera_.set_exposure(taken_s_[turn_]);
    return changed;
  }
  // How often exposures change.
  int run(int frames) {
    int changes = 0;
    for (int i = 0; i < frames; ++i) changes += next();
    return changes;
  }
  void set_labelled(bool labelled) { labelled_ = labelled; }
  const AutoExposures& exposures() const { return exposures_; }
  const std::vector<double>& exposures_s() const { return exposures_.exposures_s(); }
  const std::vector<double>& taken_s() const { return taken_s_; }

 private:
  std::shared_ptr<LightScript> script_;
  LightCamera camera_;
  AutoExposures exposures_;
  LightMeter meter_{{}};
  std::vector<double> taken_s_;
  std::size_t turn_ = 0;
  bool labelled_ = true;
};

std::shared_ptr<LightScript> scene(const Image& image, int lag = 2) {
  auto script = std::make_shared<LightScript>();
  script->scene = image;
  script->lag = lag;
  return script;
}

// The largest error of all of a scene's values, but for the darkest hundredth.
double error_of(const Image& scene, double gain, const std::vector<double>& exposures_s) {
  std::vector<float> values = scene.pixels;
  std::ranges::sort(values);
  double worst = 0;
  for (std::size_t i = values.size() / 100; i < values.size(); ++i) {
    worst = std::max(
        worst, merged_error(gain * values[i], exposures_s, noise_of(LightCamera::sensor()), 0.97));
  }
  return worst;
}

// What the camera can resolve as a whole, gain 1 in its middle.
Image make_middle() { return made::make_light(1, 60, 300, 4); }

TEST(AutoExposures, BeginWithAllThatTheCameraResolves) {
  const auto script = scene(make_middle());
  const AutoExposures exposures(settings_of(*script));
  EXPECT_THAT(exposures.exposures_s(), testing::SizeIs(3));
  EXPECT_DOUBLE_EQ(exposures.exposures_s().front(), 20e-6);
  EXPECT_DOUBLE_EQ(exposures.exposures_s().back(), longest_s);
  for (const double gain : {0.5, 1.0, 100.0}) {
    EXPECT_LE(error_of(script->scene, gain, exposures.exposures_s()), asked_error) << gain;
  }
}

TEST(AutoExposures, ResolveTheSceneWithTheFewest) {
  struct Case {
    Image image;
    std::size_t most;
    bool too_bright, too_dark;
  };
  const std::vector<Case> cases{{made::make_room(), 2, false, false},
                                {made::make_light(10, 100, 100, 1), 1, false, false},
                                {make_middle(), 2, false, false},
                                {made::make_sunny_day(), 2, true, false},
                                {made::make_night(), 2, false, true},
                                {made::make_light(1, 20000, 40000, 4), 3, false, false}};
  for (const Case& c : cases) {
    Follower follower(scene(c.image));
    follower.run(60);
    EXPECT_EQ(follower.run(300), 0) << "light is constant";
    EXPECT_EQ(follower.exposures_s().size(), c.most);
    EXPECT_EQ(follower.exposures().too_bright(), c.too_bright);
    EXPECT_EQ(follower.exposures().too_dark(), c.too_dark);
    if (c.too_bright) {
      EXPECT_DOUBLE_EQ(follower.exposures_s().front(), 20e-6);
    }
    if (c.too_dark) {
      EXPECT_DOUBLE_EQ(follower.exposures_s().back(), longest_s);
    }
    if (!c.too_bright && !c.too_dark) {
      EXPECT_LE(error_of(c.image, 1, follower.taken_s()), asked_error);
    }
  }
}

TEST(AutoExposures, FindALampOfOnePixelIn5Brackets) {
  for (const double lamp : {200.0, 2e3, 4e4}) {
    const auto script = scene(made::make_light(1, 60, 60, 1));
    Follower follower(script);
    follower.run(100);
    script->scene = made::make_light(1, 60, lamp, 1);
    follower.run(25);
    EXPECT_LE(error_of(script->scene, 1, follower.taken_s()), asked_error) << lamp;
    EXPECT_FALSE(follower.exposures().too_bright());
  }
}

TEST(AutoExposures, FollowLightThatJumpsByAHundred) {
  for (const int lag : {0, 2, 6}) {
    for (const double jump : {0.01, 100.0}) {
      const auto script = scene(make_middle(), lag);
      const double before = jump > 1 ? 1 : 100;
      double gain = before;
      script->gain = [&](std::int64_t) { return gain; };
      Follower follower(script);
      follower.run(100);
      ASSERT_LE(error_of(script->scene, gain, follower.taken_s()), asked_error);
      gain = before * jump;
      int frames = 0;
      while (error_of(script->scene, gain, follower.taken_s()) > asked_error && frames < 100) {
        follower.next();
        ++frames;
      }
      EXPECT_LE(frames, 3 + 3 * (lag + 2)) << "by " << jump << ", lag " << lag;
      follower.run(100);
      EXPECT_LE(follower.exposures_s().size(), 2U) << "what is gone is forgotten";
    }
  }
}

// Every frame's bracket resolves what there is, while all light drifts over 8 stops and back.
TEST(AutoExposures, FollowDriftsWithoutAGap) {
  const auto script = scene(made::make_light(8, 200, 800, 4));
  const auto gain = [](std::int64_t n) {
    return std::exp2(4 * std::cos(static_cast<double>(n) * std::numbers::pi / 400));
  };
  script->gain = gain;
  Follower follower(script);
  int changes = 0;
  for (int n = 0; n < 1600; ++n) {
    const std::vector<double> before = follower.exposures_s();
    if (follower.next()) {
      ++changes;
      // One exposure, and not to one that is hard to tell from those in play.
      std::vector<double> gone;
      std::vector<double> added;
      std::ranges::set_difference(before, follower.exposures_s(), std::back_inserter(gone));
      std::ranges::set_difference(follower.exposures_s(), before, std::back_inserter(added));
      EXPECT_LE(gone.size(), 1U);
      EXPECT_LE(added.size(), 1U);
    }
    EXPECT_LE(error_of(script->scene, gain(n), follower.taken_s()), asked_error * 1.15) << n;
    EXPECT_LE(follower.exposures_s().size(), 3U);
  }
  EXPECT_GT(changes, 10);
  EXPECT_LT(changes, 100);
}

TEST(AutoExposures, AreLeftAloneByLightWithinTheDeadBand) {
  for (double stops = -5; stops < 6; stops += 0.83) {
    const auto script = scene(make_middle());
    script->gain = [=](std::int64_t n) {
      return std::exp2(stops + 0.2 * std::sin(static_cast<double>(n) / 7));
    };
    Follower follower(script);
    follower.run(250);
    EXPECT_EQ(follower.run(200), 0) << stops;
  }
}

TEST(AutoExposures, CoverALampThatIsSwitchedAllTheTime) {
  const auto script = scene(make_middle());
  script->gain = [](std::int64_t n) { return n / 20 % 2 == 0 ? 1.0 : 20.0; };
  Follower follower(script);
  follower.run(80);
  EXPECT_EQ(follower.run(400), 0);
  for (const double gain : {1.0, 20.0}) {
    EXPECT_LE(error_of(script->scene, gain, follower.taken_s()), asked_error);
  }
}

TEST(AutoExposures, SayWhatIsBeyondTheCamera) {
  for (const bool labelled : {true, false}) {
    for (const double far : {1e9, 0.0}) {
      const auto script = scene(make_middle());
      double gain = 1;
      script->gain = [&](std::int64_t) { return gain; };
      Follower follower(script);
      follower.run(100);
      gain = far;
      follower.set_labelled(labelled);
      follower.run(60);
      EXPECT_EQ(follower.exposures().too_bright(), far > 0);
      EXPECT_EQ(follower.exposures().too_dark(), far <= 0);
      EXPECT_DOUBLE_EQ(far > 0 ? follower.exposures_s().front() : follower.exposures_s().back(),
                       far > 0 ? script->exposures.shortest_s : longest_s);
      follower.run(60);
      EXPECT_EQ(follower.run(300), 0) << "it does not go on searching";
      gain = 1;
      follower.set_labelled(true);
      follower.run(60);
      EXPECT_FALSE(follower.exposures().too_bright() || follower.exposures().too_dark());
      EXPECT_LE(error_of(script->scene, 1, follower.taken_s()), asked_error);
    }
  }
}

TEST(AutoExposures, TakeACoarseDeviceAsItIs) {
  const auto script = scene(make_middle());
  script->unit_s = 1e-4;
  script->exposures.shortest_s = 1e-4;
  double gain = 1;
  script->gain = [&](std::int64_t) { return gain; };
  for (gain = 0.1; gain < 60; gain *= 1.3) {
    Follower follower(script);
    follower.run(80);
    EXPECT_EQ(follower.run(100), 0) << gain;
  }
}

// Two exposures that are one to the device.
TEST(AutoExposures, GoOnWhereTheDeviceTakesTwoForOne) {
  const auto script = scene(make_middle());
  AutoExposures exposures(settings_of(*script));
  const std::vector<double> taken_s(exposures.exposures_s().size(), 0.002);
  const FrameLight light{.dark = 0.02, .brightest = 0.6, .saturated = 0};
  EXPECT_TRUE(exposures.observe(light, 0.002, taken_s, 2));
}

TEST(AutoExposures, MakeDoWithALargerErrorForFewerExposures) {
  const auto script = scene(made::make_light(1, 20000, 20000, 4));
  AutoExposureSettings settings = settings_of(*script);
  settings.choice.relative_error = 0.01;
  settings.most_exposures = 4;
  const AutoExposures exposures(settings);
  EXPECT_EQ(exposures.exposures_s().size(), 4U);
  EXPECT_GT(exposures.relative_error(), 0.02);
  EXPECT_EQ(AutoExposures(settings_of(*script)).relative_error(), asked_error);
}

TEST(AutoExposures, RefuseWhatMakesNoSense) {
  const auto script = scene(make_middle());
  AutoExposureSettings settings = settings_of(*script);
  settings.most_exposures = 0;
  EXPECT_THROW(AutoExposures{settings}, std::invalid_argument);
  settings = settings_of(*script);
  settings.hold = -1;
  EXPECT_THROW(AutoExposures{settings}, std::invalid_argument);
  settings = settings_of(*script);
  settings.choice.relative_error = 1e-5;
  EXPECT_THROW(AutoExposures{settings}, std::invalid_argument);
  AutoExposures exposures(settings_of(*script));
  EXPECT_THROW(exposures.observe({}, 0.01, std::vector{0.01}, 2), std::invalid_argument);
}

}  // namespace
}  // namespace capture::auto_exposures_test
