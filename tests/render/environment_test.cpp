// Laws of environments and of their smoothing for reflections.
#include "render/environment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

#include "calibrate/angles.h"
#include "render/light_follower.h"
#include "render/lobe_filter.h"
#include "render/shader.h"
#include "render/standard.h"
#include "tests/render/sun_and_sky.h"

namespace render::environment_test {
namespace {

using calibrate::pi_f;

Vec3f random_direction(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return normalize(Vec3f{normal(random), normal(random), normal(random)});
}

// The sum over all texels of radiance times solid angle, one channel.
double power(const capture::Image& map, int channel) {
  double sum = 0;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      sum += map.at(y, x, channel) * texel_solid_angle(y, map.width, map.height);
    }
  }
  return sum;
}

TEST(TexelOfDirection, IsUndoneByDirectionOfTexel) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3f d = random_direction(random);
    const auto [x, y] = texel_of_direction(d, 512, 256);
    EXPECT_GE(x, -0.5F);
    EXPECT_LE(x, 511.5F);
    EXPECT_LE(length(direction_of_texel(x, y, 512, 256) - d), 1e-5F);
  }
}

TEST(TexelOfDirection, HasTheSetsAxesWhereTheHeaderSaysSo) {
  const auto expect_at = [](Vec3f d, float x, float y) {
    const auto at = texel_of_direction(d, 64, 32);
    EXPECT_NEAR(at[0], x, 1e-4F);
    EXPECT_NEAR(at[1], y, 1e-4F);
  };
  expect_at({1, 0, 0}, 31.5F, 15.5F);
  expect_at({0, 1, 0}, 15.5F, 15.5F);
  expect_at({0, -1, 0}, 47.5F, 15.5F);
  expect_at({0, 0, 1}, 31.5F, -0.5F);
  expect_at({0, 0, -1}, 31.5F, 31.5F);
}

TEST(TexelSolidAngle, AddsUpToTheSphere) {
  double sum = 0;
  for (int y = 0; y < 37; ++y) sum += 74 * texel_solid_angle(y, 74, 37);
  EXPECT_NEAR(sum, 4 * std::numbers::pi, 1e-9);
}

TEST(IrradianceOf, IsPiUnderAnEvenSkyFromEverySide) {
  const Environment env = make_even_environment(1, 64);
  std::mt19937 random(2);
  for (int i = 0; i < 20; ++i) {
    EXPECT_NEAR(irradiance_of(env, random_direction(random)).y, pi_f, 2e-3F);
  }
}

TEST(SplitIrradianceOf, TellsHowMuchOfWhatLightsASurfaceWasSeen) {
  Environment env;
  env.radiance = capture::make_image(64, 128);
  std::ranges::fill(env.radiance.pixels, 1.0F);
  EXPECT_EQ(split_irradiance_of(env, {0, 0, 1}).seen_share, 1) << "all is seen";
  env.seen.assign(64 * 128, 0);
  std::fill_n(env.seen.begin(), 32 * 128, std::uint8_t{1});  // the upper half
  EXPECT_NEAR(split_irradiance_of(env, {0, 0, 1}).seen_share, 1, 1e-6);
  EXPECT_NEAR(split_irradiance_of(env, {0, 0, -1}).seen_share, 0, 1e-6);
  const SplitIrradiance sideways = split_irradiance_of(env, {1, 0, 0});
  EXPECT_NEAR(sideways.seen_share, 0.5F, 1e-3F);
  EXPECT_NEAR(sideways.seen.x, sideways.filled.x, 1e-3F);
}

TEST(RadianceOf, IsTheTexelAtItsCentreAndContinuousEverywhere) {
  const Environment env = make_sun_and_sky({}, 32);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      const Vec3f d = direction_of_texel(static_cast<float>(x), static_cast<float>(y), 64, 32);
      const float expected = env.radiance.at(y, x, 1);
      EXPECT_NEAR(radiance_of(env, d, 0).y, expected, 1e-3F * (1 + expected));
    }
  }
  // Across the seam and over both poles.
  const Environment smooth = make_sun_and_sky({.sun_radius_rad = 0.5F}, 64);
  for (const Vec3f a : {Vec3f{-1, 1e-6F, 0.2F}, Vec3f{1e-6F, 0, 1}, Vec3f{1e-6F, 0, -1}}) {
    const Vec3f b{a.x, -a.y, a.z};
    const Vec3f c{-a.x, a.y, a.z};
    const Vec3f here = radiance_of(smooth, normalize(a), 0);
    EXPECT_NEAR(here.x, radiance_of(smooth, normalize(b), 0).x, 1e-3F);
    if (a.x > 0) {
      EXPECT_NEAR(here.x, radiance_of(smooth, normalize(c), 0).x, 1e-3F);
    }
  }
}

TEST(RadianceOf, NeverReadsBesideTheMap) {
  Environment env = make_even_environment(2, 8);
  smooth_for_reflections(env);
  std::mt19937 random(3);
  for (int i = 0; i < 10000; ++i) {
    EXPECT_NEAR(radiance_of(env, random_direction(random), 0.1F).x, 2, 1e-5F);
  }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const Vec3f d : {Vec3f{nan, 0, 0}, Vec3f{0, infinity, 0}}) {
    EXPECT_EQ(radiance_of(env, d, 0.5F), Vec3f{});
  }
  for (const Vec3f d : {Vec3f{0, 0, 0}, Vec3f{-1, 0, 0}, Vec3f{-1, -0.0F, 0}, Vec3f{0, 0, 1}}) {
    for (const float roughness : {-1.0F, 0.0F, 1.0F, 7.0F, nan}) {
      EXPECT_NEAR(radiance_of(env, d, roughness).z, 2, 1e-5F);
    }
  }
}

// Two unit vectors across a direction.
std::array<Vec3f, 2> across(Vec3f d) {
  const Vec3f a = normalize(cross(d, std::abs(d.z) < 0.9F ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0}));
  return {a, cross(d, a)};
}

Vec3f at_angle(Vec3f d, float angle, float azimuth) {
  const auto [a, b] = across(d);
  return d * std::cos(angle) + (a * std::cos(azimuth) + b * std::sin(azimuth)) * std::sin(angle);
}

// A wide lobe seen head-on, summed over the map's texels.
double lobe_by_texels(const Environment& env, Vec3f d, float roughness) {
  const int width = env.radiance.width, height = env.radiance.height;
  double sum = 0, weights = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec3f l =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), width, height);
      const double weight = lobe_density(d, d, roughness, l) * texel_solid_angle(y, width, height);
      sum += weight * env.radiance.at(y, x, 1);
      weights += weight;
    }
  }
  return sum / weights;
}

// A lobe seen head-on, summed over one texel of light and what interpolation smears around it.
double lobe_over_texel(Vec3f d, float roughness, int column, int row, int height, double radiance) {
  constexpr int steps = 16;
  const double solid_angle = texel_solid_angle(row, 2 * height, height) * 4 / (steps * steps);
  double sum = 0;
  for (int i = 0; i < steps * steps; ++i) {
    const float x = (static_cast<float>(i % steps) + 0.5F) * 2 / steps - 1;
    const float y = (static_cast<float>(i / steps) + 0.5F) * 2 / steps - 1;
    const Vec3f l = direction_of_texel(static_cast<float>(column) + x, static_cast<float>(row) + y,
                                       2 * height, height);
    sum += (1 - std::abs(x)) * (1 - std::abs(y)) * lobe_density(d, d, roughness, l);
  }
  return sum * solid_angle * radiance;
}

// At one place the grid of the halved maps shows a sun brighter or darker than it is. In the mean
// over places its light must be all there, and as much of it near its middle.
TEST(RadianceOf, SpreadsATinySunAsANarrowLobeDoes) {
  constexpr int height = 256;
  constexpr double radiance = 2e4;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(0, 1);
  for (const float alpha : {0.0025F, 0.005F, 0.01F, 0.02F, 0.04F}) {
    const float roughness = std::sqrt(alpha);
    const float wider = std::hypot(alpha, 0.006F);  // by half a texel
    std::array<double, 2> found{}, expected{};      // half of the light, and the other
    for (int place = 0; place < 16; ++place) {
      Environment env = make_even_environment(0.5F, height);
      const int row = 60 + static_cast<int>(random() % 136);
      const int column = static_cast<int>(random() % 512);
      env.radiance.at(row, column, 1) = radiance + 0.5F;
      smooth_for_reflections(env);
      const Vec3f sun = direction_of_texel(static_cast<float>(column), static_cast<float>(row),
                                           2 * height, height);
      for (int i = 0; i < 128; ++i) {
        const Vec3f d = sample_lobe(sun, sun, std::sqrt(wider), {any(random), any(random)});
        const double weight = 1 / lobe_density(sun, sun, std::sqrt(wider), d);
        const std::size_t part = length(d - sun) < 2 * wider ? 0 : 1;
        found[part] += weight * (radiance_of(env, d, roughness).y - 0.5);
        expected[part] += weight * lobe_over_texel(d, roughness, column, row, height, radiance);
      }
    }
    const double all = found[0] + found[1];
    EXPECT_NEAR(all / (expected[0] + expected[1]), 1, 0.03) << "alpha " << alpha;
    // Lobes between the cones and the first smoothed level are mixed of both.
    EXPECT_NEAR(found[0] / expected[0], 1, alpha > 0.01F && alpha < 0.04F ? 0.3 : 0.15)
        << "near its middle, alpha " << alpha;
  }
}

// Over a disc, or over a row of them. Wider cones than these are lobes of the smoothed levels.
TEST(RadianceOf, IsTheMeanOverANarrowCone) {
  Environment env = make_sun_and_sky({.sun_radius_rad = 0.03F}, 256);
  smooth_for_reflections(env);
  const Vec3f sun = sun_direction({});
  for (const auto& [long_rad, short_rad] : {std::pair(0.03F, 0.03F), std::pair(0.05F, 0.05F),
                                            std::pair(0.2F, 0.04F), std::pair(0.3F, 0.02F)}) {
    for (const float away : {0.0F, 0.02F, 0.3F}) {
      const Vec3f d = at_angle(sun, away, 2);
      const auto [a, b] = across(d);
      const Vec3f i = a * long_rad, j = b * short_rad;
      double mean = 0;
      constexpr int steps = 64;
      int inside = 0;
      for (int y = 0; y < steps; ++y) {
        for (int x = 0; x < steps; ++x) {
          const float u = (static_cast<float>(x) + 0.5F) / steps - 0.5F;
          const float v = (static_cast<float>(y) + 0.5F) / steps - 0.5F;
          if (long_rad == short_rad && u * u + v * v > 0.25F) continue;
          ++inside;
          mean += radiance_of(env, normalize(d + i * u + j * v), 0).y;
        }
      }
      mean /= inside;
      EXPECT_NEAR(radiance_of(env, d, 0, {i, j}).y / mean, 1, 0.2)
          << long_rad << " by " << short_rad << ", " << away << " from the sun";
      EXPECT_EQ(radiance_of(env, d, 0, {i, j}), radiance_of(env, d, 0, {j, i}));
    }
  }
}

TEST(RadianceOf, KeepsAWhiteMapWhiteForEveryLobeAndCone) {
  Environment env = make_even_environment(1, 256);
  smooth_for_reflections(env);
  std::mt19937 random(6);
  std::uniform_real_distribution<float> width(0, 0.5F), any(0, 1);
  for (int i = 0; i < 2000; ++i) {
    const Vec3f d = random_direction(random);
    const auto [a, b] = across(d);
    const float roughness = any(random);
    EXPECT_NEAR(
        radiance_of(env, d, roughness * roughness, {a * width(random), b * width(random)}).x, 1,
        1e-4F);
  }
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(radiance_of(env, {0, 0, 1}, 0.1F, {{infinity, 0, 0}, {0, 1, 0}}).x, 1, 1e-4F);
}

TEST(SmoothForReflections, LeavesCompactSourcesForTheLightsThatStandForThem) {
  Environment plain = make_sun_and_sky({}, 256);
  Environment apart = plain;
  LightFollower follower;
  const LightTable table = follower.follow(plain, {});
  smooth_for_reflections(plain);
  smooth_for_reflections(apart, follower.compact_texels());
  EXPECT_TRUE(apart.compact_apart);
  std::vector<DirectionalLight> compact;
  std::ranges::copy_if(table.lights, std::back_inserter(compact),
                       [](const DirectionalLight& light) { return light.compact != 0; });
  ASSERT_GE(compact.size(), 1U);
  const auto mirrored_compact = [&](Vec3f normal, Vec3f view, float roughness) {
    Vec3f sum{};
    for (const DirectionalLight& light : compact) {
      sum += light.irradiance *
             SeenLobe(normal, normal, view).blurred(roughness, light.spread, light.direction);
    }
    return sum * share_without_compact(apart, roughness, {});
  };
  const Vec3f sun = sun_direction({});
  for (const float roughness : {0.25F, 0.4F, 0.6F, 0.8F}) {
    const float alpha = roughness * roughness;
    for (const float away : {0.0F, 0.5F, 1.0F, 2.0F, 4.0F}) {  // half-widths of the lobe
      const Vec3f d = at_angle(sun, std::min(2 * alpha * away, 1.2F), 0.7F);
      const double whole = lobe_by_texels(plain, d, roughness);
      const float sum = radiance_of(apart, d, roughness).y + mirrored_compact(d, d, roughness).y;
      EXPECT_NEAR(sum / whole, 1, 0.05) << "roughness " << roughness << ", " << away;
      if (roughness < 0.5F) continue;  // where the plain level is too coarse to compare
      EXPECT_NEAR(sum / radiance_of(plain, d, roughness).y, 1, 0.05)
          << "roughness " << roughness << ", " << away;
    }
  }
  // The cones of rays all over a lobe see no sun either, and all else as narrow cones do.
  const auto diffused = [&](Vec3f direction, float width_rad) {
    const auto [a, b] = across(direction);
    std::array<MapSample, most_map_samples> places;
    const std::size_t count =
        find_diffused_samples(apart, direction, {a * width_rad, b * width_rad}, places);
    const std::vector<const capture::Image*> levels = levels_of(apart);
    float sum = 0;
    for (const auto& [x, y, share, level] : std::span(places).first(count))
      sum += share * radiance_at(*levels[level], x, y).y;
    return sum;
  };
  for (const float width_rad : {0.0F, 0.02F, 0.1F}) {
    EXPECT_LT(diffused(sun, width_rad), 3) << width_rad;
    EXPECT_GT(radiance_of(plain, sun, 0).y, 1000);
    const Vec3f elsewhere = at_angle(sun, 0.8F, 0.7F);
    const auto [a, b] = across(elsewhere);
    EXPECT_NEAR(diffused(elsewhere, width_rad),
                radiance_of(plain, elsewhere, 0, {a * width_rad, b * width_rad}).y, 0.02)
        << width_rad;
  }
  // Mirrors see the sun in the map itself.
  EXPECT_EQ(radiance_of(apart, sun, 0), radiance_of(plain, sun, 0));
  EXPECT_EQ(mirrored_compact(sun, sun, 0.05F), Vec3f{});
}

TEST(HalvedLevel, ShowsTheSameInTexelsTwiceAsWide) {
  Environment env = make_sun_and_sky({}, 128);
  EXPECT_EQ(halved_level(env, 0), 0U);  // as long as nothing is smoothed
  LightFollower follower;
  follower.follow(env, {});
  smooth_for_reflections(env, follower.compact_texels());
  const std::vector<const capture::Image*> levels = levels_of(env);
  std::size_t with_one = 0;
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const std::size_t halved = halved_level(env, level);
    if (halved == level) continue;
    ++with_one;
    ASSERT_EQ(levels[halved]->height, levels[level]->height / 2) << level;
    EXPECT_NEAR(power(*levels[halved], 1) / power(*levels[level], 1), 1, 0.1) << level;
  }
  EXPECT_EQ(with_one, env.halved.size() + env.diffused.size() - 1);
}

TEST(SmoothForReflections, RefusesCompactTexelsOfAnotherGrid) {
  Environment env = make_even_environment(1, 64);
  EXPECT_THROW(smooth_for_reflections(env, CompactTexels{48, std::vector<std::uint8_t>(48 * 96)}),
               std::invalid_argument);
  EXPECT_THROW(smooth_for_reflections(env, CompactTexels{32, std::vector<std::uint8_t>(5)}),
               std::invalid_argument);
}

TEST(SmoothForReflections, KeepsAWhiteMapWhiteAtEveryRoughness) {
  for (const int height : {256, 100, 16}) {
    Environment env = make_even_environment(1, height);
    smooth_for_reflections(env);
    ASSERT_EQ(env.smoothed.size(), 6U);
    for (const capture::Image& level : env.smoothed) {
      ASSERT_EQ(level.width, 2 * level.height);
      for (const float value : level.pixels) EXPECT_NEAR(value, 1, 2e-5F);
    }
  }
}

TEST(SmoothForReflections, AgreesWithTheLobeSummedDirectlyOverTheMap) {
  Environment env = make_sun_and_sky({.sun_radius_rad = 0.1F}, 128);
  smooth_for_reflections(env);
  std::mt19937 random(4);
  for (const std::size_t level : {1U, 2U, 3U, 5U}) {
    const double roughness = static_cast<double>(level) / 5;
    const double a2 = std::pow(roughness, 4);
    for (int i = 0; i < 20; ++i) {
      const Vec3f r = random_direction(random);
      double sum = 0;
      double weights = 0;
      for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 256; ++x) {
          const double c =
              dot(direction_of_texel(static_cast<float>(x), static_cast<float>(y), 256, 128), r);
          if (c <= 0) continue;
          double d = 0;
          for (const double side : {c, -c}) {
            d += a2 / std::pow((1 + side) / 2 * (a2 - 1) + 1, 2);
          }
          const double w = d * texel_solid_angle(y, 256, 128);
          weights += w;
          sum += w * env.radiance.at(y, x, 1);
        }
      }
      const double expected = sum / weights;
      // The roughest lobe ends sharply at the horizon, but its map has texels of 5.6 degrees.
      const double tolerance = level == 5 ? 0.06 : 0.03;
      EXPECT_NEAR(radiance_of(env, r, static_cast<float>(roughness)).y, expected,
                  tolerance * expected)
          << "level " << level << " at " << r.x << " " << r.y << " " << r.z;
    }
  }
}

TEST(SmoothForReflections, KeepsTheEnergyOfASunAndNeitherRingsNorOverflows) {
  for (const float sun : {1e5F, 1e8F}) {
    Environment env = make_even_environment(0.1F, 256);
    for (int c = 0; c < 3; ++c) env.radiance.at(80, 301, c) = sun;
    smooth_for_reflections(env);
    const double before = power(env.radiance, 0);
    for (const capture::Image& level : env.smoothed) {
      EXPECT_NEAR(power(level, 0), before, 0.03 * before);
      const auto [least, most] = std::ranges::minmax(level.pixels);
      EXPECT_GE(least, 0.0999F - 1e-9F * sun);
      EXPECT_LE(most, sun);
    }
    // Farther from the sun, the light only falls.
    const Vec3f to_sun = direction_of_texel(301, 80, 512, 256);
    const Vec3f across = normalize(cross(to_sun, Vec3f{0, 0, 1}));
    for (const float roughness : {0.2F, 0.6F}) {
      float nearer = std::numeric_limits<float>::infinity();
      for (float angle = 0.1F; angle < 1.4F; angle += 0.1F) {
        const Vec3f d = to_sun * std::cos(angle) + across * std::sin(angle);
        const float here = radiance_of(env, d, roughness).x;
        EXPECT_LE(here, nearer);
        nearer = here;
      }
    }
  }
}

TEST(SmoothForReflections, CountsNotANumberAndNegativeRadianceAsZero) {
  Environment env = make_even_environment(1, 64);
  env.radiance.at(10, 20, 0) = std::numeric_limits<float>::quiet_NaN();
  env.radiance.at(11, 20, 1) = -1e6F;
  env.radiance.at(12, 20, 2) = std::numeric_limits<float>::infinity();
  smooth_for_reflections(env);
  for (const capture::Image& level : env.smoothed) {
    for (const float value : level.pixels) {
      ASSERT_TRUE(std::isfinite(value));
      ASSERT_GE(value, 0);
    }
  }
  EXPECT_EQ(env.smoothed[0].at(10, 20, 0), 0);
  EXPECT_EQ(env.smoothed[0].at(11, 20, 1), 0);
  EXPECT_EQ(env.smoothed[0].at(12, 20, 2), brightest_radiance);
}

TEST(SmoothForReflections, GivesTheSameBitsEachTime) {
  Environment a = make_sun_and_sky({}, 64);
  Environment b = a;
  smooth_for_reflections(a);
  smooth_for_reflections(b);
  EXPECT_EQ(a.smoothed[3].pixels, b.smoothed[3].pixels);
}

TEST(SmoothForReflections, RefusesMapsThatAreNotTwiceAsWideAsHigh) {
  Environment env;
  EXPECT_THROW(smooth_for_reflections(env), std::invalid_argument);
  env.radiance = capture::make_image(10, 10);
  EXPECT_THROW(smooth_for_reflections(env), std::invalid_argument);
  env = make_even_environment(1, 8);
  EXPECT_THROW(smooth_for_reflections(env, 1), std::invalid_argument);
}

TEST(AreaAveraged, KeepsThePowerOfAnyMapAtAnySize) {
  const Environment env = make_sun_and_sky({}, 90);
  for (const int height : {64, 45, 30, 7, 1, 180}) {
    const capture::Image small = area_averaged(env.radiance, height);
    EXPECT_EQ(small.width, 2 * height);
    EXPECT_NEAR(power(small, 2), power(env.radiance, 2), 1e-5 * power(env.radiance, 2));
  }
}

}  // namespace
}  // namespace render::environment_test
