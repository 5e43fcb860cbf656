#include "render/place_terms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "render/cell_transport.h"

namespace render::place_terms_test {
namespace {

TEST(PlaceTerms, BetweenTheSameTexelsBecomeOneInTheirMiddle) {
  PlaceTerms places;
  places.clear();
  places.add({{1, 1, 1}, 10.2F, 7.5F, 9, 40});
  places.add({{3, 3, 3}, 10.6F, 7.1F, 9, 40});
  places.add({{1, 1, 1}, 11.2F, 7.5F, 9, 40});  // beside
  places.add({{1, 1, 1}, 10.2F, 7.5F, 9, 41});  // of another level
  places.add({{1, 1, 1}, 10.2F, 7.5F, 3, 40});  // of another slot
  const auto joined = places.join();
  ASSERT_EQ(joined.size(), 4U);
  EXPECT_EQ(joined[0].slot, 3);
  EXPECT_EQ(joined[1].weight, (Vec3f{4, 4, 4}));
  EXPECT_NEAR(joined[1].x, 10.5F, 1e-5);
  EXPECT_NEAR(joined[1].y, 7.2F, 1e-5);
}

// What one gives the other takes away: in their middle they would be lost.
TEST(PlaceTerms, ThatTakeAwayAreNotJoinedAndThatAreNoneLeftOut) {
  PlaceTerms places;
  places.clear();
  places.add({{1, 1, 1}, 10.2F, 7.5F, 9, 40});
  places.add({{-1, -1, -1}, 10.8F, 7.9F, 9, 40});
  places.add({{1, std::nanf(""), 1}, 10.2F, 7.5F, 9, 40});
  EXPECT_EQ(places.join().size(), 2U);
}

// As a pixel's samples through glass find them: they come to no more than the texels that there
// are, however many they are, in the last slot as well, and show what all of them do.
TEST(PlaceTerms, AreNoMoreThanTheirTexels) {
  capture::Image picture = capture::make_image(8, 8);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> number(0, 1);
  for (float& value : picture.pixels) value = number(random);
  constexpr std::uint16_t last = CellPicture::lit_slots - 1;
  PlaceTerms places;
  places.clear();
  constexpr int count = 300'000;
  double all = 0;
  for (int i = 0; i < count; ++i) {
    const float x = 7 * number(random), y = 7 * number(random);
    places.add({{1, 1, 1}, x, y, last, 0});
    all += plate_at(picture, x, y).y;
  }
  EXPECT_LT(places.bytes(), std::size_t{8} << 20);
  double joined = 0;
  for (const PlaceTerm& place : places.join()) {
    EXPECT_EQ(place.slot, last);
    joined += place.weight.y * plate_at(picture, place.x, place.y).y;
  }
  EXPECT_EQ(places.join().size(), 49U);
  EXPECT_NEAR(joined / all, 1, 0.005);
  places.clear();
  EXPECT_TRUE(places.empty());
}

}  // namespace
}  // namespace render::place_terms_test
