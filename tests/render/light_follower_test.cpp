// Light from frame to frame.
#include "render/light_follower.h"

#include <gtest/gtest.h>

#include "tests/render/made_shading.h"
#include "tests/render/sun_and_sky.h"

namespace render::light_follower_test {
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

// What make_light_table() makes: it tells no compact lights apart.
std::vector<DirectionalLight> without_marks(std::vector<DirectionalLight> lights) {
  for (DirectionalLight& light : lights) light.compact = 0;
  return lights;
}

// A lamp of 10 degrees in an even room.
Environment make_room_with_lamp(Vec3f lamp, float room = 1) {
  Environment env = make_even_environment(room, 128);
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 256; ++x) {
      const Vec3f d = direction_of_texel(static_cast<float>(x), static_cast<float>(y), 256, 128);
      if (dot(d, normalize(Vec3f{1, 1, 1})) < std::cos(0.17F)) continue;
      float* const p = &env.radiance.pixels[env.radiance.index(y, x)];
      p[0] = lamp.x;
      p[1] = lamp.y;
      p[2] = lamp.z;
    }
  }
  return env;
}

TEST(LightFollower, StartsWithTheTableOfTheFrame) {
  const Environment env = make_sun_and_sky({}, 128);
  LightFollower follower;
  const LightTable followed = follower.follow(env, {});
  const LightTable made = make_light_table(env, {});
  EXPECT_EQ(without_marks(followed.lights), made.lights);
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
  EXPECT_EQ(without_marks(next.lights), make_light_table(moved, {}).lights);
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

TEST(LightFollower, CutsAnewWhenALampThatHadMostLightsGoesOff) {
  const Environment on = make_room_with_lamp({1e4F, 1e4F, 1e4F});
  const Environment off = make_room_with_lamp({1, 1, 1});
  LightFollower follower;
  for (int i = 0; i < 5; ++i) follower.follow(on, {});
  const LightTable table = follower.follow(off, {});
  EXPECT_EQ(without_marks(table.lights), make_light_table(off, {}).lights);
}

TEST(LightFollower, IsNotCutAnewByLightThatOnlyDims) {
  Environment env = make_room_with_lamp({1e3F, 1e3F, 1e3F});
  LightFollower follower;
  const LightTable first = follower.follow(env, {});
  for (int i = 0; i < 20; ++i) {
    dim(env, 0.7F);
    const LightTable table = follower.follow(env, {});
    for (std::size_t l = 0; l < table.lights.size(); ++l) {
      ASSERT_EQ(table.lights[l].direction, first.lights[l].direction) << i;
    }
  }
}

TEST(LightFollower, IsNotCutAnewOverAndOverUnderALampThatBlinks) {
  const Environment on = make_room_with_lamp({1e3F, 1e3F, 1e3F});
  const Environment off = make_room_with_lamp({1, 1, 1});
  LightFollower follower;
  std::vector<DirectionalLight> before = follower.follow(on, {}).lights;
  int cuts = 0;
  for (int frame = 1; frame < 80; ++frame) {
    const std::vector<DirectionalLight> now = follower.follow(frame % 2 == 0 ? on : off, {}).lights;
    cuts += now.back().direction == before.back().direction ? 0 : 1;
    before = now;
  }
  EXPECT_LE(cuts, 2);
  // Once it has stayed off for long, it is.
  for (int i = 0; i < 12; ++i) before = follower.follow(off, {}).lights;
  EXPECT_EQ(without_marks(before).back().direction,
            make_light_table(off, {}).lights.back().direction);
}

TEST(LightFollower, FollowsALampThatChangesItsColourAlone) {
  const Environment white = make_room_with_lamp({100, 100, 100}, 0.1F);
  const float level = luminance(.55F, 1.02F, 2.1F);
  const Environment blue = make_room_with_lamp({55 / level, 102 / level, 210 / level}, 0.1F);
  LightFollower follower;
  for (int i = 0; i < 20; ++i) follower.follow(white, {});
  Vec3f followed{}, made{};
  for (const DirectionalLight& l : follower.follow(blue, {}).lights) followed += l.irradiance;
  for (const DirectionalLight& l : make_light_table(blue, {}).lights) made += l.irradiance;
  EXPECT_NEAR(followed.x / made.x, 1, 0.001);
  EXPECT_NEAR(followed.z / made.z, 1, 0.001);
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
  for (const int height : {64, 256}) {
    LightFollower follower;
    EXPECT_TRUE(follower.follow(make_even_environment(0, height), {}).lights.empty());
    EXPECT_FALSE(follower.follow(make_sun_and_sky({}, height), {}).lights.empty());
  }
}

TEST(LightFollower, TakesAnotherNumberOfLightsWhileAllIsBlack) {
  LightFollower follower;
  follower.follow(make_sun_and_sky({}, 256), {.table = {.count = 64}});
  EXPECT_TRUE(
      follower.follow(make_even_environment(0, 256), {.table = {.count = 16}}).lights.empty());
  EXPECT_EQ(follower.follow(make_sun_and_sky({}, 256), {.table = {.count = 16}}).lights.size(),
            16U);
}

TEST(LightFollower, MarksTheLightsOfTheSunAndItsTexels) {
  const Environment env = make_sun_and_sky({}, 256);
  LightFollower follower;
  const LightTable table = follower.follow(env, {});
  double marked = 0, share_of_texels = 0;
  std::size_t count = 0;
  for (const DirectionalLight& light : table.lights) {
    if (light.compact == 0) continue;
    ++count;
    EXPECT_GT(dot(light.direction, sun_direction({})), std::cos(0.1F));
    marked += luminance(light.irradiance.x, light.irradiance.y, light.irradiance.z);
  }
  EXPECT_GE(count, 1U);
  EXPECT_LE(count, most_compact_lights);
  // The sun's own, and the little sky in its texels.
  const double sun = luminance(2.5F, 0.93F * 2.5F, 0.8F * 2.5F);
  EXPECT_NEAR(marked / sun, 1, 0.02);
  const CompactTexels& texels = follower.compact_texels();
  ASSERT_EQ(texels.height, light_map_height);
  for (int y = 0; y < texels.height; ++y) {
    for (int x = 0; x < 2 * texels.height; ++x) {
      if (texels.is_compact[static_cast<std::size_t>(y * 2 * texels.height + x)] == 0) continue;
      share_of_texels += texel_solid_angle(y, 2 * texels.height, texels.height);
      const Vec3f d = direction_of_texel(static_cast<float>(x), static_cast<float>(y),
                                         2 * texels.height, texels.height);
      EXPECT_GT(dot(d, sun_direction({})), std::cos(0.1F));
    }
  }
  EXPECT_GT(share_of_texels, 0);
}

TEST(LightFollower, MarksNothingUnderAnOvercastSky) {
  LightFollower follower;
  const LightTable table = follower.follow(make_sun_and_sky({.sun_irradiance = 0}, 128), {});
  for (const DirectionalLight& light : table.lights) EXPECT_EQ(light.compact, 0U);
  EXPECT_EQ(follower.compact_texels().height, 0);
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
}  // namespace render::light_follower_test
