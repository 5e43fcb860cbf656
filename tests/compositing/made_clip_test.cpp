// Made clips: their truth is true.
#include "compositing/made_clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace compositing::made_clip_test {
namespace {

TEST(MadeClip, IsThePersonOverTheScreenSeenThroughTheCamera) {
  MadeScene scene = made_scene("plain");
  scene.actor.spill = 0;
  scene.noise_gain = scene.noise_floor = 0;
  const MadeClip clip(scene, 7, 96, 160);
  const capture::Image screen = light_of(clip.plate_shot(0));
  const MadeFrame made = clip.frame(11);
  const capture::Image seen = light_of(made.seen);
  for (std::size_t i = 0; i < screen.pixels.size(); ++i) {
    const float alpha = made.truth.pixels[4 * (i / 3) + 3];
    const float foreground = made.truth.pixels[4 * (i / 3) + i % 3];
    const float expected = std::min(1.0F, foreground + (1 - alpha) * screen.pixels[i]);
    ASSERT_NEAR(seen.pixels[i], expected, 0.006F) << i;  // a code and a half near white
  }
}

TEST(MadeClip, KeepsStillFromTheRestOnAndMovesBefore) {
  const MadeClip clip(made_scene("walking"), 3, 96, 160);
  EXPECT_EQ(clip.frame(MadeClip::rests_from + 1).truth.pixels,
            clip.frame(MadeClip::frames - 1).truth.pixels);
  EXPECT_NE(clip.frame(4).truth.pixels, clip.frame(5).truth.pixels);
}

TEST(MadeClip, DiffersByNoiseOnlyBetweenFramesOfTheRest) {
  const MadeClip clip(made_scene("noise"), 3, 96, 160);
  EXPECT_NE(clip.frame(MadeClip::rests_from + 1).seen.codes,
            clip.frame(MadeClip::frames - 1).seen.codes);
}

TEST(MadeClip, IsTheSameForTheSameSeed) {
  const MadeScene& scene = made_scene("studio");
  EXPECT_EQ(MadeClip(scene, 5, 90, 120).frame(9).seen.codes,
            MadeClip(scene, 5, 90, 120).frame(9).seen.codes);
  EXPECT_NE(MadeClip(scene, 5, 90, 120).frame(9).seen.codes,
            MadeClip(scene, 6, 90, 120).frame(9).seen.codes);
}

TEST(MadeClip, HasTruthThatIsPremultiplied) {
  for (const MadeScene& scene : made_scenes()) {
    const MadeFrame made = MadeClip(scene, 2, 64, 96).frame(20);
    for (std::size_t i = 0; i < made.truth.pixels.size(); i += 4) {
      const float* p = &made.truth.pixels[i];
      ASSERT_TRUE(p[3] >= 0 && p[3] <= 1) << scene.name;
      for (int c = 0; c < 3; ++c)
        ASSERT_TRUE(p[c] >= 0 && p[c] <= 1.3F * p[3] + 1e-4F) << scene.name;
    }
  }
}

TEST(MadeScene, RefusesANameThatItDoesNotHave) {
  EXPECT_THROW(made_scene("no such scene"), std::invalid_argument);
  EXPECT_GE(made_scenes().size(), 16U);
}

TEST(MadeClip, RefusesPicturesTooSmallForAPerson) {
  EXPECT_THROW(MadeClip(made_scene("plain"), 1, 8, 100), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::made_clip_test
