// The tone curve from frame to frame: that it settles, does not flicker, and follows cuts.
#include "studio/tone_follower.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace studio::tone_follower_test {
namespace {

using compositing::PictureLevels;
using compositing::ToneCurve;

constexpr PictureLevels sunny{0.02F, 0.3F, 8};

PictureLevels scaled(PictureLevels levels, float by) {
  return {levels.darkest * by, levels.middle * by, levels.brightest * by};
}

TEST(ToneFollower, HasNoCurveBeforeThePictureAndItsOwnAfter) {
  ToneFollower follower({});
  EXPECT_FALSE(follower.curve());
  follower.follow(std::nullopt, {});
  EXPECT_FALSE(follower.curve());
  follower.follow(sunny, {});
  EXPECT_EQ(follower.curve(), compositing::curve_for(sunny));
}

TEST(ToneFollower, DoesNotChangeAtAllOnceASteadySceneHasSettled) {
  ToneFollower follower({});
  const capture::Rational rate{25, 1};
  follower.follow(sunny, {});
  std::optional<ToneCurve> last;
  for (int frame = 1; frame < 400; ++frame) {
    follower.follow({{0.025F, 0.33F, 13}}, capture::time_of_frame(frame, rate));
    if (frame < 250) continue;
    if (last) {
      EXPECT_EQ(follower.curve(), last) << frame;
    }
    last = follower.curve();
  }
  EXPECT_EQ(*last, compositing::curve_for({0.025F, 0.33F, 13}));
}

TEST(ToneFollower, ShowsLessThanAHundredthOfAFlickerOfATenth) {
  for (const std::int64_t fps : {24, 25, 50, 60}) {
    ToneFollower follower({});
    std::array<float, 2> least, most;  // shown, of a middle and a bright level, over a second
    least.fill(1), most.fill(0);
    for (int frame = 0; frame < 10 * fps; ++frame) {
      PictureLevels levels = sunny;
      if (frame % 2 == 1) levels.brightest *= 1.1F;
      follower.follow(levels, capture::time_of_frame(frame, {fps, 1}));
      if (frame < 9 * fps) continue;
      for (std::size_t i = 0; i < 2; ++i) {
        const float shown = (*follower.curve())(i == 0 ? sunny.middle : 6.0F);
        least[i] = std::min(least[i], shown), most[i] = std::max(most[i], shown);
      }
    }
    for (std::size_t i = 0; i < 2; ++i) EXPECT_LT((most[i] - least[i]) / most[i], 0.01F) << fps;
  }
}

TEST(ToneFollower, FollowsTimeAndNotFrames) {
  const auto after_a_second = [](std::int64_t fps) {
    ToneFollower follower({});
    follower.follow(sunny, {});
    for (int frame = 1; frame <= fps; ++frame) {
      follower.follow({{0.03F, 0.4F, 16}}, capture::time_of_frame(frame, {fps, 1}));
    }
    return follower.curve()->brightest;
  };
  const float share = 1 - std::exp(-1.0F);
  for (const std::int64_t fps : {5, 25, 100}) {
    EXPECT_NEAR(after_a_second(fps) / (8 * std::pow(2.0F, share)), 1, 1e-3) << fps;
  }
}

TEST(ToneFollower, IsOfTheNewPictureOneFrameAfterACut) {
  for (const float by : {0.3F, 2.5F, 40.0F}) {
    ToneFollower follower({});
    for (int frame = 0; frame < 10; ++frame) {
      follower.follow(sunny, capture::time_of_frame(frame, {25, 1}));
    }
    follower.follow(scaled(sunny, by), capture::time_of_frame(10, {25, 1}));
    EXPECT_EQ(follower.curve(), compositing::curve_for(scaled(sunny, by))) << by;
  }
}

TEST(ToneFollower, TakesTimeOverALampThatComesIntoThePicture) {
  ToneFollower follower({});
  follower.follow(sunny, {});
  PictureLevels lamp = sunny;
  lamp.brightest = 800;
  follower.follow(lamp, capture::time_of_frame(1, {25, 1}));
  EXPECT_LT(follower.curve()->brightest, 10);
}

TEST(ToneFollower, StaysWhereAPictureTellsNothing) {
  ToneFollower follower({});
  follower.follow(sunny, {});
  const auto before = follower.curve();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  int frame = 0;
  for (const std::optional<PictureLevels> nothing : std::vector<std::optional<PictureLevels>>{
           std::nullopt, PictureLevels{}, PictureLevels{NAN, 1, 1},
           PictureLevels{0.1F, infinity, 1}, PictureLevels{0.1F, 1, -1}}) {
    follower.follow(nothing, capture::time_of_frame(++frame, {25, 1}));
    EXPECT_EQ(follower.curve(), before);
  }
  follower.follow(scaled(sunny, 1.5F), {});  // time stands still, or goes back
  EXPECT_EQ(follower.curve(), before);
}

}  // namespace
}  // namespace studio::tone_follower_test
