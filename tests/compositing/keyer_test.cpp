// The keyer: laws of the formula, masks, dials, refusals.
#include "compositing/keyer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "capture/counter_random.h"
#include "compositing/key_training.h"
#include "compositing/made_clip.h"

namespace compositing::keyer_test {
namespace {

using capture::HalfImage;
using capture::Image;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::array<float, 3> green{0.035F, 0.40F, 0.06F};

Image even_picture(int height, int width, std::array<float, 3> light) {
  Image image = capture::make_image(height, width);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = light[i % 3];
  return image;
}

CleanPlate even_plate(int height, int width, std::array<float, 3> light = green) {
  const Image shot = even_picture(height, width, light);
  return average_plate({&shot, 1});
}

float random(std::uint64_t seed, std::uint64_t of) {
  return static_cast<float>(capture::uniform_high(capture::mixed_bits(seed, of)));
}

// The ratio alone: no table, no dead zones.
KeyDials plain_dials() {
  KeyDials dials;
  dials.black = 0;
  dials.scale = 1;
  return dials;
}

LitPlate lit_plate(std::array<float, 3> light) {
  PlateLight plate(even_plate(16, 16, light));
  return plate.lit();
}

TEST(KeyTexel, UndoesTheMixtureOfGreyAndScreenExactly) {
  const LitPlate plate = lit_plate(green);
  for (std::uint64_t i = 0; i < 500; ++i) {
    const float alpha = random(1, i), grey = random(2, i);
    std::array<float, 3> seen{};
    for (std::size_t c = 0; c < 3; ++c) seen[c] = alpha * grey + (1 - alpha) * green[c];
    const auto keyed = key_texel(plate, plain_dials(), 3, 3, seen);
    ASSERT_NEAR(keyed[3], alpha, 2e-5F);
    for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(keyed[c], alpha * grey, 2e-5F);
  }
}

TEST(KeyTexel, OverThePlateGivesTheTexelBackUnlessSpillWasTaken) {
  const LitPlate plate = lit_plate(green);
  KeyDials dials = plain_dials();
  dials.despill = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    const std::array<float, 3> seen{random(3, i), random(4, i) * 0.9F, random(5, i)};
    const auto keyed = key_texel(plate, dials, 3, 3, seen);
    if (keyed[3] <= 0 || *std::min_element(keyed.begin(), keyed.end() - 1) <= 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_NEAR(keyed[c] + (1 - keyed[3]) * green[c], seen[c], 2e-5F);
    }
  }
}

TEST(KeyTexel, KeysAnyScreenAsGreenWithItsChannelsExchanged) {
  const LitPlate plate = lit_plate(green);
  Keyer keyer(even_plate(16, 16), {});
  const std::array<std::array<std::size_t, 3>, 2> orders{{{0, 2, 1}, {1, 0, 2}}};  // blue, red
  for (const auto& order : orders) {
    std::array<float, 3> screen{};
    for (std::size_t c = 0; c < 3; ++c) screen[order[c]] = green[c];
    const LitPlate other = lit_plate(screen);
    for (std::uint64_t i = 0; i < 200; ++i) {
      const std::array<float, 3> seen{random(6, i), random(7, i), random(8, i)};
      std::array<float, 3> turned{};
      for (std::size_t c = 0; c < 3; ++c) turned[order[c]] = seen[c];
      // Which of the two other channels comes second makes no difference to the plain ratio.
      const auto a = key_texel(plate, plain_dials(), 3, 3, seen);
      const auto b = key_texel(other, plain_dials(), 3, 3, turned);
      ASSERT_NEAR(a[3], b[3], 1e-5F);
      for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(a[c], b[order[c]], 1e-5F);
    }
  }
}

// A third of the wall's yellow is in skin of any tone. Scene-linear, of faces.
TEST(KeyTexel, TellsSkinFromAYellowWall) {
  constexpr std::array<float, 3> wall{0.35F, 0.4F, 0.02F};
  capture::Image light = capture::make_image(32, 32);
  for (std::size_t i = 0; i < light.pixels.size(); ++i) light.pixels[i] = wall[i % 3];
  const std::vector<capture::Image> shots(2, light);
  const Keyer keyer(average_plate(shots), {});
  const auto key = [&](const std::array<float, 3>& tone, float share) {
    std::array<float, 3> seen{};
    for (std::size_t c = 0; c < 3; ++c) seen[c] = share * tone[c] + (1 - share) * wall[c];
    return key_texel(keyer.lit(), keyer.dials(), 8, 8, seen);
  };
  constexpr std::array<std::array<float, 3>, 4> tones{{{0.88F, 0.54F, 0.38F},
                                                       {0.56F, 0.24F, 0.11F},
                                                       {0.34F, 0.19F, 0.07F},
                                                       {0.1F, 0.045F, 0.026F}}};
  for (const std::array<float, 3>& tone : tones) {
    for (const float exposure : {0.5F, 1.0F}) {
      const std::array<float, 3> lit{tone[0] * exposure, tone[1] * exposure, tone[2] * exposure};
      const auto whole = key(lit, 1), half = key(lit, 0.5F);
      EXPECT_GT(whole[3], 0.97F) << tone[0] << " at " << exposure;
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(whole[c], lit[c], 0.1F * lit[0]) << c;
      // Of what is half the wall nothing stays more yellow than skin is.
      EXPECT_GT(half[3], 0.35F) << tone[0] << " at " << exposure;
      EXPECT_LE(std::min(half[0], half[1]) - half[2], half[0] - half[1] + 1e-5F);
    }
  }
  EXPECT_EQ(key(wall, 1)[3], 0);
}

// Before green and blue: what is likely to be spill on dark skin is a share of it.
TEST(KeyTexel, LeavesDarkSkinItsColour) {
  constexpr std::array<float, 3> skins[] = {{0.04F, 0.022F, 0.015F},
                                            {0.08F, 0.045F, 0.03F},
                                            {0.15F, 0.085F, 0.055F},
                                            {0.25F, 0.15F, 0.1F}};
  constexpr std::array<float, 3> screens[] = {green, {0.05F, 0.3F, 0.07F}, {0.03F, 0.08F, 0.4F}};
  for (const auto& screen : screens) {
    const Keyer keyer(even_plate(8, 16, screen), {});
    for (const auto& skin : skins) {
      for (const float shade : {1.0F, 0.6F}) {
        const std::array<float, 3> seen{shade * skin[0], shade * skin[1], shade * skin[2]};
        const auto keyed = key_texel(keyer.lit(), keyer.dials(), 2, 4, seen);
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_GE(keyed[c], 0.9F * seen[c]) << "skin " << skin[0] << " channel " << c;
        }
      }
    }
  }
}

// What has more of the screen's light than skin loses it, and so does what is redder.
TEST(KeyTexel, TakesSpillFromHairAndRedCloth) {
  const LitPlate plate = lit_plate(green);
  for (const std::array<float, 3>& own : {std::array{0.012F, 0.010F, 0.009F},
                                          {0.10F, 0.056F, 0.03F},
                                          {0.22F, 0.03F, 0.03F},
                                          {0.05F, 0.06F, 0.09F},
                                          {0.75F, 0.75F, 0.73F}}) {
    for (const float spill : {0.02F, 0.05F}) {
      std::array<float, 3> seen{};
      for (std::size_t c = 0; c < 3; ++c) seen[c] = own[c] + spill * green[c];
      KeyedTexel<float> bounded =
          foreground_of<false, float>({seen[1], seen[0], seen[2]}, {green[1], green[0], green[2]},
                                      {1, spill}, {.skin = skin_before(ScreenColour::green)});
      EXPECT_NEAR(bounded.first, own[1], 0.15F * own[1] + 0.1F * spill * green[1]) << own[0];
    }
  }
}

TEST(KeyTexel, FilteredFirstOrLastIsTheSameAwayFromClamps) {
  const LitPlate plate = lit_plate(green);
  for (std::uint64_t i = 0; i < 300; ++i) {
    std::array<float, 3> mean{};
    std::array<float, 4> of_means{};
    for (std::uint64_t k = 0; k < 4; ++k) {
      const float alpha = 0.2F + 0.6F * random(9, 4 * i + k),
                  grey = 0.3F + 0.5F * random(10, 4 * i + k);
      std::array<float, 3> seen{};
      for (std::size_t c = 0; c < 3; ++c) {
        seen[c] = alpha * grey + (1 - alpha) * green[c];
        mean[c] += seen[c] / 4;
      }
      const auto keyed = key_texel(plate, plain_dials(), 3, 3, seen);
      for (std::size_t c = 0; c < 4; ++c) of_means[c] += keyed[c] / 4;
    }
    const auto keyed = key_texel(plate, plain_dials(), 3, 3, mean);
    for (std::size_t c = 0; c < 4; ++c) ASSERT_NEAR(keyed[c], of_means[c], 1e-5F);
  }
}

TEST(KeyTexel, OfEightAtATimeIsTheOneOfEach) {
  Keyer keyer(even_plate(16, 16), {});
  const LitPlate& plate = keyer.lit();
  for (std::uint64_t i = 0; i < 200; ++i) {
    std::array<F8, 3> c{}, p{};
    for (int lane = 0; lane < key_lanes; ++lane) {
      for (std::size_t k = 0; k < 3; ++k) {
        c[k][lane] = random(20 + k, 8 * i + static_cast<std::uint64_t>(lane));
        p[k][lane] = plate.cell(0, 0)[k];
      }
    }
    const auto matte = matte_of<false>(c, p, all_of(plate.cell(0, 0)[3]), all_of(1), keyer.dials());
    const auto eight = foreground_of<false>(c, p, matte, keyer.dials());
    for (int lane = 0; lane < key_lanes; ++lane) {
      const auto one = key_texel(plate, keyer.dials(), 0, 0, {c[1][lane], c[0][lane], c[2][lane]});
      ASSERT_NEAR(eight.alpha[lane], one[3], 1e-6F);
      ASSERT_NEAR(eight.first[lane], one[1], 1e-6F);
      ASSERT_NEAR(eight.second[lane], one[0], 1e-6F);
      ASSERT_NEAR(eight.third[lane], one[2], 1e-6F);
    }
  }
}

TEST(KeyTexel, IsOpaqueWhereThePlateShowsNoScreen) {
  const LitPlate plate = lit_plate({0.3F, 0.3F, 0.3F});
  const auto keyed = key_texel(plate, {}, 3, 3, {0.1F, 0.5F, 0.2F});
  EXPECT_EQ(keyed[3], 1);
  EXPECT_FLOAT_EQ(keyed[1], 0.5F);
}

Image keyed_picture(Keyer& keyer, const Image& frame) {
  HalfImage keyed;
  keyer.key(frame, keyed);
  return to_float(keyed);
}

TEST(Keyer, ClearsTheEmptyScreenOfAnySizeAndKeepsAGreyPerson) {
  for (const int width : {16, 17, 23, 31, 96}) {
    Keyer keyer(even_plate(19, width), {});
    for (const float value : keyed_picture(keyer, even_picture(19, width, green)).pixels) {
      ASSERT_EQ(value, 0);
    }
    const Image grey = keyed_picture(keyer, even_picture(19, width, {0.25F, 0.25F, 0.25F}));
    for (std::size_t i = 3; i < grey.pixels.size(); i += 4)
      ASSERT_GT(grey.pixels[i], 0.7F) << width;
  }
}

TEST(Keyer, OfCodesIsTheOneOfTheirLight) {
  const MadeClip clip(made_scene("plain"), 4, 101, 163);
  const MadeFrame made = clip.frame(9);
  const Image shot = light_of(clip.plate_shot(0));
  std::vector<std::uint8_t> rgba;
  for (std::size_t i = 0; i < made.seen.codes.size(); i += 3) {
    rgba.insert(rgba.end(),
                {made.seen.codes[i], made.seen.codes[i + 1], made.seen.codes[i + 2], 9});
  }
  Keyer a(average_plate({&shot, 1}), {}), b(average_plate({&shot, 1}), {});
  HalfImage keyed;
  a.key(CodedFrame{101, 163, rgba, capture::Transfer::srgb}, keyed);
  const Image of_codes = to_float(keyed);
  const Image of_light = keyed_picture(b, light_of(made.seen));
  double off = 0;
  for (std::size_t i = 0; i < of_codes.pixels.size(); ++i) {
    // A block that is screen at a glance loses what is next to nothing.
    ASSERT_NEAR(of_codes.pixels[i], of_light.pixels[i], 0.13F) << i;
    off += std::abs(of_codes.pixels[i] - of_light.pixels[i]);
  }
  EXPECT_LT(off / static_cast<double>(of_codes.pixels.size()), 1e-3);
}

TEST(Keyer, NeverGivesThePersonWhatGarbageMasksCoverAndAlwaysWhatCoreMasksDo) {
  const Image grey = even_picture(16, 24, {0.4F, 0.4F, 0.4F});
  KeyMasks masks;
  masks.garbage.assign(16 * 24, 0);
  masks.core.assign(16 * 24, 0);
  masks.garbage[5] = 255;
  masks.core[300] = 255;
  Keyer keyer(even_plate(16, 24), {}, masks);
  EXPECT_EQ(keyed_picture(keyer, grey).pixels[4 * 5 + 3], 0);
  keyer.restart();
  EXPECT_EQ(keyed_picture(keyer, even_picture(16, 24, green)).pixels[4 * 300 + 3], 1);
}

TEST(Keyer, GrowsAndShrinksEdgesByItsDial) {
  const Image half = even_picture(16, 16, {0.2F, 0.36F, 0.2F});
  std::vector<float> alphas;
  for (const float edge : {-1.0F, 0.0F, 1.0F}) {
    KeySettings settings;
    settings.edge = edge;
    Keyer keyer(even_plate(16, 16), settings);
    alphas.push_back(keyed_picture(keyer, half).pixels[3]);
  }
  EXPECT_LT(alphas[0], alphas[1] - 0.05F);
  EXPECT_LT(alphas[1], alphas[2] - 0.05F);
}

TEST(Keyer, SmoothsNoiseAndLeavesNoTrail) {
  const MadeClip clip(made_scene("walking"), 6, 135, 240);
  const Image shot = light_of(clip.plate_shot(0));
  KeySettings settings;
  Keyer smoothed(average_plate({&shot, 1}), settings);
  settings.smoothing = 0;
  Keyer plain(average_plate({&shot, 1}), settings);
  double trail = 0, bare = 0;
  for (int i = 0; i < 24; ++i) {
    const MadeFrame made = clip.frame(i);
    const Image a = keyed_picture(smoothed, light_of(made.seen)),
                b = keyed_picture(plain, light_of(made.seen));
    for (std::size_t p = 3; p < a.pixels.size(); p += 4) {
      if (made.truth.pixels[p] > 0) continue;
      trail += std::max(0.0F, a.pixels[p] - b.pixels[p]);
      bare += 1;
    }
  }
  EXPECT_LT(trail / bare, 1e-3);
}

TEST(Keyer, TakesAPersonFromAStillRoomByDifference) {
  // A room of soft patches; the person of a made clip is put before it.
  const MadeClip clip(made_scene("plain"), 6, 135, 240);
  Image room = capture::make_image(135, 240);
  for (int y = 0; y < 135; ++y) {
    for (int x = 0; x < 240; ++x) {
      const float patch = 0.25F + 0.2F * std::sin(0.13F * static_cast<float>(x)) *
                                      std::cos(0.17F * static_cast<float>(y));
      for (int c = 0; c < 3; ++c) room.at(y, x, c) = patch * (1.1F - 0.2F * static_cast<float>(c));
    }
  }
  const auto noisy = [&](const Image& image, std::uint64_t seed) {
    Image out = image;
    for (std::size_t i = 0; i < out.pixels.size(); ++i) {
      out.pixels[i] +=
          0.005F * static_cast<float>(capture::normal_deviate(capture::mixed_bits(seed, i)));
    }
    return out;
  };
  const std::vector<Image> shots{noisy(room, 1), noisy(room, 2), noisy(room, 3), noisy(room, 4)};
  KeySettings settings;
  settings.method = KeyMethod::difference;
  CleanPlate plate = average_plate(shots);
  Keyer keyer(plate, settings);
  const MadeFrame made = clip.frame(10);
  Image seen = room;
  for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
    const float* t = &made.truth.pixels[4 * (i / 3)];
    seen.pixels[i] = t[i % 3] + (1 - t[3]) * room.pixels[i];
  }
  HalfImage half;
  const KeyReport report = keyer.key(noisy(seen, 9), half);
  const Image keyed = to_float(half);
  double wrong = 0, sure = 0;
  for (std::size_t p = 3; p < keyed.pixels.size(); p += 4) {
    const float truth = made.truth.pixels[p];
    if (truth > 0.01F && truth < 0.99F) continue;
    wrong += std::abs(keyed.pixels[p] - truth) > 0.5F ? 1 : 0;
    sure += 1;
  }
  EXPECT_LT(wrong / sure, 0.05);
  EXPECT_GT(report.confidence, 0.5F);
}

// Every pixel of the room is an edge.
TEST(Keyer, FindsNobodyInAnEmptyTexturedRoomByDifference) {
  Image room = capture::make_image(90, 160);
  for (std::size_t i = 0; i < room.pixels.size(); ++i)
    room.pixels[i] = (0.1F + 0.5F * random(5, i / 3)) * (1.1F - 0.2F * static_cast<float>(i % 3));
  const auto noisy = [&](std::uint64_t seed) {
    Image out = room;
    for (std::size_t i = 0; i < out.pixels.size(); ++i) {
      out.pixels[i] +=
          0.005F * static_cast<float>(capture::normal_deviate(capture::mixed_bits(seed, i)));
    }
    return out;
  };
  const std::vector<Image> shots{noisy(1), noisy(2), noisy(3), noisy(4)};
  KeySettings settings;
  settings.method = KeyMethod::difference;
  Keyer keyer(average_plate(shots), settings);
  HalfImage half;
  const KeyReport report = keyer.key(noisy(9), half);
  const Image keyed = to_float(half);
  double person = 0;
  for (std::size_t p = 3; p < keyed.pixels.size(); p += 4) person += keyed.pixels[p];
  EXPECT_LT(4 * person / static_cast<double>(keyed.pixels.size()), 1e-3);
  EXPECT_GT(report.confidence, 0.9F) << name_of(report.status);
}

// The poster's blue stands out most, but the walls have hardly any.
TEST(Keyer, FollowsTheWallsAndNoPosterByDifference) {
  Image room = capture::make_image(90, 160);
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 160; ++x) {
      const bool poster = x > 20 && x < 60 && y > 20 && y < 60;
      const std::array<float, 3> light =
          poster ? std::array{0.02F, 0.04F, 0.6F} : std::array{0.4F, 0.2F, 0.05F};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto i = static_cast<std::uint64_t>(room.index(y, x, static_cast<int>(c)));
        const auto noise = static_cast<float>(capture::normal_deviate(capture::mixed_bits(3, i)));
        room.pixels[i] = light[c] + 0.005F * noise;
      }
    }
  }
  KeySettings settings;
  settings.method = KeyMethod::difference;
  Keyer keyer(average_plate({&room, 1}), settings);
  HalfImage half;
  for (float& light : room.pixels) light *= 0.8F;
  const KeyReport report = keyer.key(room, half);
  EXPECT_NEAR(report.sight.gain, 0.8F, 0.02F);
  EXPECT_GT(report.sight.screen, 0.8F);
  EXPECT_GT(report.confidence, 0.9F) << name_of(report.status);
}

// The screen is a third of what its plate shows.
// A wall of one colour, and before it what has its colour in another light.
TEST(Keyer, TakesClothesOfTheWallsColourFromItByDifference) {
  constexpr int height = 96, width = 160;
  const auto picture = [&](float light, float clothes, std::uint64_t seed) {
    Image image = capture::make_image(height, width);
    constexpr std::array wall{0.5F, 0.42F, 0.3F};
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const std::size_t x = i / 3 % width, y = i / 3 / width;
      const bool stands = clothes != 1 && x >= 48 && x < 112 && y >= 16;
      image.pixels[i] =
          light * (stands ? clothes : 1) * wall[i % 3] +
          0.003F * static_cast<float>(capture::normal_deviate(capture::mixed_bits(seed, i)));
    }
    return image;
  };
  const std::vector<Image> shots{picture(1, 1, 1), picture(1, 1, 2), picture(1, 1, 3)};
  KeySettings settings;
  settings.method = KeyMethod::difference;
  for (const float clothes : {0.25F, 0.4F, 1.9F}) {
    Keyer keyer(average_plate(shots), settings);
    const auto share_above = [&](float light, float worn, std::uint64_t seed) {
      const Image keyed = keyed_picture(keyer, picture(light, worn, seed));
      float inside = 0, outside = 0;
      for (int y = 24; y < height; ++y) {
        for (int x = 56; x < 104; ++x) inside += keyed.at(y, x, 3) / (48 * (height - 24));
      }
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < 32; ++x) outside += keyed.at(y, x, 3) / (32 * height);
      }
      return std::array{inside, outside};
    };
    for (const float light : {1.0F, 1.1F, 0.95F, 0.5F, 0.5F}) {  // lamps that go half out at once
      const auto [inside, outside] = share_above(light, clothes, 7);
      // Of dim light, noise is the larger part, and the ramp of alpha is in its units.
      EXPECT_GT(inside, light > 0.9F ? 0.95F : 0.3F) << clothes << " " << light;
      EXPECT_LT(outside, 0.02F) << clothes << " " << light;
    }
    const auto [nobody, bare] = share_above(0.5F, 1, 9);
    EXPECT_LT(nobody, 0.02F);
    EXPECT_LT(bare, 0.02F);
  }
}

// Of dim light the noise is a larger part: what is bare stays so, as with a plate that was taken in
// that light.
TEST(Keyer, KnowsThatNoiseIsMoreOfDimmerLight) {
  constexpr int height = 135, width = 240;
  const auto picture = [&](float light, std::uint64_t seed) {
    Image image = capture::make_image(height, width);
    constexpr std::array screen{0.03F, 0.3F, 0.05F};
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const float mean = light * screen[i % 3], sigma = std::sqrt(2e-5F + 1e-4F * mean);
      const auto noise = static_cast<float>(capture::normal_deviate(capture::mixed_bits(seed, i)));
      image.pixels[i] = std::max(mean + sigma * noise, 0.0F);
    }
    return image;
  };
  const auto plate_at = [&](float light) {
    std::vector<Image> shots;
    for (std::uint64_t i = 1; i <= 8; ++i) shots.push_back(picture(light, i));
    return average_plate(shots);
  };
  for (const KeyEffort effort : {KeyEffort::full, KeyEffort::quick}) {
    KeySettings settings;
    settings.effort = effort;
    const auto haze = [&](float plate_light) {
      Keyer keyer(plate_at(plate_light), settings);
      Image keyed;
      for (std::uint64_t i = 20; i < 23; ++i) keyed = keyed_picture(keyer, picture(0.5F, i));
      float above = 0;
      for (std::size_t i = 3; i < keyed.pixels.size(); i += 4) above += keyed.pixels[i] > 0;
      return above / (height * width);
    };
    EXPECT_LT(haze(1), 2 * haze(0.5F) + 0.01F);
  }
}

TEST(Keyer, KeysBeforeAScreenThatIsTheLesserPartOfThePicture) {
  Image room = even_picture(64, 192, {0.5F, 0.4F, 0.3F});
  const auto fill = [](Image& image, int left, int right, std::array<float, 3> light) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = left; x < right; ++x) {
        for (std::size_t c = 0; c < 3; ++c) image.at(y, x, static_cast<int>(c)) = light[c];
      }
    }
  };
  fill(room, 64, 128, green);
  Keyer keyer(average_plate({&room, 1}), {});
  fill(room, 88, 104, {0.3F, 0.3F, 0.3F});
  HalfImage half;
  const KeyReport report = keyer.key(room, half);
  const Image keyed = to_float(half);
  EXPECT_EQ(keyed.at(32, 76, 3), 0);
  EXPECT_EQ(keyed.at(32, 96, 3), 1);
  EXPECT_GT(report.confidence, 0.9F) << name_of(report.status);
}

TEST(KeyTable, IsWhatItsMakerLearnsFromTheSameClips) {
  if (!PLATELIGHT_FULL_TESTS) GTEST_SKIP() << "takes a minute: tests/run.sh --full";
  const TableCodes learned = train_key_table(training_seeds);
  const TableCodes& shipped = shipped_key_table();
  for (std::size_t i = 0; i < learned.near.size(); ++i) {
    ASSERT_NEAR(learned.near[i], shipped.near[i], 2) << i;
    ASSERT_NEAR(learned.deep[i], shipped.deep[i], 2) << i;
  }
}

TEST(Keyer, SeesTheScreenInTheSmallestPictures) {
  for (const int height : {1, 2, 3, 9}) {
    for (const int width : {1, 2, 3, 9}) {
      Keyer keyer(even_plate(height, width), {});
      HalfImage keyed;
      EXPECT_EQ(keyer.key(even_picture(height, width, green), keyed).status, KeyStatus::good)
          << width << "x" << height;
    }
  }
}

TEST(Keyer, RefusesWhatDoesNotFitNamingBoth) {
  Keyer keyer(even_plate(16, 24), {});
  HalfImage keyed;
  EXPECT_THAT([&] { keyer.key(even_picture(20, 30, green), keyed); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("24x16, the frame 30x20")));
  const std::vector<std::uint8_t> few(8);
  EXPECT_THROW(keyer.key(CodedFrame{16, 24, few, capture::Transfer::srgb}, keyed),
               std::invalid_argument);
  KeyMasks masks;
  masks.garbage.resize(7);
  EXPECT_THROW(Keyer(even_plate(16, 24), {}, masks), std::invalid_argument);
  EXPECT_THROW(Keyer(CleanPlate{}, {}), std::invalid_argument);
  KeySettings settings;
  settings.core = 0.005F;
  EXPECT_THROW(Keyer(even_plate(16, 24), settings), std::invalid_argument);
  settings = {};
  settings.edge = std::nanf("");
  EXPECT_THROW(Keyer(even_plate(16, 24), settings), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::keyer_test
