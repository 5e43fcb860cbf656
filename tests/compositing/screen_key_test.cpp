// Which of a picture's colours is taken for the screen's.
#include "compositing/screen_key.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace compositing::screen_key_test {
namespace {

struct Patch {
  Light3 light;
  double share;  // of the picture
};

// Pixels of such patches, each somewhat brighter or darker and with a camera's noise.
std::vector<Light3> picture_of(const std::vector<Patch>& patches, unsigned seed = 1) {
  constexpr int pixels = 20000;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> lit(0.75F, 1.25F);
  std::normal_distribution<float> noise(0, 2e-3F);
  std::vector<Light3> picture;
  for (const Patch& patch : patches) {
    for (int i = 0; i < patch.share * pixels; ++i) {
      const float by = lit(random);
      Light3& light = picture.emplace_back();
      for (std::size_t c = 0; c < 3; ++c) {
        light[c] = clean(patch.light[c] * by + noise(random));
      }
    }
  }
  return picture;
}

constexpr Light3 green{0.06F, 0.35F, 0.08F}, blue{0.03F, 0.08F, 0.4F}, skin{0.5F, 0.3F, 0.21F},
    grey{0.2F, 0.2F, 0.2F}, black{0.01F, 0.01F, 0.01F};

TEST(ScreenKey, IsNotTakenFromASpeckOfAnotherColour) {
  for (const double speck : {0.0001, 0.001, 0.01, 0.03, 0.049}) {
    for (const Light3& mark : {Light3{0.9F, 0.02F, 0.02F}, Light3{0.6F, 0.5F, 0.02F},
                               Light3{0.02F, 0.02F, 0.9F}, Light3{0.02F, 0.7F, 0.7F}}) {
      EXPECT_EQ(find_screen_colour(picture_of({{green, 1 - speck}, {mark, speck}})),
                ScreenColour::green)
          << speck;
    }
    EXPECT_EQ(find_screen_colour(picture_of({{blue, 1 - speck}, {{0.8F, 0.1F, 0.1F}, speck}})),
              ScreenColour::blue)
        << speck;
  }
}

// Light tells nothing: what is before the screen is mostly lit better than it.
TEST(ScreenKey, IsFoundBehindBrighterThings) {
  for (const float by : {1.0F, 0.5F, 0.2F}) {
    const Light3 screen{green[0] * by, green[1] * by, green[2] * by};
    for (const double share : {0.8, 0.5, 0.25}) {
      for (const Light3& before : {skin, Light3{0.6F, 0.05F, 0.05F}, Light3{0.6F, 0.5F, 0.05F},
                                   Light3{0.08F, 0.1F, 0.25F}}) {
        const auto picture =
            picture_of({{screen, share}, {before, 0.3 * (1 - share)}, {grey, 0.7 * (1 - share)}});
        EXPECT_EQ(find_screen_colour(picture), ScreenColour::green) << by << " " << share;
      }
    }
  }
}

TEST(ScreenKey, MayBeTheLesserPartOfTheStudio) {
  const Light3 wood{0.35F, 0.18F, 0.08F};
  EXPECT_EQ(find_screen_colour(picture_of({{green, 0.25}, {wood, 0.45}, {grey, 0.3}})),
            ScreenColour::green);
  EXPECT_EQ(find_screen_colour(picture_of({{blue, 0.2}, {skin, 0.1}, {black, 0.7}})),
            ScreenColour::blue);
}

TEST(ScreenKey, MayHaveAnyColour) {
  const std::vector<std::pair<ScreenColour, Light3>> screens{
      {ScreenColour::red, {0.5F, 0.04F, 0.05F}},
      {ScreenColour::green, green},
      {ScreenColour::blue, blue},
      {ScreenColour::yellow, {0.5F, 0.55F, 0.08F}},
      {ScreenColour::cyan, {0.05F, 0.4F, 0.4F}},
      {ScreenColour::magenta, {0.5F, 0.05F, 0.45F}},
      {ScreenColour::green, {0.05F, 0.11F, 0.06F}},  // in the dark
      {ScreenColour::green, {0.35F, 0.6F, 0.35F}},   // pale
  };
  for (const auto& [colour, light] : screens) {
    EXPECT_EQ(find_screen_colour(picture_of({{light, 0.65}, {skin, 0.06}, {black, 0.29}})), colour)
        << name_of(colour);
  }
}

TEST(ScreenKey, IsNoneWhereNothingHasAny) {
  const std::vector<Light3> even(100, grey);
  EXPECT_EQ(find_screen_colour(even), std::nullopt);
  const ScreenLight key = find_key(even, ScreenColour::green);
  EXPECT_LE(key.excess, 0);
  EXPECT_FALSE(is_screen(key, key));
  // A speck is no large thing.
  EXPECT_EQ(find_screen_colour(picture_of({{grey, 0.999}, {green, 0.001}})), std::nullopt);
}

// Whatever its light, a screen's key is its own, not that of brighter things with some green.
TEST(ScreenKey, IsOfTheScreensChromaticity) {
  const Light3 dim{0.012F, 0.07F, 0.016F}, yellow{0.6F, 0.5F, 0.05F};
  const ScreenLight key =
      find_key(picture_of({{dim, 0.3}, {yellow, 0.2}, {grey, 0.5}}), ScreenColour::green);
  EXPECT_NEAR(key.first, dim[1], 0.3F * dim[1]);
  EXPECT_NEAR(key.second / key.first, dim[0] / dim[1], 0.06F);
  EXPECT_NEAR(key.third / key.first, dim[2] / dim[1], 0.06F);
}

}  // namespace
}  // namespace compositing::screen_key_test
