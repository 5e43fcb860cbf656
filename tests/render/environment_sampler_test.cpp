// Directions chosen in proportion to an environment's light.
#include "render/environment_sampler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "render/sample_sequence.h"
#include "sun_and_sky.h"

namespace render::environment_sampler_test {
namespace {

TEST(EnvironmentSampler, EstimatesIrradianceWithoutBiasWhateverTheSun) {
  for (const float radius : {0.005F, 0.05F, 0.5F}) {
    SunAndSky made;
    made.sun_radius_rad = radius;
    const Environment sky = make_sun_and_sky(made, 64);
    const EnvironmentSampler sampler(sky);
    const int count = 1 << 16;
    Vec3f sum;
    for (int i = 0; i < count; ++i) {
      SampleSequence numbers(1, 0, static_cast<std::uint32_t>(i));
      const auto sample = sampler.sample(numbers.next_pair());
      ASSERT_TRUE(sample);
      ASSERT_NEAR(length(sample->direction), 1, 1e-5);
      const float cosine = std::max(0.0F, sample->direction.z);
      sum += sample->radiance * (cosine / sample->density / count);
    }
    // The truth by brute force over a fine grid, with the same bilinear look-ups.
    Vec3f truth;
    constexpr int rows = 1024;
    for (int y = 0; y < rows / 2; ++y) {
      const auto solid_angle = static_cast<float>(texel_solid_angle(y, 2 * rows, rows));
      for (int x = 0; x < 2 * rows; ++x) {
        const Vec3f d =
            direction_of_texel(static_cast<float>(x), static_cast<float>(y), 2 * rows, rows);
        truth += radiance_of(sky, d, 0) * (d.z * solid_angle);
      }
    }
    EXPECT_NEAR(sum.x / truth.x, 1, 0.004) << "sun of radius " << radius;
    EXPECT_NEAR(sum.z / truth.z, 1, 0.004) << "sun of radius " << radius;
  }
}

TEST(EnvironmentSampler, StatesTheDensityThatItSamplesWith) {
  const Environment sky = make_sun_and_sky({}, 32);
  const EnvironmentSampler sampler(sky);
  double total = 0;
  constexpr int rows = 512;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < 2 * rows; ++x)
      total += sampler.density(direction_of_texel(static_cast<float>(x), static_cast<float>(y),
                                                  2 * rows, rows)) *
               texel_solid_angle(y, 2 * rows, rows);
  EXPECT_NEAR(total, 1, 2e-3);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    SampleSequence numbers(7, 0, i);
    const auto sample = sampler.sample(numbers.next_pair());
    ASSERT_TRUE(sample);
    EXPECT_NEAR(sampler.density(sample->direction) / sample->density, 1, 1e-3);
  }
}

TEST(EnvironmentSampler, HasNothingToGiveInTheDark) {
  const Environment dark = make_even_environment(0, 8);
  const EnvironmentSampler sampler(dark);
  EXPECT_FALSE(sampler.sample({0.5F, 0.5F}));
  EXPECT_EQ(sampler.density({0, 0, 1}), 0);
}

TEST(EnvironmentSampler, TakesNotANumberAndNegativeLightAsBlack) {
  Environment odd = make_even_environment(1, 8);
  odd.radiance.at(2, 3, 0) = NAN;
  odd.radiance.at(2, 4, 1) = -5;
  odd.radiance.at(5, 4, 1) = INFINITY;
  const EnvironmentSampler sampler(odd);
  for (std::uint32_t i = 0; i < 200; ++i) {
    SampleSequence numbers(1, 0, i);
    const auto sample = sampler.sample(numbers.next_pair());
    if (!sample) continue;
    EXPECT_TRUE(std::isfinite(sample->radiance.x + sample->radiance.y + sample->density));
  }
}

}  // namespace
}  // namespace render::environment_sampler_test
