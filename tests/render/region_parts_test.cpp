// Parts of the regions that lights stand for: as much light in each, as far apart as the light is,
// and what a shadow's edge leaves of a region, by its parts, against the sum over its texels.
#include "render/region_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "render/light_follower.h"
#include "render/soft_lights.h"
#include "tests/render/sun_and_sky.h"

namespace render::region_parts_test {
namespace {

std::vector<RegionParts> parts_of(const LightRegions& regions, const capture::Image& map) {
  std::vector<DirectionalLight> lights;
  for (const RegionLight& sum : sum_regions(regions, map)) lights.push_back(make_light(sum));
  return part_regions(regions, map, lights);
}

// Towards the middle of a texel of a map of a height.
Vec3f towards(int y, int x, int height) {
  return direction_of_texel(static_cast<float>(x), static_cast<float>(y), 2 * height, height);
}

void expect_unit(const std::vector<RegionParts>& parts) {
  for (const RegionParts& of_one : parts) {
    for (const Vec3f to : of_one.directions) ASSERT_NEAR(length(to), 1, 1e-5F);
  }
}

TEST(RegionParts, HaveAsMuchLightEach) {
  // Two pieces at the horizon, as large, one three times as bright.
  capture::Image map = capture::make_image(64, 128, 3);
  for (int y = 30; y < 34; ++y) {
    for (int x = 40; x < 48; ++x) {
      for (int c = 0; c < 3; ++c) map.at(y, x, c) = 3, map.at(y, x + 20, c) = 1;
    }
  }
  const LightRegions one = cut_light_regions(map, {1, LightMethod::median_cut});
  const std::vector<RegionParts> parts = parts_of(one, map);
  ASSERT_EQ(parts.size(), 1U);
  int bright = 0;
  for (const Vec3f to : parts[0].directions) {
    bright += dot(to, towards(32, 44, 64)) > dot(to, towards(32, 64, 64));
  }
  EXPECT_EQ(bright, 12) << "of sixteen";
}

TEST(RegionParts, LieAsFarApartAsTheLight) {
  for (const int count : {1, 4, 16, 64}) {
    const LightTable table = make_light_table(
        Environment(make_sun_and_sky({.sun_irradiance = 0}, 128)), {count, LightMethod::split});
    ASSERT_EQ(table.parts.size(), table.lights.size());
    expect_unit(table.parts);
    for (std::size_t i = 0; i < table.lights.size(); ++i) {
      Vec3f sum{};
      for (const Vec3f to : table.parts[i].directions) sum += to * (1.0F / RegionParts::count);
      EXPECT_GT(dot(normalize(sum), table.lights[i].direction), 0.999F) << count << ' ' << i;
      // As DirectionalLight::spread has it.
      const float spread = std::sqrt(2 * std::max(1 - dot(sum, sum), 0.0F));
      EXPECT_NEAR(spread / table.lights[i].spread, 1, count == 1 ? 0.15 : 0.08)
          << count << ' ' << i;
    }
  }
}

TEST(RegionParts, TellWhatAPlaneLeavesOfARegionBetterThanADisc) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  const Environment env = make_sun_and_sky({}, 128);
  LightTable table = make_light_table(env, {});
  const capture::Image map = light_map(env);
  const LightRegions regions = cut_light_regions(map, {});
  const SoftLights by_parts(table);
  table.parts.clear();
  const SoftLights by_disc(table);
  double squares = 0, squares_of_disc = 0;
  int planes = 0;
  for (std::size_t light = 0; light < table.lights.size(); ++light) {
    if (!by_parts.has(light)) continue;
    for (int i = 0; i < 20; ++i) {
      const Vec3f through =
          normalize(by_parts.direction(light, static_cast<std::uint8_t>(random() % 16)) * 0.5F +
                    table.lights[light].direction * 0.5F);
      const Vec3f aside = normalize(
          cross(through, normalize(Vec3f{normal(random), normal(random), normal(random)})));
      double all = 0, left = 0;
      for (std::size_t texel = 0; texel < regions.light.size(); ++texel) {
        if (regions.light[texel] != light) continue;
        const int y = static_cast<int>(texel) / map.width, x = static_cast<int>(texel) % map.width;
        const float* p = &map.pixels[3 * texel];
        const double energy =
            double{luminance(p[0], p[1], p[2])} * texel_solid_angle(y, map.width, map.height);
        all += energy;
        if (dot(towards(y, x, map.height), aside) > 0) left += energy;
      }
      const auto off = [&](const SoftLights& soft) {
        double share = 0;
        for (std::uint8_t part = 0; part < SoftLights::count; ++part) {
          share += (dot(soft.direction(light, part), aside) > 0) / double{SoftLights::count};
        }
        return share - left / all;
      };
      squares += std::pow(off(by_parts), 2);
      squares_of_disc += std::pow(off(by_disc), 2);
      ++planes;
    }
  }
  ASSERT_GT(planes, 500);
  EXPECT_LT(std::sqrt(squares / planes), 0.045);
  EXPECT_LT(std::sqrt(squares / planes), 0.85 * std::sqrt(squares_of_disc / planes));
}

// Where the method ends: no light, a texel of it, maps of a few texels, and wild ones.
TEST(RegionParts, AreSoundWhateverTheMap) {
  std::mt19937 random(1);
  std::lognormal_distribution<float> wild(0, 3);
  for (const int height : {1, 2, 3, 17, 128}) {
    for (const int count : {1, 2, 7, 64, 500}) {
      capture::Image map = capture::make_image(height, 2 * height, 3);
      EXPECT_TRUE(parts_of(cut_light_regions(map, {count}), map).empty()) << "a black map";
      map.pixels[map.pixels.size() / 2] = 1;
      expect_unit(parts_of(cut_light_regions(map, {count}), map));
      for (float& value : map.pixels) value = random() % 3 == 0 ? 0 : wild(random);
      const LightRegions regions = cut_light_regions(map, {count});
      const std::vector<RegionParts> parts = parts_of(regions, map);
      EXPECT_EQ(parts.size(), regions.count);
      expect_unit(parts);
      // Cut from another map, in which some of the regions are black.
      for (std::size_t i = 0; i < map.pixels.size() / 2; ++i) map.pixels[i] = 0;
      expect_unit(parts_of(regions, map));
    }
  }
}

TEST(RegionParts, OfARegionWithoutTexelsAreItsMiddle) {
  LightRegions regions{1, {0, 0}, 2, {0, 0}};
  const std::vector<DirectionalLight> lights{{{0, 0, 1}, {}, 0}, {{0, 1, 0}, {}, 0}};
  const std::vector<RegionParts> parts =
      part_regions(regions, capture::make_image(1, 2, 3), lights);
  ASSERT_EQ(parts.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    for (const Vec3f to : parts[i].directions) EXPECT_EQ(to, lights[i].direction);
  }
}

TEST(RegionParts, StayAsLongAsDirectionsDo) {
  LightFollower follower;
  const Environment env = make_sun_and_sky({}, 128);
  Environment brighter = env;
  for (float& value : brighter.radiance.pixels) value *= 1.1F;
  Environment turned = env;
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 256; ++x) {
      for (int c = 0; c < 3; ++c) {
        turned.radiance.at(y, x, c) = env.radiance.at(y, (x + 60) % 256, c);
      }
    }
  }
  const LightTable first = follower.follow(env, {});
  const LightTable second = follower.follow(brighter, {});
  ASSERT_EQ(first.parts.size(), first.lights.size());
  EXPECT_EQ(first.parts, second.parts);
  const LightTable third = follower.follow(turned, {});
  EXPECT_NE(first.parts, third.parts);
  EXPECT_EQ(third.parts, make_light_table(turned, {}).parts) << "as of a table made anew";
}

}  // namespace
}  // namespace render::region_parts_test
