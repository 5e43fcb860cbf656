// The made sky is as bright, and where, as it says.
#include "render/made_sky.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "render/environment.h"

namespace render::made_sky_test {
namespace {

MadeSkySettings small() {
  return {.height = 128, .sun_azimuth_rad = 2.1F, .sun_elevation_rad = 0.6F};
}

Environment as_environment(const capture::Image& map) {
  Environment environment;
  environment.radiance = map;
  return environment;
}

TEST(MakeSky, ShinesAsBrightAsItStates) {
  const MadeSky sky = make_sky(small());
  EXPECT_NEAR(irradiance_of(as_environment(sky.sun), sky.sun_direction).y, small().sun_irradiance,
              0.01F * small().sun_irradiance);
  EXPECT_NEAR(irradiance_of(as_environment(sky.rest), {0, 0, 1}).y, small().sky_irradiance,
              0.01F * small().sky_irradiance);
}

TEST(MakeSky, HasItsSunWhereItStates) {
  const MadeSkySettings settings = small();
  const MadeSky sky = make_sky(settings);
  Vec3f centre{};
  for (int y = 0; y < sky.sun.height; ++y) {
    for (int x = 0; x < sky.sun.width; ++x) {
      const auto weight = static_cast<float>(texel_solid_angle(y, sky.sun.width, sky.sun.height));
      const Vec3f v = direction_of_texel(static_cast<float>(x), static_cast<float>(y),
                                         sky.sun.width, sky.sun.height);
      if (sky.sun.at(y, x, 1) > 50) centre += v * (weight * sky.sun.at(y, x, 1));
    }
  }
  centre = normalize(centre);
  EXPECT_GT(dot(centre, sky.sun_direction), std::cos(0.005F));
  EXPECT_NEAR(std::atan2(centre.y, centre.x), settings.sun_azimuth_rad, 0.01);
  EXPECT_NEAR(std::asin(centre.z), settings.sun_elevation_rad, 0.01);
}

TEST(MakeSky, KeepsTheSunsRadianceWithinHalf) {
  MadeSkySettings settings;
  settings.height = 512;
  float brightest = 0;
  for (const float value : make_sky(settings).sun.pixels) {
    ASSERT_TRUE(std::isfinite(value) && value >= 0);
    brightest = std::max(brightest, value);
  }
  EXPECT_GT(brightest, 1000);
  EXPECT_LT(brightest, 65504);
}

TEST(MakeSky, RepeatsItselfAndChangesWithTheSeed) {
  MadeSkySettings settings = small();
  const MadeSky sky = make_sky(settings);
  EXPECT_EQ(sky.rest.pixels, make_sky(settings).rest.pixels);
  EXPECT_EQ(sky.sun.pixels, make_sky(settings).sun.pixels);
  settings.seed = 2;
  EXPECT_NE(sky.rest.pixels, make_sky(settings).rest.pixels);
}

TEST(MakeSky, RefusesMapsThatCannotHoldTheSun) {
  EXPECT_THROW(make_sky({.height = 100}), std::invalid_argument);
  EXPECT_THROW(make_sky({.sun_irradiance = 0}), std::invalid_argument);
  EXPECT_THROW(make_sky({.sky_irradiance = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace render::made_sky_test
