// Laws of light tables.
#include "render/light_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>

#include "tests/render/made_shading.h"
#include "tests/render/sun_and_sky.h"

namespace render::light_table_test {
namespace {

constexpr LightMethod methods[] = {LightMethod::median_cut, LightMethod::split};

Vec3f total_irradiance(const LightTable& table) {
  Vec3f sum;
  for (const DirectionalLight& light : table.lights) sum += light.irradiance;
  return sum;
}

Vec3f total_irradiance(const Environment& env) {
  std::array<double, 3> sum{};
  for (int y = 0; y < env.radiance.height; ++y) {
    const double solid_angle = texel_solid_angle(y, env.radiance.width, env.radiance.height);
    for (int x = 0; x < env.radiance.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        sum[static_cast<std::size_t>(c)] +=
            counted_radiance(env.radiance.at(y, x, c)) * solid_angle;
      }
    }
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

void expect_sound(const LightTable& table) {
  EXPECT_TRUE(std::isfinite(table.error_estimate));
  EXPECT_GE(table.error_estimate, 0);
  for (const DirectionalLight& light : table.lights) {
    EXPECT_NEAR(length(light.direction), 1, 1e-5F);
    EXPECT_TRUE(std::isfinite(light.irradiance.x + light.irradiance.y + light.irradiance.z));
    EXPECT_GE(std::min({light.irradiance.x, light.irradiance.y, light.irradiance.z}), 0);
    EXPECT_TRUE(light.spread >= 0 && light.spread < 4);
  }
}

TEST(MakeLightTable, KeepsAllTheEnergyOfEveryMapInEveryColour) {
  std::mt19937 random(1);
  std::lognormal_distribution<float> wild(0, 3);
  for (const int height : {256, 128, 90, 17, 1}) {
    Environment env = make_sun_and_sky({}, height);
    for (float& value : env.radiance.pixels) value *= wild(random);
    const Vec3f whole = total_irradiance(env);
    for (const LightMethod method : methods) {
      for (const int count : {1, 2, 7, 64, 500}) {
        const LightTable table = make_light_table(env, {count, method});
        expect_sound(table);
        EXPECT_LE(table.lights.size(), static_cast<std::size_t>(count));
        EXPECT_LE(length(total_irradiance(table) - whole), 1e-4F * length(whole));
      }
    }
  }
}

TEST(MakeLightTable, GivesTheCentroidOfTheLightForOneLight) {
  const Environment env = make_sun_and_sky({}, 128);
  calibrate::Vec3 moment;
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 256; ++x) {
      const float* p = &env.radiance.pixels[env.radiance.index(y, x)];
      moment +=
          to_double(direction_of_texel(static_cast<float>(x), static_cast<float>(y), 256, 128)) *
          (luminance(p[0], p[1], p[2]) * texel_solid_angle(y, 256, 128));
    }
  }
  const LightTable table = make_light_table(env, {1, LightMethod::median_cut});
  ASSERT_EQ(table.lights.size(), 1U);
  EXPECT_LE(length(to_double(table.lights[0].direction) - normalize(moment)), 1e-5);
}

TEST(MakeLightTable, ErrsByLessTheMoreLightsThereAre) {
  const Environment env = make_sun_and_sky({}, 256);
  const auto surfaces = shaded_surfaces(150);
  const Shading truth = shade_by_map(env, surfaces);
  for (const LightMethod method : methods) {
    double before = 1;
    for (const int count : {4, 16, 64, 256}) {
      const Shading shading = shade_by_table(make_light_table(env, {count, method}), surfaces);
      const double error = relative_rms(shading.open, truth.open);
      EXPECT_LT(error, before);
      before = error;
    }
  }
}

TEST(MakeLightTable, LightsUpwardSurfacesToTwoPercentWithSixtyFourLights) {
  const auto surfaces = shaded_surfaces(150);
  for (const SunAndSky& sky :
       {SunAndSky{}, SunAndSky{.sun_radius_rad = .026F}, SunAndSky{.sun_irradiance = 0},
        SunAndSky{.sun_radius_rad = .17F, .sun_irradiance = 5}, SunAndSky{.sun_irradiance = 50},
        SunAndSky{.sun_elevation_rad = 0.1F}}) {
    const Environment env = make_sun_and_sky(sky, 256);
    const Shading shading = shade_by_table(make_light_table(env, {}), surfaces);
    EXPECT_LE(relative_rms(shading.open, shade_by_map(env, surfaces).open), 0.02);
  }
}

TEST(MakeLightTable, PointsASmallSunsLightAtTheSun) {
  for (float azimuth = -3; azimuth < 3; azimuth += 0.7F) {
    const SunAndSky sky{.sun_irradiance = 20, .sun_azimuth_rad = azimuth};
    const LightTable table = make_light_table(make_sun_and_sky(sky, 256), {});
    const auto brightest = std::ranges::max_element(
        table.lights, {}, [](const DirectionalLight& light) { return light.irradiance.x; });
    // A tenth of a texel of the full map, where the light map's texels are 1.4 degrees wide; the
    // brightest light may be a part of the sun.
    EXPECT_GE(dot(brightest->direction, sun_direction(sky)), std::cos(0.006F));
  }
}

TEST(MakeLightTable, GivesAnEmptyTableForABlackMap) {
  for (const int height : {64, 256}) {  // as high as what is cut into regions, and higher
    const LightTable table = make_light_table(make_even_environment(0, height), {});
    EXPECT_TRUE(table.lights.empty());
    EXPECT_EQ(table.error_estimate, 0);
  }
}

TEST(MakeLightTable, MakesOneLightOfOneBrightTexel) {
  Environment env = make_even_environment(0, 256);
  for (int c = 0; c < 3; ++c) env.radiance.at(60, 200, c) = 1e5F;
  for (const LightMethod method : methods) {
    const LightTable table = make_light_table(env, {64, method});
    ASSERT_EQ(table.lights.size(), 1U);
    expect_sound(table);
    if (method == LightMethod::split) {
      EXPECT_LE(length(table.lights[0].direction - direction_of_texel(200, 60, 512, 256)), 1e-4F);
    }
  }
}

TEST(MakeLightTable, CountsNotANumberAndNegativeRadianceAsZero) {
  Environment env = make_even_environment(1, 64);
  env.radiance.at(5, 5, 0) = std::numeric_limits<float>::quiet_NaN();
  env.radiance.at(6, 5, 1) = -1e30F;
  env.radiance.at(7, 5, 2) = std::numeric_limits<float>::infinity();
  const LightTable table = make_light_table(env, {});
  expect_sound(table);
  EXPECT_FALSE(table.lights.empty());
}

TEST(MakeLightTable, SpreadsAnEvenSkyEvenly) {
  const LightTable table = make_light_table(make_even_environment(65504, 128), {});
  ASSERT_EQ(table.lights.size(), 64U);
  expect_sound(table);
  for (const DirectionalLight& light : table.lights) {
    EXPECT_NEAR(light.spread, 0.25F, 0.13F);
  }
}

TEST(MakeLightTable, GivesTheSameBitsEachTime) {
  const Environment env = make_sun_and_sky({}, 128);
  EXPECT_EQ(make_light_table(env, {}), make_light_table(env, {}));
}

TEST(MakeLightTable, CarriesTheUnseenShare) {
  Environment env = make_sun_and_sky({}, 32);
  env.unseen_share = 0.25F;
  EXPECT_EQ(make_light_table(env, {}).unseen_share, 0.25F);
}

TEST(MakeLightTable, RefusesCountsAndMapsThatAreNone) {
  const Environment env = make_even_environment(1, 8);
  EXPECT_THROW(make_light_table(env, {.count = 0}), std::invalid_argument);
  EXPECT_THROW(make_light_table(env, {.count = 4097}), std::invalid_argument);
  EXPECT_THROW(make_light_table({}, {}), std::invalid_argument);
}

TEST(MakeLightTable, MakesAsManyAsFourThousandLights) {
  const LightTable table = make_light_table(make_sun_and_sky({}, 256), {.count = 4096});
  EXPECT_EQ(table.lights.size(), 4096U);
  expect_sound(table);
}

}  // namespace
}  // namespace render::light_table_test
