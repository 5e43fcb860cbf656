// Light from frame to frame.
#include "render/light_follower.h"

#include <gtest/gtest.h>

#include "tests/render/made_shading.h"
#include "tests/render/sun_and_sky.h"

namespace render {
namespace {

void dim(Environment& env, float factor) {
  for (float& value : env.radiance.pixels) value *= factor;
}

double energy(const LightTable& table) {
  double sum = 0;
  for (const DirectionalLight& light : table.lights) {
    sum += luminance(light.irradiance.x, light.irradiance.y, light.irradiance.z);
  }
  return sum;
}

TEST(LightFollower, StartsWithTheTableOfTheFrame) {
  const Environment env = make_sun_and_sky({}, 128);
  LightFollower follower;
  const LightTable followed = follower.follow(env, {});
  const LightTable made = make_light_table(env, {});
  EXPECT_EQ(followed.lights, made.lights);
  EXPECT_EQ(followed.error_estimate, made.error_estimate);
}

TEST(LightFollower, FlickersByLessThanTwoThousandthsUnderTenPercentNoise) {
  const Environment sky = make_sun_and_sky({.sun_radius_rad = .026F}, 256);
  const auto surfaces = shaded_surfaces(150);
  LightFollower follower;
  std::vector<double> before;
  double worst_followed = 0;
  double worst_made = 0;
  std::vector<double> made_before;
  for (unsigned frame = 0; frame < 30; ++frame) {
    const Environment env = with_noise(sky, 0.1F, frame + 1);
    const std::vector<double> now = shade_by_table(follower.follow(env, {}), surfaces).open;
    const std::vector<double> made = shade_by_table(make_light_table(env, {}), surfaces).open;
    if (frame >= 12) {  // when the average has its length
      worst_followed = std::max(worst_followed, relative_rms(now, before));
      worst_made = std::max(worst_made, relative_rms(made, made_before));
    }
    before = now;
    made_before = made;
  }
  RecordProperty("followed", std::to_string(worst_followed));
  RecordProperty("made_anew", std::to_string(worst_made));
  EXPECT_LE(worst_followed, 0.002);
  EXPECT_LT(worst_followed, worst_made);
}

TEST(LightFollower, KeepsDirectionsBitForBitWhileOnlyNoiseChanges) {
  const Environment sky = make_sun_and_sky({}, 128);
  LightFollower follower;
  const LightTable first = follower.follow(sky, {});
  for (unsigned frame = 0; frame < 10; ++frame) {
    const LightTable next = follower.follow(with_noise(sky, 0.1F, frame + 1), {});
    EXPECT_EQ(next.version, first.version);
    ASSERT_EQ(next.lights.size(), first.lights.size());
    for (std::size_t i = 0; i < first.lights.size(); ++i) {
      EXPECT_EQ(next.lights[i].direction, first.lights[i].direction);
    }
  }
}

TEST(LightFollower, MakesDirectionsAnewWhenTheSunHasMoved) {
  LightFollower follower;
  SunAndSky sky{.sun_irradiance = 5};
  const LightTable first = follower.follow(make_sun_and_sky(sky, 128), {});
  sky.sun_azimuth_rad += 0.2F;
  const Environment moved = make_sun_and_sky(sky, 128);
  const LightTable next = follower.follow(moved, {});
  EXPECT_GT(next.version, first.version);
  EXPECT_EQ(next.lights, make_light_table(moved, {}).lights);
}

TEST(LightFollower, NeverStaysFartherFromASlowSunThanItsTolerance) {
  LightFollower follower;
  SunAndSky sky{.sun_irradiance = 5};
  const auto surfaces = shaded_surfaces(100);
  for (int frame = 0; frame < 40; ++frame) {
    sky.sun_azimuth_rad += 0.003F;
    const Environment env = make_sun_and_sky(sky, 128);
    const LightTable table = follower.follow(env, {});
    EXPECT_LE(relative_rms(shade_by_table(table, surfaces).open, shade_by_map(env, surfaces).open),
              0.02);
  }
}

TEST(LightFollower, FollowsASuddenChangeOfAllLightAtOnce) {
  Environment env = make_sun_and_sky({}, 128);
  LightFollower follower;
  for (int i = 0; i < 20; ++i) follower.follow(env, {});
  dim(env, 0.5F);
  EXPECT_NEAR(energy(follower.follow(env, {})), energy(make_light_table(env, {})), 1e-4);
}

TEST(LightFollower, FollowsALampThatIsSwitchedOnAtOnce) {
  const Environment dark = make_sun_and_sky({.sun_irradiance = 0}, 128);
  const Environment lit = make_sun_and_sky({.sun_radius_rad = .03F, .sun_irradiance = 1}, 128);
  LightFollower follower;
  for (int i = 0; i < 20; ++i) follower.follow(dark, {});
  const LightTable table = follower.follow(lit, {});
  EXPECT_NEAR(energy(table), energy(make_light_table(lit, {})), 1e-4);
}

TEST(LightFollower, ReachesASmallChangeWithinAFewTimesItsSmoothing) {
  Environment env = make_sun_and_sky({}, 128);
  LightFollower follower;
  for (int i = 0; i < 20; ++i) follower.follow(env, {});
  dim(env, 0.9F);
  LightTable table;
  for (int i = 0; i < 60; ++i) table = follower.follow(env, {});
  EXPECT_NEAR(energy(table), energy(make_light_table(env, {})), 0.002 * energy(table));
}

TEST(LightFollower, WaitsThroughABlackFrame) {
  const Environment env = make_sun_and_sky({}, 64);
  LightFollower follower;
  const LightTable before = follower.follow(env, {});
  EXPECT_TRUE(follower.follow(make_even_environment(0, 64), {}).lights.empty());
  const LightTable after = follower.follow(env, {});
  EXPECT_EQ(after.version, before.version);
  EXPECT_NEAR(energy(after), energy(before), 1e-3 * energy(before));
}

TEST(LightFollower, StartsFromABlackFrame) {
  LightFollower follower;
  EXPECT_TRUE(follower.follow(make_even_environment(0, 64), {}).lights.empty());
  EXPECT_FALSE(follower.follow(make_sun_and_sky({}, 64), {}).lights.empty());
}

TEST(LightFollower, TakesNewSettingsAtOnce) {
  const Environment env = make_sun_and_sky({}, 64);
  LightFollower follower;
  follower.follow(env, {});
  LightFollowerSettings fewer;
  fewer.table.count = 16;
  EXPECT_EQ(follower.follow(env, fewer).lights.size(), 16U);
}

}  // namespace
}  // namespace render
