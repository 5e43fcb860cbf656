// Lamps that flicker, and what does not.
#include "capture/flicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace capture::flicker_test {
namespace {

const std::vector<double> bracket_s{1e-4, 2e-3, 5e-4};

double swing(double time_s, double hz, double modulation) {
  return 1 + modulation * std::sin(2 * std::numbers::pi * hz * time_s + 0.4);
}

// The mean of the light while it was exposed.
double exposed(const std::function<double(double)>& light, double time_s, double exposure_s) {
  double sum = 0;
  for (int i = 0; i < 16; ++i) sum += light(time_s + exposure_s * ((i + 0.5) / 16 - 0.5)) / 16;
  return sum;
}

std::optional<Flicker> watch(double rate,
                             const std::function<double(double)>& light,
                             double noise = 0.003) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(1, noise);
  FlickerWatch flicker;
  std::optional<ShotLight> before;
  for (int i = 0; i < 100; ++i) {
    const double time_s = 5 + i / rate;
    const double exposure_s = bracket_s[static_cast<std::size_t>(i) % bracket_s.size()];
    const ShotLight shot{Time(static_cast<Time::rep>(time_s * 1e9)), exposure_s,
                         exposed(light, time_s, exposure_s) * normal(random)};
    if (before) flicker.add(*before, shot);
    before = shot;
  }
  return flicker.found();
}

TEST(FlickerWatch, FindsLampsOnBothMains) {
  for (const double hz : {100.0, 99.9, 120.0, 120.1}) {
    for (const double rate : {23.976, 30.0, 59.94, 60.0, 72.0, 90.0}) {
      if (std::abs(std::remainder(hz, rate)) < 0.5) continue;  // the rate hides it
      for (const double modulation : {0.03, 0.2, 0.6}) {
        const auto found = watch(rate, [&](double t) { return swing(t, hz, modulation); });
        ASSERT_TRUE(found) << hz << " Hz at " << rate << ", " << modulation;
        EXPECT_NEAR(found->modulation, modulation, 0.35 * modulation) << hz << " at " << rate;
      }
    }
  }
}

TEST(FlickerWatch, TellsTheMainsApartWhereTheCameraCan) {
  for (const double rate : {30.0, 60.0, 72.0}) {
    const auto found = watch(rate, [&](double t) { return swing(t, 100, 0.2); });
    ASSERT_TRUE(found);
    EXPECT_EQ(found->light_hz, 100);
  }
  for (const double rate : {25.0, 50.0, 90.0}) {
    const auto found = watch(rate, [&](double t) { return swing(t, 120, 0.2); });
    ASSERT_TRUE(found);
    EXPECT_EQ(found->light_hz, 120);
  }
}

TEST(FlickerWatch, FindsNoneInOtherLight) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const std::vector<std::function<double(double)>> lights{
      [](double) { return 1.0; }, [](double t) { return std::exp2(0.5 * t); },  // drifts
      [](double t) { return t < 5.6 ? 1.0 : 40.0; },                            // is switched
      [](double t) { return 1 + 0.5 * std::sin(4 * t); },                       // swings slowly
      [&](double) { return std::exp(0.1 * normal(random)); }};                  // has no order
  for (std::size_t i = 0; i < lights.size(); ++i) {
    for (const double rate : {25.0, 30.0, 50.0, 60.0}) {
      EXPECT_FALSE(watch(rate, lights[i])) << i << " at " << rate;
    }
  }
}

TEST(FlickerWatch, NeedsAWhileAndSaneValues) {
  FlickerWatch flicker;
  EXPECT_FALSE(flicker.found());
  const ShotLight shot{Time(0), 1e-3, 1};
  for (const double gain : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 100; ++i) flicker.add(shot, {Time(i * 16'000'000L), 1e-3, gain});
  }
  flicker.add(shot, {Time(1), 0, 1});
  EXPECT_FALSE(flicker.found());
}

}  // namespace
}  // namespace capture::flicker_test
