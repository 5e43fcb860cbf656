// Clothes with some of the screen's colour: whole where they can be told, else unsure.
#include <gtest/gtest.h>

#include <cmath>

#include "compositing/keyer.h"
#include "compositing/made_clip.h"

namespace compositing::key_cloth_test {
namespace {

using capture::Image;
using Light = std::array<float, 3>;

struct Found {
  float alpha = 0;  // mean within
  KeyReport report;
};

// A person of one cloth, chequered by a fifth of its light, before a screen of `screen`.
Found key_cloth(const Light& cloth, const Light& screen, KeyEffort effort) {
  constexpr int height = 144, width = 256, left = 64, right = 192, top = 32;
  Image picture = capture::make_image(height, width);
  const auto put = [&](int y, int x, const Light& light, float shade) {
    for (int c = 0; c < 3; ++c) picture.at(y, x, c) = shade * light[static_cast<std::size_t>(c)];
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) put(y, x, screen, 1);
  }
  KeySettings settings;
  settings.effort = effort;
  Keyer keyer(average_plate({&picture, 1}), settings);
  for (int y = top; y < height; ++y) {
    for (int x = left; x < right; ++x) {
      const float wave =
          std::sin(0.8F * static_cast<float>(x)) * std::sin(0.9F * static_cast<float>(y));
      put(y, x, cloth, 1 + 0.2F * wave);
    }
  }
  capture::HalfImage half;
  Found found{0, keyer.key(picture, half)};
  const Image keyed = to_float(half);
  int count = 0;
  for (int y = top + 4; y < height - 4; ++y) {
    for (int x = left + 4; x < right - 4; ++x, ++count) found.alpha += keyed.at(y, x, 3);
  }
  found.alpha /= static_cast<float>(count);
  return found;
}

constexpr Light dim_green{0.05F, 0.3F, 0.07F};

TEST(KeyCloth, OfYellowAndKhakiIsWholeBeforeGreen) {
  for (const KeyEffort effort : {KeyEffort::full, KeyEffort::quick}) {
    for (const Light& cloth : {Light{0.6F, 0.5F, 0.05F},
                               {0.55F, 0.5F, 0.1F},
                               {0.4F, 0.36F, 0.2F},
                               {0.6F, 0.45F, 0.15F}}) {
      const Found found = key_cloth(cloth, dim_green, effort);
      EXPECT_GE(found.alpha, 0.9F) << cloth[0] << ' ' << cloth[1] << ' ' << cloth[2];
      if (effort == KeyEffort::quick) continue;  // has .9 to .95 of some, and is unsure of them
      EXPECT_FALSE(is_unsure(found.report.confidence)) << cloth[0] << ' ' << found.report.thin;
    }
  }
}

TEST(KeyCloth, ThatMayBeAMixtureIsUnsure) {
  for (const KeyEffort effort : {KeyEffort::full, KeyEffort::quick}) {
    for (const Light& cloth : {Light{0.2F, 0.2F, 0.06F}, {0.12F, 0.19F, 0.1F}}) {
      const KeyReport report = key_cloth(cloth, dim_green, effort).report;
      EXPECT_TRUE(is_unsure(report.confidence)) << cloth[0] << ' ' << report.thin;
      EXPECT_EQ(report.status, KeyStatus::thin);
    }
  }
}

// Hair, fur, veil and glass are half transparent too, but not all that is deep within a person.
TEST(KeyCloth, OfOtherColoursLeavesTheKeySure) {
  for (const char* name : {"plain", "spill", "white hair", "fur", "veil", "glass", "4:2:0"}) {
    const MadeClip clip(made_scene(name), 1);
    const Image shot = light_of(clip.plate_shot(0));
    Keyer keyer(average_plate({&shot, 1}), {});
    capture::HalfImage half;
    EXPECT_LE(keyer.key(light_of(clip.frame(10).seen), half).thin, 0.25F) << name;
  }
}

}  // namespace
}  // namespace compositing::key_cloth_test
