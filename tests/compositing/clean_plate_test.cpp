// Clean plates, and the light on them.
#include "compositing/clean_plate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "capture/counter_random.h"
#include "compositing/made_clip.h"
#include "compositing/plate_footage.h"

namespace compositing::clean_plate_test {
namespace {

using capture::Image;
using testing::HasSubstr;
using testing::ThrowsMessage;

Image even_picture(int height, int width, std::array<float, 3> light) {
  Image image = capture::make_image(height, width);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = light[i % 3];
  return image;
}

std::vector<Image> shots_of(const MadeClip& clip, int count) {
  std::vector<Image> shots;
  for (int i = 0; i < count; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  return shots;
}

TEST(AveragePlate, MeasuresTheNoiseOfItsShots) {
  const MadeClip clip(made_scene("noise"), 4, 120, 160);
  const CleanPlate plate = average_plate(shots_of(clip, 6));
  EXPECT_NEAR(plate.noise_gain, 1.5e-3, 3e-4);
  EXPECT_EQ(plate.colour, ScreenColour::green);
}

TEST(AveragePlate, TellsTheColourOfAnyScreen) {
  const auto colour_of = [](std::array<float, 3> light) {
    const Image shot = even_picture(16, 16, light);
    return average_plate({&shot, 1}).colour;
  };
  EXPECT_EQ(colour_of({0.04F, 0.4F, 0.06F}), ScreenColour::green);
  EXPECT_EQ(colour_of({0.04F, 0.06F, 0.4F}), ScreenColour::blue);
  EXPECT_EQ(colour_of({0.4F, 0.05F, 0.06F}), ScreenColour::red);
  EXPECT_EQ(colour_of({0.34F, 0.36F, 0.002F}), ScreenColour::yellow);
}

TEST(ScreenShare, IsThatOfThePicture) {
  const MadeClip clip(made_scene("noise"), 4, 120, 160);
  const CleanPlate empty = average_plate(shots_of(clip, 6));
  EXPECT_GT(screen_share(empty.light, empty.colour), 0.97);
  Image half = even_picture(64, 96, {0.04F, 0.4F, 0.06F});
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 48; ++x) {
      for (int c = 0; c < 3; ++c) half.at(y, x, c) = 0.3F;
    }
  }
  EXPECT_NEAR(screen_share(half, ScreenColour::green), 0.5, 0.01);
}

// Most of the picture is a wall whose red stands out, too, but less.
TEST(AveragePlate, TellsTheColourOfAScreenThatIsTheLesserPartOfThePicture) {
  Image shot = even_picture(64, 96, {0.5F, 0.4F, 0.3F});
  for (int y = 0; y < 64; ++y) {
    for (int x = 20; x < 48; ++x) {
      for (int c = 0; c < 3; ++c) shot.at(y, x, c) = std::array{0.04F, 0.4F, 0.06F}[c];
    }
  }
  EXPECT_EQ(average_plate({&shot, 1}).colour, ScreenColour::green);
  const std::vector<Image> shots{shot, shot, shot};
  EXPECT_EQ(average_plate(shots).colour, ScreenColour::green);
}

TEST(AveragePlate, LeavesOneShotAsItIs) {
  const Image shot = light_of(MadeClip(made_scene("noise"), 4, 60, 80).plate_shot(0));
  const CleanPlate plate = average_plate({&shot, 1});
  EXPECT_EQ(plate.light.pixels, shot.pixels);
  EXPECT_EQ(average_plate({&plate.light, 1}).light.pixels, shot.pixels);
}

TEST(AveragePlate, TakesWhatIsNoNumberForBlack) {
  Image shot = even_picture(16, 16, {0.1F, 0.5F, 0.1F});
  shot.pixels[5] = std::numeric_limits<float>::quiet_NaN();
  shot.pixels[6] = std::numeric_limits<float>::infinity();
  shot.pixels[7] = -3;
  for (const float value : average_plate({&shot, 1}).light.pixels) {
    ASSERT_TRUE(value >= 0 && value < 1);
  }
}

TEST(AveragePlate, HasTheColourThatIsGiven) {
  const std::vector<Image> shots{even_picture(16, 16, {0.3F, 0.6F, 0.1F})};
  EXPECT_EQ(average_plate(shots).colour, ScreenColour::green);
  EXPECT_EQ(average_plate(shots, ScreenColour::yellow).colour, ScreenColour::yellow);
  for (const auto name : screen_colour_names)
    EXPECT_EQ(name_of(screen_colour_from_name(name)), name);
  EXPECT_THROW(screen_colour_from_name("pink"), std::invalid_argument);
}

TEST(AveragePlate, RefusesShotsOfTwoSizesAndNone) {
  const std::vector<Image> shots{even_picture(16, 16, {0, 1, 0}), even_picture(16, 18, {0, 1, 0})};
  EXPECT_THAT([&] { average_plate(shots); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("16x16 and 18x16")));
  EXPECT_THROW(average_plate({}), std::invalid_argument);
}

TEST(PlateFootage, FindsTheScreenBehindAPersonWhoNeverLeaves) {
  MadeScene scene = made_scene("uneven");
  scene.walk = 3;
  const MadeClip clip(scene, 4, 135, 240);
  PlateFootage frames;
  for (int i = 0; i < 36; i += 3) frames.add(light_of(clip.frame(i).seen));
  const CleanPlate plate = frames.screen();
  EXPECT_EQ(plate.colour, ScreenColour::green);
  EXPECT_LT(plate.known, 0.95F);  // the middle of the person was never left
  const Image bare = average_plate(shots_of(clip, 6)).light;
  double off = 0;
  for (std::size_t i = 1; i < bare.pixels.size(); i += 3) {
    off += std::abs(plate.light.pixels[i] / bare.pixels[i] - 1);
  }
  EXPECT_LT(off * 3 / static_cast<double>(bare.pixels.size()), 0.05);
}

// However long it is, frames of all of it are kept.
TEST(PlateFootage, LooksAtFramesThatAreSpreadOverAllOfIt) {
  constexpr std::array<float, 3> screen{0.04F, 0.4F, 0.06F}, coat{0.2F, 0.1F, 0.3F};
  // A coat before the left half for most of the time, before the right half for the rest.
  const auto frame_of = [&](int i) {
    Image frame = even_picture(4, 8, screen);
    for (int y = 0; y < 4; ++y) {
      for (int x = i < 270 ? 0 : 4; x < (i < 270 ? 4 : 8); ++x) {
        std::copy_n(coat.begin(), 3, &frame.pixels[frame.index(y, x)]);
      }
    }
    return frame;
  };
  PlateFootage footage;
  for (int i = 0; i < 330; ++i) footage.add(frame_of(i));
  EXPECT_EQ(footage.count(), 330U);
  const CleanPlate plate = footage.screen();
  EXPECT_EQ(plate.known, 1);
  for (std::size_t i = 0; i < plate.light.pixels.size(); ++i) {
    ASSERT_NEAR(plate.light.pixels[i], screen[i % 3], 1e-3F * screen[i % 3]) << i;
  }
  // Most of the time tells a background.
  const Image background = footage.background().light;
  EXPECT_NEAR(background.at(1, 1, 0), coat[0], 1e-3F);
  EXPECT_NEAR(background.at(1, 6, 0), screen[0], 1e-3F);
}

TEST(PlateFootage, RefusesFramesOfTwoSizesAndNone) {
  PlateFootage footage;
  EXPECT_THROW(static_cast<void>(footage.screen()), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(footage.background()), std::invalid_argument);
  footage.add(even_picture(16, 16, {0, 1, 0}));
  EXPECT_THAT(
      [&] {
        footage.add(even_picture(16, 18, {0, 1, 0}));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("16x16 and 18x16")));
}

TEST(PlateLight, BlursAScreenAndNoOtherBackground) {
  Image shot = even_picture(16, 16, {0.1F, 0.5F, 0.1F});
  shot.at(8, 8, 1) = 0.75F;
  const CleanPlate plate = average_plate({&shot, 1});
  EXPECT_NEAR(PlateLight(plate).plate().light.at(8, 8, 1), 0.51F, 1e-5F);
  EXPECT_NEAR(PlateLight(plate).plate().light.at(6, 10, 1), 0.51F, 1e-5F);
  EXPECT_EQ(PlateLight(plate, PlateUse::difference).plate().light.pixels, shot.pixels);
}

TEST(PlateLight, FollowsLampsAndShadows) {
  const MadeClip clip(made_scene("shadow"), 4);
  PlateLight light(average_plate(shots_of(clip, 8)));
  const MadeFrame made = clip.frame(10);
  const Image seen = light_of(made.seen);
  const PlateSight sight = light.update(seen, true);
  EXPECT_GT(sight.screen, 0.4F);
  double off = 0, without = 0, count = 0;
  for (int y = 0; y < seen.height; ++y) {
    for (int x = 0; x < seen.width; ++x) {
      if (made.truth.at(y, x, 3) > 0) continue;
      const double bare = light.plate().light.at(y, x, 1), lit = plate_at(light.lit(), y, x)[0];
      off += std::abs(lit / seen.at(y, x, 1) - 1);
      without += std::abs(bare / seen.at(y, x, 1) - 1);
      count += 1;
    }
  }
  EXPECT_LT(off / count, 0.03);
  EXPECT_GT(without / count, 3 * off / count);
}

TEST(PlateLight, KeepsTheLastLightWhileNothingIsInSight) {
  const Image shot = even_picture(64, 64, {0.04F, 0.4F, 0.06F});
  PlateLight light(average_plate({&shot, 1}));
  light.update(even_picture(64, 64, {0.032F, 0.32F, 0.048F}), true);
  const float before = light.lit().cell(3, 3)[0];
  EXPECT_NEAR(before, 0.32F, 1e-3F);
  const PlateSight sight = light.update(even_picture(64, 64, {0.5F, 0.3F, 0.2F}), true);
  EXPECT_EQ(sight.screen, 0);
  EXPECT_EQ(light.lit().cell(3, 3)[0], before);
}

TEST(PlateLight, RefusesAFrameOfAnotherSizeNamingBoth) {
  const Image shot = even_picture(64, 80, {0.04F, 0.4F, 0.06F});
  PlateLight light(average_plate({&shot, 1}));
  EXPECT_THAT(
      [&] {
        light.update(even_picture(60, 82, {0, 0, 0}), true);
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("80x64, the frame 82x60")));
}

}  // namespace
}  // namespace compositing::clean_plate_test
