// The noise that plates know, of shots and of footage, and keys that go by it.
#include "compositing/plate_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "capture/counter_random.h"
#include "compositing/keyer.h"
#include "compositing/made_clip.h"
#include "compositing/plate_footage.h"

namespace compositing::plate_noise_test {
namespace {

using capture::Image;

Image even_picture(int height, int width, std::array<float, 3> light) {
  Image image = capture::make_image(height, width);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = light[i % 3];
  return image;
}

std::vector<Image> shots_of(const MadeClip& clip) {
  std::vector<Image> shots;
  for (int i = 0; i < 6; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  return shots;
}

double sigma_of(const CleanPlate& plate, double light) {
  return std::sqrt(plate.noise_gain * light + plate.noise_floor);
}

PlateFootage footage_of(const MadeClip& clip, int count) {
  PlateFootage footage;
  for (int i = 0; i < count; ++i) footage.add(light_of(clip.frame(4 * i).seen));
  return footage;
}

// Somebody walks, the lamps flicker, cloth is wrinkled: none of it is noise.
TEST(PlateFootage, MeasuresTheNoiseBehindAPersonAsShotsDo) {
  for (const char* name : {"noise", "walking", "wrinkled", "lamp flicker", "blue screen"}) {
    const MadeClip clip(made_scene(name), 4, 135, 240);
    const CleanPlate shots = average_plate(shots_of(clip));
    const CleanPlate footage = footage_of(clip, 8).screen();
    EXPECT_TRUE(footage.knows_noise) << name;
    for (const double light : {0.06, 0.4}) {
      EXPECT_NEAR(sigma_of(footage, light) / sigma_of(shots, light), 1, 0.1) << name << light;
    }
  }
}

TEST(PlateFootage, MeasuresTheNoiseOfOnePictureByItsGrain) {
  for (const char* name : {"noise", "walking", "wrinkled", "studio"}) {
    const MadeClip clip(made_scene(name), 4, 270, 480);
    const CleanPlate shots = average_plate(shots_of(clip));
    const CleanPlate footage = footage_of(clip, 1).screen();
    EXPECT_TRUE(footage.knows_noise) << name;
    EXPECT_NEAR(sigma_of(footage, 0.4) / sigma_of(shots, 0.4), 1, 0.15) << name;
  }
}

TEST(PlateFootage, MeasuresTheNoiseOfAnyStillBackground) {
  const MadeClip clip(made_scene("noise"), 4, 135, 240);
  const Image texture = light_of(clip.frame(0).seen);
  PlateFootage footage;
  for (std::uint64_t i = 0; i < 9; ++i) {
    Image frame = texture;
    for (std::size_t k = 0; k < frame.pixels.size(); ++k) {
      // A bar that passes, on light with noise of half a hundredth.
      const std::size_t x = k / 3 % 240;
      const double noise = capture::uniform_high(capture::mixed_bits(i, k)) - 0.5;
      frame.pixels[k] = x / 30 == i ? 0.7F : 0.2F + 0.3F * texture.pixels[k];
      frame.pixels[k] += static_cast<float>(0.005 * std::sqrt(12.0) * noise);
    }
    footage.add(frame);
  }
  const CleanPlate plate = footage.background();
  EXPECT_TRUE(plate.knows_noise);
  EXPECT_NEAR(sigma_of(plate, 0.0), 0.005, 5e-4);
}

// A codec's pictures, and a screen that is clipped, hide their noise.
TEST(PlateFootage, TakesAGoodCamerasNoiseWhereNoneShows) {
  PlateFootage still, clipped;
  for (int i = 0; i < 4; ++i) {
    still.add(even_picture(64, 96, {0.04F, 0.4F, 0.06F}));
    Image frame = even_picture(64, 96, {0.04F, 1, 0.06F});
    for (std::size_t k = 0; k < frame.pixels.size(); k += 3) {
      frame.pixels[k] +=
          static_cast<float>(0.03 * capture::uniform_high(capture::mixed_bits(i, k)));
    }
    clipped.add(frame);
  }
  for (const CleanPlate& plate : {still.screen(), clipped.screen(), still.background()}) {
    EXPECT_FALSE(plate.knows_noise);
    EXPECT_EQ(plate.noise_gain, CleanPlate{}.noise_gain);
    EXPECT_EQ(plate.noise_floor, CleanPlate{}.noise_floor);
  }
}

// Codes with noise of so many.
Image grainy(MadePicture picture, double sigma_codes, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  for (std::uint8_t& code : picture.codes) {
    const double value = std::round(code + sigma_codes * noise(random));
    code = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
  }
  return light_of(picture);
}

struct BareScreen {
  double alpha = 0, hazy = 0;  // mean; share above .05
  float confidence = 0;        // mean
};

BareScreen key_bare(const CleanPlate& plate,
                    const std::vector<Image>& frames,
                    const std::vector<Image>& truths) {
  Keyer keyer(plate, {});
  capture::HalfImage half;
  BareScreen bare;
  double count = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    bare.confidence += keyer.key(frames[f], half).confidence / static_cast<float>(frames.size());
    const Image keyed = to_float(half);
    for (std::size_t i = 3; i < keyed.pixels.size(); i += 4) {
      if (truths[f].pixels[i] >= 0.001F) continue;
      bare.alpha += keyed.pixels[i], bare.hazy += keyed.pixels[i] > 0.05F, count += 1;
    }
  }
  bare.alpha /= count, bare.hazy /= count;
  return bare;
}

TEST(PlateFootage, MakesKeysAsClearAndAsSureAsShotsDoWhateverTheNoise) {
  MadeScene scene = made_scene("plain");
  scene.noise_gain = scene.noise_floor = 0;
  const MadeClip clip(scene, 4);
  std::vector<MadeFrame> made;
  std::vector<Image> truths;
  for (int i = 0; i < 24; ++i) {
    made.push_back(clip.frame(i));
    truths.push_back(made.back().truth);
  }
  for (const double sigma : {0.0, 2.0, 4.0, 9.0}) {
    std::vector<Image> shots, frames;
    PlateFootage footage;
    for (int i = 0; i < 8; ++i)
      shots.push_back(grainy(clip.plate_shot(i), sigma, static_cast<std::uint32_t>(i)));
    for (std::size_t i = 0; i < made.size(); ++i) {
      frames.push_back(grainy(made[i].seen, sigma, 100 + static_cast<std::uint32_t>(i)));
      footage.add(frames.back());
    }
    const BareScreen of_shots = key_bare(average_plate(shots), frames, truths);
    const BareScreen of_footage = key_bare(footage.screen(), frames, truths);
    for (const auto& [name, bare] : {std::pair{"shots", of_shots}, {"footage", of_footage}}) {
      testing::Test::RecordProperty(name + std::to_string(static_cast<int>(sigma)),
                                    std::to_string(bare.alpha) + " hazy " +
                                        std::to_string(bare.hazy) + " confidence " +
                                        std::to_string(bare.confidence));
    }
    EXPECT_LE(of_footage.hazy, 3 * of_shots.hazy + 0.002) << sigma;
    EXPECT_NEAR(of_footage.confidence, of_shots.confidence, 0.1F) << sigma;
  }
}

}  // namespace
}  // namespace compositing::plate_noise_test
