// A clipped sun's power from light and shadow on the floor.
#include "calibrate/sun_power.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>

namespace calibrate::sun_power_test {
namespace {

// Patches as a floor of any albedo and a plate of any gain show them.
SunPatches made_patches(const std::array<double, 3>& sun, double cosine, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.1, 2);
  SunPatches patches;
  patches.sun_cosine = cosine;
  for (std::size_t c = 0; c < 3; ++c) {
    const double albedo_and_gain = any(random);
    patches.sky_at_lit[c] = any(random);
    patches.sky_at_shadow[c] = 0.8 * patches.sky_at_lit[c];
    patches.lit[c] = albedo_and_gain * (patches.sky_at_lit[c] + sun[c] * cosine);
    patches.shadow[c] = albedo_and_gain * patches.sky_at_shadow[c];
  }
  return patches;
}

TEST(SolveSunPower, IsExactForAnyFloorAndPlate) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const std::array<double, 3> sun{10.0 + seed, 9, 7};
    const SunPower found = solve_sun_power(made_patches(sun, 0.3 + 0.006 * seed, seed));
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(found.irradiance[c] / sun[c], 1, 1e-12);
      EXPECT_EQ(found.sigma[c], 0);
    }
  }
}

TEST(SolveSunPower, TellsItsDeviation) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const std::array<double, 3> sun{10, 9, 7};
  int within = 0;
  constexpr int trials = 2000;
  for (int i = 0; i < trials; ++i) {
    SunPatches patches = made_patches(sun, 0.7, 3);
    patches.lit_sigma[1] = 0.03 * patches.lit[1];
    patches.shadow_sigma[1] = 0.02 * patches.shadow[1];
    patches.lit[1] += patches.lit_sigma[1] * normal(random);
    patches.shadow[1] += patches.shadow_sigma[1] * normal(random);
    const SunPower found = solve_sun_power(patches);
    if (std::abs(found.irradiance[1] - sun[1]) < found.sigma[1]) ++within;
  }
  EXPECT_NEAR(within / double{trials}, 0.68, 0.05);
}

TEST(SolveSunPower, RefusesPatchesThatTellNoSun) {
  const SunPatches good = made_patches({5, 5, 5}, 0.5, 2);
  EXPECT_NO_THROW(solve_sun_power(good));
  SunPatches swapped = good;
  std::swap(swapped.lit, swapped.shadow);
  EXPECT_THROW(solve_sun_power(swapped), std::runtime_error);
  for (const double wrong : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    SunPatches bad = good;
    bad.shadow[2] = wrong;
    EXPECT_THROW(solve_sun_power(bad), std::invalid_argument);
    bad = good;
    bad.sun_cosine = wrong;
    EXPECT_THROW(solve_sun_power(bad), std::invalid_argument);
  }
}

}  // namespace
}  // namespace calibrate::sun_power_test
