// The made park: its light is the map's, and its camera pans past the car.
#include "render/made_park.h"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "render/environment.h"

namespace render::made_park_test {
namespace {

MadeStudioSettings small() {
  return {.width = 128,
          .height = 72,
          .probe_size = 128,
          .sky_height = 128,
          .texture_size = 64,
          .frames = 5};
}

// A map of even light with a sun of a few texels.
capture::Image even_map_with_sun() {
  capture::Image map = capture::make_image(128, 256);
  std::ranges::fill(map.pixels, 0.25F);
  for (int y = 40; y < 43; ++y) {
    for (int x = 30; x < 34; ++x) {
      for (int c = 0; c < 3; ++c) map.at(y, x, c) = 50000;
    }
  }
  return map;
}

const MadeStudio& shared_park() {
  static const MadeStudio park = make_park(even_map_with_sun(), small());
  return park;
}

TEST(MakePark, SplitsTheMapsLightIntoSunAndRestAndLosesNone) {
  const MadeSky& sky = shared_park().sky;
  const capture::Image map = even_map_with_sun();
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    const float whole = map.pixels[i] * park_exposure;
    EXPECT_NEAR((sky.sun.pixels[i] + sky.rest.pixels[i]) / whole, 1, 1e-5);
    EXPECT_EQ(sky.sun.pixels[i] > 0, map.pixels[i] > 1);
  }
  const Vec3f towards = direction_of_texel(31.5F, 41, 256, 128);
  EXPECT_GT(dot(sky.sun_direction, towards), 0.9999F);
}

// The ground is as bright as the probe's light makes it: plate and probe are of one world.
TEST(MakePark, LightsTheGroundWithTheMapThatTheProbeSees) {
  const MadeStudio& park = shared_park();
  const Scene place(park.place);
  const auto photograph = [&](const calibrate::Lens& lens, const calibrate::Pose& camera) {
    return add_light(photograph_parts(park, place, calibrate::make_direction_table(lens), camera,
                                      {.samples = 64}),
                     1);
  };
  // Of the sky alone: the albedo of a spot of ground is its radiance over irradiance, in both
  // lights.
  const auto ground = calibrate::look_at({-3, -3, 2}, {-3, -3, 0}, 0);
  const capture::Image seen = photograph({"pinhole", 8, 8, {40, 40, 3.5, 3.5}}, ground);
  Environment light;
  light.radiance = park.sky.rest;
  light.seen.assign(128 * 256, 1);
  for (std::size_t i = 0; i < light.radiance.pixels.size(); ++i) {
    light.radiance.pixels[i] += park.sky.sun.pixels[i];
  }
  const Vec3f irradiance = irradiance_of(light, {0, 0, 1});
  double mean = 0;
  for (std::size_t i = 1; i < seen.pixels.size(); i += 3) mean += seen.pixels[i] / 64;
  const double albedo = std::numbers::pi * mean / irradiance.y;
  EXPECT_GT(albedo, 0.10);  // asphalt
  EXPECT_LT(albedo, 0.25);
}

TEST(MakePark, PansWithTheCarInEveryPicture) {
  const MadeStudio& park = shared_park();
  calibrate::Vec2 before{1e9, 0};
  for (int n = 0; n < park.settings.frames; ++n) {
    const auto q =
        project(park.plate.lens, pose_of_picture(park.plate, n) * calibrate::Vec3{0, 0, 0.7});
    ASSERT_TRUE(q);
    EXPECT_GT(q->x, 0) << n;
    EXPECT_LT(q->x, 127) << n;
    EXPECT_LT(q->x, before.x) << "the camera turns to the right";
    before = *q;
  }
  EXPECT_EQ(pose_of_picture(park.plate, 0), park.plate.cam_from_set);
}

TEST(MakePark, DoesNotClipASunInItsShortestExposure) {
  const MadeCamera& probe = shared_park().probe;
  EXPECT_GT(probe.sensor.saturation / *std::ranges::min_element(probe.exposures_s),
            90000 * park_exposure);
}

TEST(MakePark, RefusesAMapWithoutLight) {
  EXPECT_THROW(make_park(capture::make_image(128, 256), small()), std::invalid_argument);
  EXPECT_THROW(make_park(capture::make_image(128, 128), small()), std::invalid_argument);
  EXPECT_THROW(make_park(even_map_with_sun(), {.width = 8}), std::invalid_argument);
}

}  // namespace
}  // namespace render::made_park_test
