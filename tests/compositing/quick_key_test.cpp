// Quick keys against full ones, and what holds of both.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "compositing/keyer.h"
#include "compositing/made_clip.h"

namespace compositing::quick_key_test {
namespace {

using capture::HalfImage;
using capture::Image;

KeySettings quick_settings() {
  KeySettings settings;
  settings.effort = KeyEffort::quick;
  return settings;
}

CleanPlate plate_of(const MadeClip& clip) {
  const std::vector<Image> shots{light_of(clip.plate_shot(0)), light_of(clip.plate_shot(1))};
  return average_plate(shots);
}

Image even_picture(int height, int width, std::array<float, 3> light) {
  Image image = capture::make_image(height, width);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = light[i % 3];
  return image;
}

void expect_valid(const Image& keyed) {
  for (std::size_t i = 0; i < keyed.pixels.size(); ++i) {
    const float value = keyed.pixels[i];
    ASSERT_TRUE(value >= 0 && value <= (i % 4 == 3 ? 1 : capture::half_max)) << i << ": " << value;
  }
}

TEST(QuickKey, IsNearTheFullOneInAllScenesAndSizes) {
  const std::array<std::array<int, 2>, 4> sizes{{{135, 240}, {131, 237}, {66, 129}, {100, 161}}};
  std::size_t number = 0;
  for (const MadeScene& scene : made_scenes()) {
    const auto [height, width] = sizes[number++ % sizes.size()];
    const MadeClip clip(scene, 21, height, width);
    Keyer quick(plate_of(clip), quick_settings()), full(plate_of(clip), {});
    HalfImage a, b;
    double off = 0, count = 0;
    for (int i = 0; i < 4; ++i) {
      const Image light = light_of(clip.frame(i).seen);
      const KeyReport of_quick = quick.key(light, a), of_full = full.key(light, b);
      EXPECT_NEAR(of_quick.sight.gain, of_full.sight.gain, 0.03F * of_full.sight.gain)
          << scene.name;
      EXPECT_NEAR(of_quick.confidence, of_full.confidence, 0.35F) << scene.name;
      const Image keyed = to_float(a), wanted = to_float(b);
      expect_valid(keyed);
      for (std::size_t p = 0; p < keyed.pixels.size(); ++p) {
        off += std::abs(keyed.pixels[p] - wanted.pixels[p]);
        count += 1;
      }
    }
    EXPECT_LT(off / count, 0.008) << scene.name;
  }
}

TEST(QuickKey, OfCodesIsTheOneOfTheirLight) {
  const MadeClip clip(made_scene("plain"), 21, 135, 240);
  const MadeFrame made = clip.frame(5);
  std::vector<std::uint8_t> rgba;
  for (std::size_t i = 0; i < made.seen.codes.size(); i += 3) {
    rgba.insert(rgba.end(),
                {made.seen.codes[i], made.seen.codes[i + 1], made.seen.codes[i + 2], 9});
  }
  Keyer a(plate_of(clip), quick_settings()), b(plate_of(clip), quick_settings());
  HalfImage of_codes, of_light;
  a.key(CodedFrame{135, 240, rgba, capture::Transfer::srgb}, of_codes);
  b.key(light_of(made.seen), of_light);
  const Image codes = to_float(of_codes), light = to_float(of_light);
  double off = 0;
  for (std::size_t i = 0; i < codes.pixels.size(); ++i)
    off += std::abs(codes.pixels[i] - light.pixels[i]);
  EXPECT_LT(off / static_cast<double>(codes.pixels.size()), 2e-3);
}

TEST(QuickKey, LeavesNothingOfAPersonWhoHasLeft) {
  const Image screen = even_picture(48, 80, {0.035F, 0.4F, 0.06F});
  Image person = screen;
  for (int y = 5; y < 40; ++y) {
    for (int x = 11; x < 67; ++x) {
      for (int c = 0; c < 3; ++c) person.at(y, x, c) = 0.3F;
    }
  }
  Keyer keyer(average_plate({&screen, 1}), quick_settings());
  KeyedFrame keyed;
  for (int i = 0; i < 3; ++i) keyer.key(person, keyed);
  EXPECT_EQ(keyed.image().pixels[keyed.image().index(20, 40, 3)], 0x3C00);
  for (int i = 0; i < 3; ++i) keyer.key(screen, keyed);
  for (const capture::Half half : keyed.image().pixels) ASSERT_EQ(half, 0);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 10; ++column) ASSERT_FALSE(keyed.has_any_in_block(row, column));
  }
}

TEST(QuickKey, ForgetsAPersonAtOnceWithoutSmoothing) {
  const MadeClip clip(made_scene("noise"), 21, 135, 240);
  KeySettings settings = quick_settings();
  settings.smoothing = 0;
  settings.follows_light = false;  // bounds of what is bare follow gains by steps, so have a past
  Keyer left(plate_of(clip), settings), never(plate_of(clip), settings);
  KeyedFrame a, b;
  Image person = light_of(clip.plate_shot(2));
  for (int y = 24; y < 112; ++y) {
    for (int x = 64; x < 176; ++x) {
      for (int c = 0; c < 3; ++c) person.at(y, x, c) = 0.3F;
    }
  }
  left.key(person, a);
  EXPECT_EQ(a.image().pixels[a.image().index(64, 120, 3)], 0x3C00);
  for (int i = 3; i < 6; ++i) {
    const Image screen = light_of(clip.plate_shot(i));
    left.key(screen, a), never.key(screen, b);
    ASSERT_EQ(a.image().pixels, b.image().pixels) << i;
    for (int row = 0; row < 17; ++row) {
      for (int column = 0; column < 30; ++column)
        ASSERT_EQ(a.has_any_in_block(row, column), b.has_any_in_block(row, column));
    }
  }
}

TEST(QuickKey, LeavesNoTrail) {
  const MadeClip clip(made_scene("walking"), 21, 135, 240);
  Keyer keyer(plate_of(clip), quick_settings());
  HalfImage half;
  double trail = 0, bare = 0;
  for (int i = 0; i < 24; ++i) {
    const MadeFrame made = clip.frame(i);
    keyer.key(light_of(made.seen), half);
    const Image keyed = to_float(half);
    for (std::size_t p = 3; p < keyed.pixels.size(); p += 4) {
      if (made.truth.pixels[p] > 0) continue;
      trail += keyed.pixels[p];
      bare += 1;
    }
  }
  EXPECT_LT(trail / bare, 2e-3);
}

TEST(QuickKey, HoldsMasks) {
  const Image screen = even_picture(40, 64, {0.035F, 0.4F, 0.06F});
  const Image grey = even_picture(40, 64, {0.4F, 0.4F, 0.4F});
  KeyMasks masks;
  masks.garbage.assign(40 * 64, 0);
  masks.core.assign(40 * 64, 0);
  masks.garbage[20 * 64 + 30] = 255;
  masks.core[9 * 64 + 50] = 255;
  Keyer keyer(average_plate({&screen, 1}), quick_settings(), masks);
  HalfImage keyed;
  keyer.key(grey, keyed);
  EXPECT_EQ(to_float(keyed).at(20, 30, 3), 0);
  EXPECT_EQ(to_float(keyed).at(20, 31, 3), 1);
  keyer.restart();
  keyer.key(screen, keyed);
  EXPECT_EQ(to_float(keyed).at(9, 50, 3), 1);
  EXPECT_EQ(to_float(keyed).at(9, 51, 3), 0);
}

TEST(QuickKey, StaysValidWhereThereIsNothingToGoBy) {
  const Image screen = even_picture(40, 64, {0.035F, 0.4F, 0.06F});
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  Keyer keyer(average_plate({&screen, 1}), quick_settings());
  HalfImage keyed;
  for (const std::array<float, 3> light : {std::array<float, 3>{0, 0, 0},
                                           {1e-7F, 1e-6F, 1e-7F},
                                           {1e6F, 1e7F, 1e6F},
                                           {nan, nan, nan},
                                           {inf, inf, inf},
                                           {-1, -1, -1}}) {
    const KeyReport report = keyer.key(even_picture(40, 64, light), keyed);
    EXPECT_LT(report.confidence, 0.6F) << light[1];
    expect_valid(to_float(keyed));
  }
  const Image black = even_picture(40, 64, {0, 0, 0});
  Keyer of_nothing(average_plate({&black, 1}), quick_settings());
  EXPECT_EQ(of_nothing.key(screen, keyed).status, KeyStatus::no_screen);
  expect_valid(to_float(keyed));
}

TEST(QuickKey, IsTheFullOneWhereItDoesNotApply) {
  for (const std::string_view what : {"yellow screen", "difference", "plain ratio"}) {
    const MadeClip clip(made_scene(what == "yellow screen" ? what : "plain"), 21, 66, 129);
    KeySettings settings;
    if (what == "difference") settings.method = KeyMethod::difference;
    if (what == "plain ratio") settings.learned = false;
    Keyer full(plate_of(clip), settings);
    settings.effort = KeyEffort::quick;
    Keyer quick(plate_of(clip), settings);
    HalfImage a, b;
    for (int i = 0; i < 3; ++i) {
      const Image light = light_of(clip.frame(i).seen);
      quick.key(light, a), full.key(light, b);
      ASSERT_EQ(a.pixels, b.pixels) << what;
    }
  }
}

TEST(QuickKey, RefusesWhatTheFullOneRefuses) {
  const Image screen = even_picture(16, 24, {0.035F, 0.4F, 0.06F});
  Keyer keyer(average_plate({&screen, 1}), quick_settings());
  HalfImage keyed;
  EXPECT_THROW(keyer.key(even_picture(20, 30, {0, 0, 0}), keyed), std::invalid_argument);
  EXPECT_THROW(keyer.key(capture::make_image(16, 24, 4), keyed), std::invalid_argument);
  const std::vector<std::uint8_t> few(8);
  EXPECT_THROW(keyer.key(CodedFrame{16, 24, few, capture::Transfer::srgb}, keyed),
               std::invalid_argument);
}

// A screen that hardly has any light of its colour, with a camera's noise: bare, it is clear.
TEST(QuickKey, LeavesADimScreenClear) {
  constexpr int height = 96, width = 160;
  for (const std::array<int, 3> colour :
       {std::array{0x1E, 0x3B, 0x21}, std::array{0x1A, 0x36, 0x1C}}) {
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 2);
    const auto shot = [&](std::vector<std::uint8_t>& codes) {
      codes.resize(4 * height * width);
      Image light = capture::make_image(height, width);
      for (std::size_t i = 0; i < codes.size(); ++i) {
        const std::size_t c = i % 4;
        const double code = c < 3 ? colour[c] + noise(random) : 255;
        codes[i] = static_cast<std::uint8_t>(std::clamp(std::lround(code), 0L, 255L));
        if (c == 3) continue;
        light.pixels[i / 4 * 3 + c] =
            static_cast<float>(capture::decode(capture::Transfer::srgb, codes[i] / 255.0));
      }
      return light;
    };
    std::vector<std::uint8_t> codes;
    std::vector<Image> shots;
    for (int i = 0; i < 8; ++i) shots.push_back(shot(codes));
    Keyer by_codes(average_plate(shots), quick_settings()),
        by_light(average_plate(shots), quick_settings());
    HalfImage a, b;
    for (int i = 0; i < 3; ++i) {
      const Image light = shot(codes);
      by_codes.key({height, width, codes, capture::Transfer::srgb}, a);
      by_light.key(light, b);
    }
    for (const HalfImage* keyed : {&a, &b}) {
      const Image rgba = to_float(*keyed);
      int opaque = 0;
      for (std::size_t i = 3; i < rgba.pixels.size(); i += 4) opaque += rgba.pixels[i] > 0.5F;
      EXPECT_LT(opaque, height * width / 500) << colour[0] << " " << (keyed == &a);
    }
  }
}

// A picture whose last rows are no whole block: once nobody is there, nothing is marked.
TEST(QuickKey, ForgetsRowsAtTheLowerEdge) {
  constexpr int height = 94, width = 160;
  const Image screen = even_picture(height, width, {0.05F, 0.4F, 0.08F});
  Image stands = screen;
  for (int y = 40; y < height; ++y) {
    for (int x = 40; x < 120; ++x)
      stands.at(y, x, 0) = stands.at(y, x, 1) = stands.at(y, x, 2) = 0.3F;
  }
  const std::vector<Image> shots{screen, screen};
  Keyer keyer(average_plate(shots), quick_settings());
  KeyedFrame keyed;
  for (int i = 0; i < 4; ++i) keyer.key(stands, keyed);
  EXPECT_TRUE(keyed.has_any_in_block(11, 10));
  for (int i = 0; i < 12; ++i) keyer.key(screen, keyed);
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 20; ++column)
      EXPECT_FALSE(keyed.has_any_in_block(row, column)) << row << " " << column;
  }
}

// However much is smoothed, and however noisy it is, what a mask holds is whole.
TEST(QuickKey, KeepsWhatAMaskHoldsAlsoUnderNoise) {
  constexpr int height = 64, width = 64;
  const Image screen = even_picture(height, width, {0.02F, 0.06F, 0.02F});
  CleanPlate plate = average_plate(std::vector<Image>{screen, screen});
  plate.noise_gain = 0.01F, plate.noise_floor = 1e-4F;
  KeyMasks masks;
  masks.core.assign(height * width, 255);
  for (const KeyEffort effort : {KeyEffort::quick, KeyEffort::full}) {
    KeySettings settings;
    settings.effort = effort;
    settings.smoothing = 4;
    Keyer keyer(plate, settings, masks);
    HalfImage keyed;
    for (int i = 0; i < 4; ++i) keyer.key(even_picture(height, width, {0.3F, 0.3F, 0.3F}), keyed);
    const Image rgba = to_float(keyed);
    for (std::size_t i = 3; i < rgba.pixels.size(); i += 4) ASSERT_EQ(rgba.pixels[i], 1) << i;
  }
}

}  // namespace
}  // namespace compositing::quick_key_test
