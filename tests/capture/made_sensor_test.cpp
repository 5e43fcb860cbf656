// The made sensor keeps the laws that it states.
#include "capture/made_sensor.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "capture/counter_random.h"

namespace capture::made_sensor_test {
namespace {

constexpr double exposure_s = 0.01;

Image grey(float radiance, int size = 256) {
  Image image = make_image(size, size, 1);
  for (float& value : image.pixels) value = radiance;
  return image;
}

struct Moments {
  double mean = 0;
  double variance = 0;
};

Moments moments_of(const MadeShot& shot) {
  Moments moments;
  for (const auto code : shot.codes) moments.mean += code;
  moments.mean /= static_cast<double>(shot.codes.size());
  for (const auto code : shot.codes) {
    moments.variance += (code - moments.mean) * (code - moments.mean);
  }
  moments.variance /= static_cast<double>(shot.codes.size() - 1);
  return moments;
}

TEST(Expose, HasTheMeanAndVarianceThatItStates) {
  for (const int bits : {12, 16}) {
    for (const double read_noise_e : {0.0, 3.0, 30.0}) {
      MadeSensor sensor{.saturation = 0.02,
                        .full_well_e = 8000,
                        .read_noise_e = read_noise_e,
                        .bits = bits,
                        .pedestal = bits == 12 ? 64.0 : 1024.0};
      if (bits == 12 && read_noise_e == 0) continue;  // steps of half a code, which nothing blurs
      for (const float radiance : {0.002F, 0.02F, 0.3F, 1.5F}) {
        const double n = sensor.full_well_e * radiance * exposure_s / sensor.saturation;
        const double g = ((1 << bits) - 1 - sensor.pedestal) / sensor.full_well_e;
        const double variance = g * g * (n + read_noise_e * read_noise_e) + 1.0 / 12;
        const Moments seen = moments_of(expose(sensor, grey(radiance), exposure_s, 7));
        // Five standard errors of 65,536 sites; whole photons make the variance's own error larger.
        EXPECT_NEAR(seen.mean, sensor.pedestal + g * n, 5 * std::sqrt(variance) / 256)
            << bits << " bits, radiance " << radiance;
        EXPECT_NEAR(seen.variance / variance, 1, 0.04) << bits << " bits, radiance " << radiance;
      }
    }
  }
}

TEST(NormalQuantile, IsThatOfTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-9);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963985, 1e-6);
  EXPECT_NEAR(normal_quantile(0.1), -1.281551566, 1e-6);
  EXPECT_NEAR(normal_quantile(1e-6), -4.753424309, 1e-6);
  EXPECT_NEAR(normal_quantile(1 - 1e-9), 5.997807015, 1e-5);
}

TEST(Expose, GivesTwiceTheLightForTwiceTheTime) {
  const MadeSensor sensor{.saturation = 0.05, .full_well_e = 1e6, .read_noise_e = 0, .bits = 16};
  const double once = moments_of(expose(sensor, grey(1), 0.01, 0)).mean;
  const double twice = moments_of(expose(sensor, grey(1), 0.02, 1)).mean;
  EXPECT_NEAR(twice / once, 2, 1e-3);
}

TEST(Expose, ClipsAtTheFullWellAndAtBlack) {
  MadeSensor sensor{.saturation = exposure_s, .bits = 8};
  for (const float bright : {1.5F, 1e20F}) {
    for (const auto code : expose(sensor, grey(bright, 16), exposure_s, 0).codes) {
      EXPECT_EQ(code, 255);
    }
  }
  sensor.read_noise_e = 0;
  for (const float dark : {0.0F, -3.0F, std::numeric_limits<float>::quiet_NaN()}) {
    for (const auto code : expose(sensor, grey(dark, 16), exposure_s, 0).codes) {
      EXPECT_EQ(code, 0);
    }
  }
}

TEST(Expose, RoundsToTheCodeThatStandsForTheLight) {
  for (const Transfer transfer : {Transfer::linear, Transfer::srgb, Transfer::rec1886}) {
    const MadeSensor sensor{.saturation = exposure_s,
                            .full_well_e = 1e12,
                            .read_noise_e = 0,
                            .bits = 8,
                            .transfer = transfer};
    for (int code = 0; code <= 255; ++code) {
      const auto light = static_cast<float>(light_of_code(sensor, code));
      EXPECT_EQ(expose(sensor, grey(light, 1), exposure_s, 0).codes[0], code);
    }
  }
}

TEST(Expose, RepeatsAShotAndMakesAnotherOneAnew) {
  const MadeSensor sensor{.saturation = 0.02, .bits = 12};
  const MadeShot first = expose(sensor, grey(0.4F), exposure_s, 3);
  EXPECT_EQ(first.codes, expose(sensor, grey(0.4F), exposure_s, 3).codes);
  const MadeShot other = expose(sensor, grey(0.4F), exposure_s, 4);
  const Moments one = moments_of(first);
  const Moments two = moments_of(other);
  double covariance = 0;
  for (std::size_t i = 0; i < first.codes.size(); ++i) {
    covariance += (first.codes[i] - one.mean) * (other.codes[i] - two.mean);
  }
  covariance /= static_cast<double>(first.codes.size());
  EXPECT_LT(std::abs(covariance), 5 * one.variance / 256);
}

TEST(Expose, RefusesWhatNoCameraIs) {
  EXPECT_THROW(expose({}, Image{}, exposure_s, 0), std::invalid_argument);
  EXPECT_THROW(expose({}, grey(1, 2), 0, 0), std::invalid_argument);
  EXPECT_THROW(expose({.saturation = 0}, grey(1, 2), exposure_s, 0), std::invalid_argument);
  EXPECT_THROW(expose({.full_well_e = -1}, grey(1, 2), exposure_s, 0), std::invalid_argument);
  EXPECT_THROW(expose({.read_noise_e = -1}, grey(1, 2), exposure_s, 0), std::invalid_argument);
  EXPECT_THROW(expose({.bits = 17}, grey(1, 2), exposure_s, 0), std::invalid_argument);
  EXPECT_THROW(expose({.pedestal = 255}, grey(1, 2), exposure_s, 0), std::invalid_argument);
}

}  // namespace
}  // namespace capture::made_sensor_test
