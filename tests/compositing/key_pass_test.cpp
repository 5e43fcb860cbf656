// Whole frames against their pixels one by one, and frames that remember what was written.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "capture/counter_random.h"
#include "compositing/background_subtraction.h"
#include "compositing/keyer.h"

namespace compositing::key_pass_test {
namespace {

using capture::HalfImage;
using capture::Image;

class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}
  float value() {
    return static_cast<float>(capture::uniform_high(capture::mixed_bits(seed_, ++drawn_)));
  }
  int below(int count) {
    return std::min(static_cast<int>(value() * static_cast<float>(count)), count - 1);
  }

 private:
  std::uint64_t seed_, drawn_ = 0;
};

// A screen, even or not, of any colour, here and there no number.
CleanPlate any_plate(Random& random, int height, int width) {
  CleanPlate plate;
  plate.light = capture::make_image(height, width);
  plate.colour = static_cast<ScreenColour>(random.below(6));
  const auto order = channels_of(plate.colour);
  const int kind = random.below(4);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float v = kind == 0   ? 0
                      : kind == 1 ? 0.4F + 0.1F * std::sin(0.05F * static_cast<float>(x + y))
                      : kind == 2 ? random.value()
                                  : 0.4F;
      const float pale = kind == 3 ? 0.5F : 0.15F;
      for (const auto& [c, light] : {std::pair{order[0], v},
                                     {order[1], has_two_primaries(plate.colour) ? v : pale * v},
                                     {order[2], pale * v}}) {
        plate.light.at(y, x, c) = light;
      }
    }
  }
  if (random.below(3) == 0) {
    plate.light.pixels[static_cast<std::size_t>(random.below(height * width))] =
        std::numeric_limits<float>::quiet_NaN();
  }
  return plate;
}

// The plate with noise and a patch of another colour that wanders; faults here and there.
Image any_frame(Random& random, const Image& plate, int number) {
  Image frame = plate;
  const float noise = 0.02F * random.value();
  const int left = (7 * number) % std::max(frame.width, 1), wide = 1 + frame.width / 3;
  const std::array<float, 3> person{random.value(), random.value(), random.value()};
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        float& light = frame.at(y, x, c);
        const float far = static_cast<float>(std::abs(x - left)) / static_cast<float>(wide);
        const float alpha = std::clamp(4 * (1 - far), 0.0F, 1.0F);
        light += alpha * (person[static_cast<std::size_t>(c)] - light);
        light *= 1 + noise * (random.value() - 0.5F);
      }
    }
  }
  const auto fault = [&](float value) {
    frame.pixels[static_cast<std::size_t>(random.below(static_cast<int>(frame.pixels.size())))] =
        value;
  };
  if (random.below(3) == 0) fault(std::numeric_limits<float>::quiet_NaN());
  if (random.below(3) == 0) fault(std::numeric_limits<float>::infinity());
  if (random.below(3) == 0) fault(-1);
  return frame;
}

std::vector<std::uint8_t> codes_of(const Image& frame) {
  std::vector<std::uint8_t> codes;
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
    const float v = frame.pixels[i];
    codes.push_back(
        v > 0 && v < 1e9F ? static_cast<std::uint8_t>(255 * std::sqrt(std::min(v, 1.0F))) : 0);
    if (i % 3 == 2) codes.push_back(static_cast<std::uint8_t>(i));
  }
  return codes;
}

KeySettings any_settings(Random& random) {
  KeySettings settings;
  settings.method = random.below(4) == 0 ? KeyMethod::difference : KeyMethod::screen;
  settings.learned = random.below(4) != 0;
  settings.follows_light = random.below(4) != 0;
  settings.smoothing = random.below(4) == 0 ? 0 : 1;
  if (random.below(3) == 0) settings.core = 0.6F, settings.despill = 2, settings.edge = 0.4F;
  if (random.below(3) == 0) settings.despill = 0.5F;
  if (random.below(2) == 0) settings.effort = KeyEffort::quick;
  return settings;
}

KeyMasks any_masks(Random& random, std::size_t pixels) {
  KeyMasks masks;
  const auto fill = [&](std::vector<std::uint8_t>& mask) {
    for (std::size_t i = 0; i < pixels; ++i)
      mask.push_back((i / 13) % 5 == 0 ? static_cast<std::uint8_t>(random.below(256)) : 0);
  };
  if (random.below(3) == 0) fill(masks.garbage);
  if (random.below(4) == 0) fill(masks.core);
  return masks;
}

TEST(KeyPass, IsTheFormulaOfEachPixelByItself) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed);
    const int height = 1 + random.below(40), width = 1 + random.below(70);
    const CleanPlate plate = any_plate(random, height, width);
    KeySettings settings = any_settings(random);
    settings.smoothing = 0;
    settings.effort = KeyEffort::full;
    KeyMasks masks;
    masks.core.assign(static_cast<std::size_t>(height * width), 0);  // no glances
    Keyer keyer(plate, settings, masks);
    KeyedFrame keyed;
    for (int number = 0; number < 3; ++number) {
      const Image frame = any_frame(random, plate.light, number);
      keyer.key(frame, keyed);
      const auto order = channels_of(keyer.lit().colour);
      const KeyDials& dials = keyer.dials();
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const auto cell = plate_at(keyer.lit(), y, x);
          const std::array<float, 3> p{cell[0], cell[1], cell[2]};
          std::array<float, 3> c{};
          for (std::size_t i = 0; i < 3; ++i) {
            const float light = frame.at(y, x, order[i]);
            c[i] = light > 0 && light < 1e9F ? light : 0;
          }
          const float near = keyer.lit().near.at(y, x);
          KeyedTexel<float> one{};
          if (settings.method == KeyMethod::difference) {
            one = foreground_of<true>(c, p, difference_matte(c, p, cell[3], dials),
                                      KeyDials{.despill = 0});
          } else if (has_two_primaries(plate.colour)) {
            const auto matte = matte_of<true>(c, p, cell[3], near, dials);
            one = foreground_of<true>(c, p, matte, dials);
          } else {
            const auto matte = matte_of<false>(c, p, cell[3], near, dials);
            one = foreground_of<false>(c, p, matte, dials);
          }
          // Four roundings of the plate, and one to half.
          const auto at = [&](int channel) {
            return capture::float_from_half(
                keyed.image().pixels[keyed.image().index(y, x, channel)]);
          };
          ASSERT_NEAR(at(3), one.alpha, 2e-3F) << seed << " " << y << " " << x;
          ASSERT_NEAR(at(order[0]), one.first, 2e-3F);
          ASSERT_NEAR(at(order[1]), one.second, 2e-3F);
          ASSERT_NEAR(at(order[2]), one.third, 2e-3F);
        }
      }
    }
  }
}

// A keyer that is given frames which were another's, older, copied or moved from, against one that
// writes every pixel.
TEST(KeyedFrame, IsTheWholePictureWhoeverHadItBefore) {
  std::vector<KeyedFrame> frames(3);
  for (std::uint64_t seed = 100; seed < 160; ++seed) {
    Random random(seed);
    const bool large = random.below(5) == 0;
    const int height = large ? 130 : 1 + random.below(40),
              width = large ? 200 : 1 + random.below(70);
    const CleanPlate plate = any_plate(random, height, width);
    const KeySettings settings = any_settings(random);
    const KeyMasks masks = any_masks(random, static_cast<std::size_t>(height * width));
    Keyer keyer(plate, settings, masks), twin(plate, settings, masks);
    HalfImage whole;
    for (int number = 0; number < 8; ++number) {
      const Image frame = any_frame(random, plate.light, number);
      if (random.below(3) == 0)
        std::swap(frames[0], frames[static_cast<std::size_t>(random.below(3))]);
      if (random.below(5) == 0) frames[1] = frames[0];
      if (random.below(5) == 0) frames[2] = std::move(frames[0]);
      if (random.below(5) == 0) keyer.restart(), twin.restart();
      // What was in a picture that others may write does not matter either.
      if (random.below(3) == 0)
        std::fill(whole.pixels.begin(), whole.pixels.end(), capture::Half{0x3555});
      KeyReport a, b;
      if (random.below(2) == 0) {
        a = keyer.key(frame, frames[0]), b = twin.key(frame, whole);
      } else {
        const auto codes = codes_of(frame);
        const CodedFrame coded{height, width, codes, capture::Transfer::srgb};
        a = keyer.key(coded, frames[0]), b = twin.key(coded, whole);
      }
      ASSERT_EQ(frames[0].image().width, width);
      ASSERT_EQ(frames[0].image().pixels, whole.pixels) << "seed " << seed << ", frame " << number;
      ASSERT_EQ(a.soft, b.soft);
      for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
        const float value = capture::float_from_half(whole.pixels[i]);
        ASSERT_TRUE(value >= 0 && value <= (i % 4 == 3 ? 1 : capture::half_max)) << value;
      }
    }
  }
}

TEST(Keyer, ThatWasRestartedKeysAsANewOne) {
  for (std::uint64_t seed = 200; seed < 220; ++seed) {
    Random random(seed);
    const CleanPlate plate = any_plate(random, 37, 61);
    KeySettings settings = any_settings(random);
    settings.follows_light = false;
    Keyer used(plate, settings), fresh(plate, settings);
    HalfImage a, b;
    for (int number = 0; number < 4; ++number) used.key(any_frame(random, plate.light, number), a);
    used.restart();
    for (int number = 4; number < 7; ++number) {
      const Image frame = any_frame(random, plate.light, number);
      used.key(frame, a), fresh.key(frame, b);
      ASSERT_EQ(a.pixels, b.pixels) << seed;
    }
  }
}

TEST(Keyer, LeavesNothingOfAPersonWhoHasLeft) {
  Random random(300);
  CleanPlate plate;
  plate.light = capture::make_image(40, 64);
  for (std::size_t i = 0; i < plate.light.pixels.size(); ++i)
    plate.light.pixels[i] = std::array{0.035F, 0.4F, 0.06F}[i % 3];
  Keyer keyer(plate, {});
  KeyedFrame keyed;
  Image person = plate.light;
  for (int y = 5; y < 30; ++y) {
    for (int x = 11; x < 43; ++x) {
      for (int c = 0; c < 3; ++c) person.at(y, x, c) = 0.3F;
    }
  }
  for (int i = 0; i < 3; ++i) keyer.key(person, keyed);
  for (int i = 0; i < 3; ++i) keyer.key(plate.light, keyed);
  for (const capture::Half half : keyed.image().pixels) ASSERT_EQ(half, 0);
}

}  // namespace
}  // namespace compositing::key_pass_test
