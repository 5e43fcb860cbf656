// Light tables pushed past the edge: the sun's size and strength, the number of lights.
//
// The shading that is judged lies behind straight-edged occluders, since it is shadows that a table
// of lights spoils first.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "render/light_table.h"
#include "tests/render/made_shading.h"
#include "tests/render/sun_and_sky.h"

namespace render::lights_stability_test {
namespace {

constexpr float degree = std::numbers::pi_v<float> / 180;
constexpr double useless = 0.1;  // an error of shading that everyone sees

struct Point {
  double error;
  double estimate;
};

Point measure(const Environment& env,
              const Shading& truth,
              const std::vector<ShadedSurface>& surfaces,
              const LightTableSettings& settings) {
  const LightTable table = make_light_table(env, settings);
  const double error = relative_rms(shade_by_table(table, surfaces).shadowed, truth.shadowed);
  EXPECT_TRUE(std::isfinite(error));
  EXPECT_TRUE(std::isfinite(table.error_estimate));
  return {error, table.error_estimate};
}

TEST(LightsStability, EstimateStaysAboveTheErrorFromSmallSunsToLargeOnes) {
  const auto surfaces = shaded_surfaces(PLATELIGHT_FULL_TESTS ? 4000 : 500);
  bool failed_somewhere = false;
  for (const float irradiance : {0.3F, 2.5F, 50.F}) {
    for (const float radius_deg : {0.1F, 0.5F, 1.5F, 5.F, 20.F}) {
      const Environment env = make_sun_and_sky(
          {.sun_radius_rad = radius_deg * degree, .sun_irradiance = irradiance}, 128);
      const Shading truth = shade_by_map(env, surfaces);
      for (const LightMethod method : {LightMethod::median_cut, LightMethod::split}) {
        for (const int count : {1, 2, 4, 8, 64, 512}) {
          const Point point = measure(env, truth, surfaces, {count, method});
          failed_somewhere = failed_somewhere || point.error > useless;
          EXPECT_GE(point.estimate, point.error)
              << radius_deg << " degrees, irradiance " << irradiance << ", " << count << " lights";
          // An estimate that always cries wolf is none.
          if (method == LightMethod::split && count >= 8 && radius_deg >= 1.5F && irradiance < 10) {
            EXPECT_LE(point.estimate, 4 * point.error + 0.005)
                << radius_deg << " degrees, irradiance " << irradiance << ", " << count
                << " lights";
          }
        }
      }
    }
  }
  EXPECT_TRUE(failed_somewhere) << "the sweep must go past the edge";
}

// A camera whose exposure is locked clips what the sun lights, and with it most of a penumbra.
TEST(LightsStability, EstimateStaysAboveTheErrorOfWhatADisplayShows) {
  constexpr double brightest = 8 * std::numbers::pi;  // 4 times white, on an albedo of 1/2
  const auto surfaces = shaded_surfaces(PLATELIGHT_FULL_TESTS ? 4000 : 500);
  const auto shown = [brightest](std::vector<double> irradiance) {
    for (double& e : irradiance) e = std::min(e, brightest);
    return irradiance;
  };
  bool clipped = false;
  for (const float irradiance : {2.5F, 25.F, 250.F, 2500.F, 25000.F}) {
    for (const float radius_deg : {0.27F, 1.5F, 5.F}) {
      const Environment env = make_sun_and_sky(
          {.sun_radius_rad = radius_deg * degree, .sun_irradiance = irradiance}, 128);
      const std::vector<double> truth = shade_by_map(env, surfaces).shadowed;
      clipped = clipped || shown(truth) != truth;
      for (const int count : {1, 2, 4, 16, 64, 256}) {
        const LightTable table = make_light_table(env, {count});
        const double error =
            relative_rms(shown(shade_by_table(table, surfaces).shadowed), shown(truth));
        EXPECT_GE(table.error_estimate, error)
            << radius_deg << " degrees, irradiance " << irradiance << ", " << count << " lights";
      }
    }
  }
  EXPECT_TRUE(clipped);
}

TEST(LightsStability, EstimateWarnsOfEveryTableThatIsUseless) {
  const auto surfaces = shaded_surfaces(500);
  const Environment env = make_sun_and_sky({}, 128);
  const Shading truth = shade_by_map(env, surfaces);
  for (int count = 1; count <= 256; count *= 2) {
    const Point point = measure(env, truth, surfaces, {count});
    if (point.error > useless) {
      EXPECT_GT(point.estimate, useless) << count;
    }
  }
}

TEST(LightsStability, EverySunFromNothingToAHundredMillionGivesSoundLights) {
  for (float radiance = 1e-6F; radiance <= 1e8F; radiance *= 100) {
    for (const float ground : {0.F, 1e-6F, 1.F}) {
      Environment env = make_even_environment(ground, 64);
      for (int c = 0; c < 3; ++c) env.radiance.at(20, 77, c) = radiance;
      for (const LightMethod method : {LightMethod::median_cut, LightMethod::split}) {
        const LightTable table = make_light_table(env, {64, method});
        ASSERT_FALSE(table.lights.empty());
        EXPECT_TRUE(std::isfinite(table.error_estimate));
        for (const DirectionalLight& light : table.lights) {
          EXPECT_TRUE(std::isfinite(light.irradiance.x + light.direction.x + light.spread));
        }
      }
      smooth_for_reflections(env);
      for (const capture::Image& level : env.smoothed) {
        for (const float value : level.pixels) ASSERT_TRUE(std::isfinite(value));
      }
    }
  }
}

}  // namespace
}  // namespace render::lights_stability_test
