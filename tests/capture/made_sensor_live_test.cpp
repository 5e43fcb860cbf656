// The made sensor that keeps up: the same light and noise as the exact one.
#include "capture/made_sensor_live.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace capture::made_sensor_live_test {
namespace {

struct Moments {
  double mean = 0;
  double variance = 0;
};

Moments moments_of(const MadeShot& shot) {
  Moments m;
  for (const std::uint16_t code : shot.codes) m.mean += code;
  m.mean /= static_cast<double>(shot.codes.size());
  for (const std::uint16_t code : shot.codes) m.variance += (code - m.mean) * (code - m.mean);
  m.variance /= static_cast<double>(shot.codes.size());
  return m;
}

TEST(LiveSensor, HasTheMeanAndNoiseOfTheExactOne) {
  MadeSensor linear{.saturation = 0.1, .full_well_e = 15000, .read_noise_e = 6, .bits = 12};
  linear.pedestal = 64;
  MadeSensor curved = linear;
  curved.transfer = Transfer::rec1886;
  curved.bits = 8;
  curved.pedestal = 0;
  for (const MadeSensor& sensor : {linear, curved}) {
    const LiveSensor live(sensor);
    for (const double light : {0.0, 0.0005, 0.003, 0.02, 0.15, 0.6, 0.95, 1.5, 1e9}) {
      Image radiance = make_image(96, 128);
      for (float& v : radiance.pixels) v = static_cast<float>(light * sensor.saturation / 0.01);
      MadeShot shot;
      live.expose(radiance, 0.01, 3, shot);
      const Moments quick = moments_of(shot);
      const Moments exact = moments_of(expose(sensor, radiance, 0.01, 3));
      const double noise = std::sqrt(exact.variance / static_cast<double>(shot.codes.size()));
      EXPECT_NEAR(quick.mean, exact.mean, 6 * noise + 0.05) << light;
      EXPECT_NEAR(std::sqrt(quick.variance), std::sqrt(exact.variance),
                  0.06 * std::sqrt(exact.variance) + 0.03)
          << light;
    }
  }
}

TEST(LiveSensor, GivesTheSameShotAgainAndAnotherOneNext) {
  const LiveSensor sensor(MadeSensor{.bits = 12});
  Image radiance = make_image(33, 47);
  for (float& v : radiance.pixels) v = 0.4F;
  MadeShot first, again, next;
  sensor.expose(radiance, 1, 1, first);
  sensor.expose(radiance, 1, 1, again);
  sensor.expose(radiance, 1, 2, next);
  EXPECT_EQ(first.codes, again.codes);
  EXPECT_NE(first.codes, next.codes);
}

TEST(LiveSensor, TakesWhatIsNoLightForDarkness) {
  const LiveSensor sensor(MadeSensor{.read_noise_e = 0, .bits = 12});
  Image radiance = make_image(16, 16);
  for (float& v : radiance.pixels) v = std::nanf("");
  radiance.pixels[1] = -5;
  MadeShot shot;
  sensor.expose(radiance, 1, 1, shot);
  for (const std::uint16_t code : shot.codes) EXPECT_EQ(code, 0);
}

TEST(LiveSensor, RefusesWhatTheExactOneRefuses) {
  EXPECT_THROW(LiveSensor(MadeSensor{.saturation = 0}), std::invalid_argument);
  const LiveSensor sensor(MadeSensor{});
  MadeShot shot;
  EXPECT_THROW(sensor.expose(Image{}, 1, 1, shot), std::invalid_argument);
  EXPECT_THROW(sensor.expose(make_image(4, 4), 0, 1, shot), std::invalid_argument);
}

}  // namespace
}  // namespace capture::made_sensor_live_test
