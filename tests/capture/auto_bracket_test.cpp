// Exposures that follow the light, through labels and merges: the error is held, and nothing jumps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "capture/bracketed_camera.h"
#include "capture/live_merge.h"
#include "tests/capture/made_light_camera.h"

namespace capture::auto_bracket_test {
namespace {

using made::LightCamera;
using made::LightScript;

const NoiseModel noise = noise_of(LightCamera::sensor());
constexpr double asked_error = 0.1;

std::shared_ptr<LightScript> scene(const Image& image, int lag) {
  auto script = std::make_shared<LightScript>();
  script->scene = image;
  script->lag = lag;
  return script;
}

BracketedCamera open_auto(const std::shared_ptr<LightScript>& script) {
  AutoExposureSettings exposures;
  exposures.choice.noise = noise;
  exposures.choice.relative_error = asked_error;
  return {std::make_unique<LightCamera>(script), "made:", exposures, LightMeterSettings{},
          LabelSettings{.noise = noise}};
}

// The newest shot of each exposure of the last two brackets, merged.
class Bracket {
 public:
  explicit Bracket(const std::shared_ptr<LightScript>& script)
      : script_(script), camera_(open_auto(script)) {}

  // Whether a frame came whose exposure is known; it is merged.
  bool next() {
    const Frame frame = camera_.next().value();
    if (frame.exposure_s <= 0) return false;
    EXPECT_EQ(frame.exposure_s, script_->made_s.back()) << frame.number;
    shots_[frame.exposure_s] = frame;
    const std::vector<double> exposures_s = camera_.exposures_s();
    std::vector<LiveShot> window;
    std::erase_if(shots_, [&](const auto& shot) {
      return frame.number - shot.second.number > static_cast<std::int64_t>(2 * exposures_s.size());
    });
    std::vector<const Frame*> frames;
    for (const auto& [exposure_s, shot] : shots_) frames.push_back(&shot);
    std::ranges::sort(frames, {}, &Frame::number);
    for (const Frame* shot : frames) window.push_back({shot->image.get(), shot->exposure_s});
    if (window.empty()) return false;
    merge_window(window, {.noise = noise}, merged_);
    return window.size() >= exposures_s.size();
  }
  void run(int frames) {
    for (int i = 0; i < frames; ++i) next();
  }
  const MergedFrame& merged() const { return merged_; }
  const BracketedCamera& camera() const { return camera_; }

 private:
  std::shared_ptr<LightScript> script_;
  BracketedCamera camera_;
  std::map<double, Frame> shots_;
  MergedFrame merged_;
};

struct Mean {
  double value = 0;
  double deviation = 0;  // of the mean
};

Mean mean_of(const MergedFrame& merged) {
  const Image deviation = merged.deviation();
  Mean mean;
  double variance = 0;
  for (std::size_t i = 0; i < deviation.pixels.size(); ++i) {
    mean.value += merged.radiance.pixels[i];
    variance += std::pow(deviation.pixels[i], 2);
  }
  const auto count = static_cast<double>(deviation.pixels.size());
  mean.value /= count;
  mean.deviation = std::sqrt(variance) / count;
  return mean;
}

// Root mean square of the relative error of values, by their stop.
std::map<int, double> errors_of(const MergedFrame& merged, const Image& truth, double gain) {
  std::map<int, std::pair<double, int>> sums;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    const double light = gain * truth.pixels[i];
    auto& [sum, count] = sums[static_cast<int>(std::floor(std::log2(light)))];
    sum += std::pow(merged.radiance.pixels[i] / light - 1, 2);
    ++count;
  }
  std::map<int, double> errors;
  for (const auto& [stop, sum] : sums) errors[stop] = std::sqrt(sum.first / sum.second);
  return errors;
}

double worst_error(const MergedFrame& merged, const Image& truth, double gain = 1) {
  double worst = 0;
  for (const auto& [stop, error] : errors_of(merged, truth, gain)) worst = std::max(worst, error);
  return worst;
}

TEST(AutoBracket, HoldsTheErrorThatWasAskedFor) {
  for (const int lag : {0, 2, 6}) {
    for (const Image& image : {made::make_room(), made::make_light(1, 300, 1000, 4)}) {
      const auto script = scene(image, lag);
      Bracket bracket(script);
      bracket.run(60);
      for (int i = 0; i < 20; ++i) {
        EXPECT_TRUE(bracket.next());
        EXPECT_LE(worst_error(bracket.merged(), image), asked_error);
      }
      EXPECT_EQ(bracket.camera().exposures_s().size(), 2U);
    }
  }
}

// From the first bracket on, through all changes of exposures.
TEST(AutoBracket, ChangesWithoutAVisibleJump) {
  for (const int lag : {0, 2, 6}) {
    for (const Image& image : {made::make_room(), made::make_light(1, 300, 1000, 4)}) {
      const auto script = scene(image, lag);
      Bracket bracket(script);
      double truth = 0;
      for (const float value : image.pixels) truth += value;
      truth /= static_cast<double>(image.pixels.size());
      int frames = 0;
      std::vector<double> exposures_s = bracket.camera().exposures_s();
      int changes = 0;
      for (int i = 0; i < 100; ++i) {
        const bool whole = bracket.next();
        changes += bracket.camera().exposures_s() != exposures_s;
        exposures_s = bracket.camera().exposures_s();
        if (!whole) continue;
        ++frames;
        const Mean mean = mean_of(bracket.merged());
        EXPECT_NEAR(mean.value, truth, 4 * mean.deviation) << i << ", lag " << lag;
        EXPECT_LE(worst_error(bracket.merged(), image), asked_error) << i << ", lag " << lag;
      }
      EXPECT_GE(changes, 1);
      EXPECT_GE(frames, 70);
    }
  }
}

// Frames until the merged light is right again, the jump's own first one included.
int frames_after(double jump, int lag, int phase) {
  const Image image = made::make_light(1, 60, 300, 4);
  const auto script = scene(image, lag);
  const double before = jump > 1 ? 1 : 100;
  double gain = before;
  script->gain = [&](std::int64_t) { return gain; };
  Bracket bracket(script);
  bracket.run(100 + phase);
  EXPECT_LE(worst_error(bracket.merged(), image, gain), asked_error);
  gain *= jump;
  for (int frames = 1; frames <= 100; ++frames) {
    if (bracket.next() && worst_error(bracket.merged(), image, gain) <= asked_error) return frames;
  }
  return 1000;
}

TEST(AutoBracket, FollowsLightThatJumpsByAHundred) {
  for (const int lag : {0, 2, 6}) {
    for (const double jump : {0.01, 100.0}) {
      int longest = 0;
      for (int phase = 0; phase < 4; ++phase) {
        longest = std::max(longest, frames_after(jump, lag, phase));
      }
      EXPECT_LE(longest, 8 + 2 * lag) << "by " << jump << ", lag " << lag;
      RecordProperty("frames_after_" + std::to_string(jump) + "_lag_" + std::to_string(lag),
                     longest);
    }
  }
}

TEST(AutoBracket, ComesBackFromACoveredLens) {
  for (const int lag : {0, 2, 6}) {
    const auto script = scene(made::make_room(), lag);
    bool covered = false;
    script->gain = [&](std::int64_t) { return covered ? 0.0 : 1.0; };
    Bracket bracket(script);
    bracket.run(60);
    covered = true;
    bracket.run(40);
    EXPECT_TRUE(bracket.camera().statistics().too_dark);
    bracket.run(200);
    covered = false;
    bracket.run(60);
    EXPECT_FALSE(bracket.camera().statistics().too_dark);
    EXPECT_TRUE(bracket.next());
    EXPECT_LE(worst_error(bracket.merged(), script->scene), asked_error) << lag;
  }
}

TEST(AutoBracket, SaysThatTheSunIsTooBright) {
  const auto script = scene(made::make_sunny_day(), 2);
  Bracket bracket(script);
  bracket.run(60);
  const CameraStatistics statistics = bracket.camera().statistics();
  EXPECT_TRUE(statistics.too_bright);
  EXPECT_FALSE(statistics.too_dark);
  EXPECT_DOUBLE_EQ(statistics.exposures_s.front(), 20e-6);
  EXPECT_EQ(statistics.exposures_s.size(), 2U);
}

TEST(AutoBracket, StaysWithinWhatFramesHaveRoomFor) {
  const auto script = scene(made::make_night(), 2);
  EXPECT_LE(open_auto(script).exposures_s().back(), LightCamera::period_s);
  script->exposures = {0.02, 1};
  EXPECT_THROW(open_auto(script), std::runtime_error);
}

}  // namespace
}  // namespace capture::auto_bracket_test
