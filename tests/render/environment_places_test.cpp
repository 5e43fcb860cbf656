#include "render/environment_places.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>

#include "tests/render/sun_and_sky.h"

namespace render::environment_places_test {
namespace {

constexpr std::uint16_t centre = 3, of_further = cell_pixels + 5;

struct Sky {
  explicit Sky(const SunAndSky& made) : environment(make_sun_and_sky(made, 64)) {
    smooth_for_reflections(environment);
    levels = levels_of(environment);
    places.clear(environment, levels);
  }

  Vec3f light(std::span<const PlaceTerm> terms, std::uint16_t slot) const {
    Vec3f sum{};
    for (const PlaceTerm& e : terms) {
      if (e.slot == slot) sum += e.weight * radiance_at(*levels[e.level], e.x, e.y);
    }
    return sum;
  }

  Environment environment;
  std::vector<const capture::Image*> levels;
  EnvironmentPlaces places;
};

std::size_t count(std::span<const PlaceTerm> terms, std::uint16_t slot) {
  return static_cast<std::size_t>(std::ranges::count(terms, slot, &PlaceTerm::slot));
}

TEST(EnvironmentPlaces, BetweenTheSameTexelsBecomeOneInTheirMiddle) {
  Sky sky({});
  sky.places.add({{1, 1, 1}, 10.2F, 7.5F, centre, 0});
  sky.places.add({{3, 3, 3}, 10.6F, 7.1F, centre, 0});
  sky.places.add({{1, 1, 1}, 11.2F, 7.5F, centre, 0});      // beside
  sky.places.add({{1, 1, 1}, 10.2F, 7.5F, centre, 1});      // of another level
  sky.places.add({{1, 1, 1}, 10.2F, 7.5F, centre - 1, 0});  // of another slot
  const auto joined = sky.places.join();
  ASSERT_EQ(joined.size(), 4U);
  EXPECT_EQ(joined[0].slot, centre - 1);
  const auto both = std::ranges::find(joined, Vec3f{4, 4, 4}, &PlaceTerm::weight);
  ASSERT_NE(both, joined.end());
  EXPECT_NEAR(both->x, 10.5F, 1e-5);
  EXPECT_NEAR(both->y, 7.2F, 1e-5);
}

// What one gives the other takes away: in their middle they would be lost.
TEST(EnvironmentPlaces, ThatTakeAwayAreNotJoined) {
  Sky sky({});
  sky.places.add({{1, 1, 1}, 10.2F, 7.5F, centre, 0});
  sky.places.add({{-1, -1, -1}, 10.8F, 7.9F, centre, 0});
  const Vec3f before = sky.light(sky.places.join(), centre);
  EXPECT_EQ(sky.places.join().size(), 2U);
  EXPECT_EQ(sky.light(sky.places.join(), centre), before);
}

TEST(EnvironmentPlaces, AreLeftOutIfTheyAreNoNumbers) {
  Sky sky({});
  sky.places.add({{1, std::numeric_limits<float>::quiet_NaN(), 1}, 1, 1, centre, 0});
  sky.places.add({{std::numeric_limits<float>::infinity(), 1, 1}, 1, 1, centre, 0});
  EXPECT_TRUE(sky.places.empty());
}

TEST(EnvironmentPlaces, AsideAreForgotten) {
  Sky sky({});
  sky.places.add({{1, 1, 1}, 10.2F, 7.5F, centre, 0});
  sky.places.begin_aside();
  for (int i = 0; i < 100'000; ++i) sky.places.add({{1, 1, 1}, 10.2F, 7.5F, centre, 0});
  sky.places.end_aside();
  const auto joined = sky.places.join();
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_EQ(joined[0].weight, (Vec3f{1, 1, 1}));
}

// A million looks through glass: they come as many times as the sky has texels, and show the same.
TEST(EnvironmentPlaces, AreFewHoweverManyWereAdded) {
  Sky sky({});
  std::mt19937 random(9);
  std::uniform_real_distribution<float> unit(0, 1);
  constexpr int all = 400'000;
  Vec3f expected{};
  for (int i = 0; i < all; ++i) {
    const PlaceTerm e{Vec3f{1, 1, 1} * (1.0F / all), 20 + 8 * unit(random), 10 + 4 * unit(random),
                      centre, 0};
    expected += e.weight * radiance_at(*sky.levels[0], e.x, e.y);
    sky.places.add(e);
  }
  const auto joined = sky.places.join();
  EXPECT_LE(joined.size(), 64U);
  const Vec3f got = sky.light(joined, centre);
  EXPECT_NEAR(got.x, expected.x, 5e-3 * expected.x);
  EXPECT_NEAR(got.z, expected.z, 5e-3 * expected.z);
  EXPECT_LT(sky.places.bytes(), std::size_t{16} << 20);
}

// Where the sky is even, a texel of half the size tells nothing more; at a sun's rim it does.
TEST(EnvironmentPlaces, JoinWiderOnesWhereNothingChanges) {
  FurtherSamples samples;
  samples.clear();
  samples.begin(of_further - cell_pixels);
  samples.add(of_further - cell_pixels, {}, 16);
  Sky even({.sun_irradiance = 0, .clouds = 0});
  for (float& value : even.environment.radiance.pixels) value = 0.5F;
  smooth_for_reflections(even.environment);
  even.levels = levels_of(even.environment);
  even.places.clear(even.environment, even.levels);
  Sky uneven({.sun_radius_rad = 0.05F});
  const auto [x, y] = texel_of_direction(sun_direction({}), 128, 64);
  for (Sky* sky : {&even, &uneven}) {
    for (const std::uint16_t slot : {centre, of_further}) {
      sky->places.add({{1, 1, 1}, x, y, slot, 0});
      sky->places.add({{1, 1, 1}, (x - 0.5F) / 2, (y - 0.5F) / 2, slot, 1});
    }
  }
  const auto of_even = even.places.join_wider(samples);
  EXPECT_EQ(count(of_even, centre), 1U);
  EXPECT_EQ(count(of_even, of_further), 1U);
  EXPECT_NEAR(even.light(of_even, centre).y, 1, 1e-5);
  const auto of_uneven = uneven.places.join_wider(samples);
  EXPECT_EQ(count(of_uneven, centre), 2U);
  EXPECT_EQ(count(of_uneven, of_further), 2U);
}

}  // namespace
}  // namespace render::environment_places_test
