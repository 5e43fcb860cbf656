// The light of a probe that brackets: it follows, and where shots tell nothing the last good one
// stays.
#include "studio/probe_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>

#include "capture/live_reader.h"

namespace studio {
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
};

// A camera of three exposures in turn that films what the test says.
class ScriptedCamera final : public capture::Camera {
 public:
  explicit ScriptedCamera(std::function<Moment(std::int64_t)> script) : script_(std::move(script)) {
    info_.width = 8;
    info_.height = 4;
    info_.rate = rate;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    const Moment moment = script_(number_);
    const double exposure_s = exposures_s[static_cast<std::size_t>(number_ % 3)];
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
      last_ = std::move(image);
      if (moment.labelled) frame.exposure_s = exposure_s;
    }
    frame.image = last_;
    return frame;
  }

 private:
  std::function<Moment(std::int64_t)> script_;
  capture::CameraInfo info_;
  std::int64_t number_ = 0;
  std::shared_ptr<const capture::Image> last_;
};

class ProbeSourceTest : public testing::Test {
 protected:
  // The light at each frame's time, the first `frames` of them.
  std::vector<double> light_over(std::int64_t frames, std::function<Moment(std::int64_t)> script) {
    capture::register_camera("scripted", [&](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<ScriptedCamera>(script);
    });
    Set set;
    set.probe.emplace();
    set.probe->kind = ProbeSettings::Kind::camera;
    set.probe->source = "scripted:";
    ProbeSource source(set);
    std::vector<double> light;
    statuses_.clear();
    for (std::int64_t n = 3; n < frames; ++n) {  // it has read a bracket ahead
      light.push_back(source.at(capture::time_of_frame(n, rate)).image->pixels.front());
      statuses_.push_back(source.status());
    }
    return light;
  }

  std::vector<ProbeStatus> statuses_;
};

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

}  // namespace
}  // namespace studio
