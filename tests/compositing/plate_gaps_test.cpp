// The screen, seen where its plate shows something else.
#include "compositing/plate_gaps.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "compositing/keyer.h"
#include "compositing/made_clip.h"

namespace compositing::plate_gaps_test {
namespace {

using capture::Image;
using Light = std::array<float, 3>;

constexpr int height = 144, width = 256;
constexpr Light green{0.04F, 0.3F, 0.06F}, grey{0.12F, 0.12F, 0.12F}, skin{0.4F, 0.26F, 0.2F};

void fill(Image& image, int left, int top, int right, int bottom, const Light& light) {
  for (int y = std::max(top, 0); y < std::min(bottom, image.height); ++y) {
    for (int x = std::max(left, 0); x < std::min(right, image.width); ++x) {
      for (int c = 0; c < 3; ++c) image.at(y, x, c) = light[static_cast<std::size_t>(c)];
    }
  }
}

Light times(float gain, Light light) {
  for (float& value : light) value *= gain;
  return light;
}

// A screen that is darker at its sides, in a grey room if it does not fill the picture.
Image studio(int margin, const Light& screen = green) {
  Image image = capture::make_image(height, width);
  fill(image, 0, 0, width, height, grey);
  for (int x = margin; x < width - margin; ++x) {
    const float off = std::abs(static_cast<float>(x) / width - 0.5F);
    fill(image, x, 0, x + 1, height - margin, times(1 - 0.8F * off, screen));
  }
  return image;
}

CleanPlate plate_of(const Image& light) { return average_plate({&light, 1}); }

KeyReport key(const Image& plate, const Image& frame, KeyEffort effort = KeyEffort::full) {
  KeySettings settings;
  settings.effort = effort;
  Keyer keyer(plate_of(plate), settings);
  KeyedFrame keyed;
  return keyer.key(frame, keyed);
}

TEST(PlateGaps, MakeTheKeyUnsureWhereSomebodyWasLeftInThePlate) {
  for (const Light& screen : {green, Light{0.04F, 0.06F, 0.3F}, Light{0.3F, 0.35F, 0.02F}}) {
    for (const Light& what : {Light{0.2F, 0.2F, 0.22F}, Light{0.05F, 0.04F, 0.04F}, skin, Light{},
                              Light{NAN, NAN, NAN}, Light{-1, -1, -1}}) {
      for (const float light : {1.0F, 0.7F, 1.4F}) {
        Image with = studio(0, screen);
        fill(with, 100, 50, 150, height, what);
        Image frame = studio(0, times(light, screen));
        fill(frame, 30, 50, 70, height, grey);
        for (const KeyEffort effort : {KeyEffort::full, KeyEffort::quick}) {
          const KeyReport report = key(with, frame, effort);
          EXPECT_EQ(report.status, KeyStatus::ghost) << what[0] << " under " << light;
          EXPECT_TRUE(is_unsure(report.confidence));
          const float share = 50.0F * 94 / (height * width);  // of the picture
          EXPECT_GT(report.ghost, 0.4F * share) << what[0] << " under " << light;
          EXPECT_LE(report.ghost, share);
        }
        EXPECT_EQ(key(studio(0, screen), frame).ghost, 0);
      }
    }
  }
}

TEST(PlateGaps, AreSeenAlsoWhereHalfOfThePlateIsGone) {
  for (const int rows : {16, 40, 72}) {
    Image cut = studio(0);
    fill(cut, 0, 0, width, rows, grey);
    const KeyReport report = key(cut, studio(0));
    EXPECT_EQ(report.status, KeyStatus::ghost) << rows;
    EXPECT_TRUE(is_unsure(report.confidence)) << rows;
  }
}

// What stands there now is no screen.
TEST(PlateGaps, AreNoneBesideAScreenThatDoesNotFillThePicture) {
  const Image plate = studio(40);
  for (const Light& clothes : {Light{0.02F, 0.1F, 0.03F}, Light{0.1F, 0.4F, 0.1F},
                               Light{0.05F, 0.2F, 0.15F}, Light{0.12F, 0.3F, 0.05F}, skin, grey}) {
    for (int x = -20; x < width; x += 24) {
      Image frame = studio(40);
      fill(frame, x, 40, x + 40, height, clothes);
      EXPECT_EQ(key(plate, frame).ghost, 0) << clothes[1] << " at " << x;
    }
  }
}

TEST(PlateGaps, AreNoneWhereAPictureIsOffByLessThanACell) {
  for (const int off : {1, 2, 3, 5, 7})
    EXPECT_EQ(key(studio(40), studio(40 - off)).ghost, 0) << off;
}

TEST(PlateGaps, AreNoneWhereAScreenIsPalerOrDarker) {
  Image plate = studio(0);
  fill(plate, 0, 0, 60, 80, {0.2F, 0.35F, 0.22F});  // a gleam
  fill(plate, 180, 0, 240, 80, times(0.1F, green));
  for (const float light : {0.7F, 1.0F, 1.3F}) {
    Image frame = plate;
    for (float& value : frame.pixels) value *= light;
    EXPECT_EQ(key(plate, frame).ghost, 0) << light;
  }
}

TEST(PlateGaps, AreNotLookedForUnderMasks) {
  Image with = studio(0);
  fill(with, 100, 50, 150, height, skin);
  KeyMasks masks;
  masks.garbage.resize(std::size_t{height} * width);
  for (int y = 40; y < height; ++y) {
    for (int x = 90; x < 160; ++x) {
      masks.garbage[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = 255;
    }
  }
  Keyer keyer(plate_of(with), {}, masks);
  KeyedFrame keyed;
  EXPECT_EQ(keyer.key(studio(0), keyed).ghost, 0);
}

// The person of each scene covers and uncovers the screen.
TEST(PlateGaps, AreNoneInMadeScenes) {
  for (const MadeScene& scene : made_scenes()) {
    const MadeClip clip(scene, 1, 135, 240);
    const std::vector<Image> shots{light_of(clip.plate_shot(0)), light_of(clip.plate_shot(1))};
    Keyer keyer(average_plate(shots), {});
    KeyedFrame keyed;
    for (const int i : {0, 20}) {
      for (int again = 0; again < 4; ++again) {
        const KeyReport report = keyer.key(light_of(clip.frame(i).seen), keyed);
        ASSERT_EQ(report.ghost, 0) << scene.name;
        ASSERT_NE(report.status, KeyStatus::ghost) << scene.name;
      }
    }
  }
}

}  // namespace
}  // namespace compositing::plate_gaps_test
