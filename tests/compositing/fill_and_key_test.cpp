// Fill and key against the programme that they were split from, and against other plates.
#include "compositing/fill_and_key.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <stdexcept>

namespace compositing::fill_and_key_test {
namespace {

using capture::HalfImage;
using Codes = std::vector<std::uint8_t>;

constexpr int width = 61, height = 23;
constexpr std::size_t pixels = std::size_t{width} * height;

// What one pixel is made of: linear light.
struct Pixel {
  std::array<float, 3> plate{};
  float coverage = 0;
  std::array<float, 3> lost{};   // by a shadow, a share of each colour
  std::array<float, 3> light{};  // of what covers or is added
};

struct Picture {
  HalfImage plate{height, width, std::vector<capture::Half>(pixels * 3), 3};
  HalfImage rgba{height, width, std::vector<capture::Half>(pixels * 4), 4};
  HalfImage matte{height, width, std::vector<capture::Half>(pixels), 1};
};

// As the kernel has it: the matte is the mean over the colours.
template <class Make>
Picture picture_of(const Make& make) {
  Picture picture;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Pixel pixel = make(i);
    float lost = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      lost += pixel.lost[c] / 3;
      picture.plate.pixels[i * 3 + c] = capture::half_from_float(pixel.plate[c]);
      const float through = pixel.plate[c] * (1 - pixel.lost[c]);
      picture.rgba.pixels[i * 4 + c] =
          capture::half_from_float((1 - pixel.coverage) * through + pixel.light[c]);
    }
    picture.rgba.pixels[i * 4 + 3] = capture::half_from_float(pixel.coverage);
    picture.matte.pixels[i] = capture::half_from_float(1 - (1 - pixel.coverage) * (1 - lost));
  }
  return picture;
}

Codes codes_of(const Display& display, const HalfImage& image, const ToneCurve& tone = {}) {
  HalfImage rgba{height, width, std::vector<capture::Half>(pixels * 4), 4};
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < pixels; ++i) {
    std::copy_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(i * channels), 3,
                rgba.pixels.begin() + static_cast<std::ptrdiff_t>(i * 4));
  }
  Codes codes(pixels * 3);
  display.to_rgb8(rgba, codes, tone);
  return codes;
}

struct Split {
  Codes fill = Codes(pixels * 3);
  Codes key = Codes(pixels);
  std::int64_t raised = 0;
};

Split split(const std::shared_ptr<const Display>& display,
            const Picture& picture,
            const ToneCurve& tone = {}) {
  Split split;
  split.raised =
      FillAndKey(display).split(codes_of(*display, picture.rgba, tone), picture.rgba, picture.plate,
                                picture.matte, tone, split.fill, split.key);
  return split;
}

// A keyer, without any wrap or clamp that would hide a sum above 255.
int mixed(const Split& split, const Codes& plate, std::size_t i, std::size_t c) {
  const double through = (255 - split.key[i]) * plate[i * 3 + c] / 255.0;
  return split.fill[i * 3 + c] + static_cast<int>(std::lround(through));
}

std::shared_ptr<const Display> display_of(const std::string& display, const std::string& view) {
  return std::make_shared<const Display>(DisplaySettings{.display = display, .view = view});
}

float any(std::minstd_rand& random, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(random);
}

TEST(FillAndKey, MixIsTheProgrammeInEveryCodeWhateverThePictureIsAndTheDisplay) {
  struct Look {
    std::shared_ptr<const Display> display;
    ToneCurve tone;
  };
  const std::array<Look, 4> looks{{{display_of("Rec.1886", "Un-tone-mapped"), {}},
                                   {display_of("sRGB", "Un-tone-mapped"), {}},
                                   {display_of("sRGB", "ACES SDR"), {}},
                                   {display_of("Rec.1886", "Un-tone-mapped"), {3, 8}}}};
  std::minstd_rand random(1);
  for (const Look& look : looks) {
    const Picture picture = picture_of([&](std::size_t i) {
      Pixel pixel;
      pixel.coverage = i % 3 == 0 ? any(random, 0, 1) : static_cast<float>(i % 3 - 1);
      for (std::size_t c = 0; c < 3; ++c) {
        pixel.plate[c] = any(random, -0.02F, i % 5 == 0 ? 3.0F : 0.6F);
        pixel.lost[c] = i % 4 == 0 ? 0 : any(random, -0.1F, 1);
        pixel.light[c] = i % 7 == 0 ? any(random, 0, 2) : pixel.coverage * any(random, 0, 1);
      }
      return pixel;
    });
    const Split parts = split(look.display, picture, look.tone);
    const Codes programme = codes_of(*look.display, picture.rgba, look.tone);
    const Codes plate = codes_of(*look.display, picture.plate, look.tone);
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        ASSERT_EQ(mixed(parts, plate, i, c), programme[i * 3 + c]) << i << " " << c;
      }
    }
  }
}

TEST(FillAndKey, HasNeitherFillNorKeyWhereThereIsOnlyPlate) {
  std::minstd_rand random(2);
  const Picture picture = picture_of([&](std::size_t) {
    return Pixel{{any(random, 0, 1), any(random, 0, 1), any(random, 0, 2)}, 0, {}, {}};
  });
  const Split parts = split(display_of("Rec.1886", "Un-tone-mapped"), picture);
  EXPECT_EQ(parts.fill, Codes(pixels * 3, 0));
  EXPECT_EQ(parts.key, Codes(pixels, 0));
  EXPECT_EQ(parts.raised, 0);
}

TEST(FillAndKey, KeysCoverageInCodes) {
  const Picture picture = picture_of([](std::size_t i) {
    const float coverage = static_cast<float>(i % width) / (width - 1);
    return Pixel{{0.2F, 0.3F, 0.1F}, coverage, {}, {0.3F * coverage, 0, 0.1F * coverage}};
  });
  const Split parts = split(display_of("Rec.1886", "Un-tone-mapped"), picture);
  for (std::size_t i = 0; i < width; ++i) {
    EXPECT_NEAR(parts.key[i], 255.0 * static_cast<double>(i) / (width - 1), 1) << i;
  }
}

// A keyer's plate is never quite ours: it has passed other cables. What the keyer then mixes should
// be what the show would have made of that plate.
TEST(FillAndKey, DarkensAnyPlateAsTheShadowDoes) {
  const auto display = display_of("Rec.1886", "Un-tone-mapped");
  const auto over_plate = [](float gain) {
    return picture_of([gain](std::size_t i) {
      const float lost = static_cast<float>(i % width) / (width - 1);
      const float light = 0.02F + 0.9F * static_cast<float>(i / width) / (height - 1);
      return Pixel{
          {gain * light, gain * light * 0.8F, gain * light * 0.5F}, 0, {lost, lost, lost}, {}};
    });
  };
  const Split parts = split(display, over_plate(1));
  EXPECT_LE(*std::ranges::max_element(parts.fill), 2);
  const Picture other = over_plate(0.5F);
  const Codes programme = codes_of(*display, other.rgba), plate = codes_of(*display, other.plate);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_NEAR(mixed(parts, plate, i, c), programme[i * 3 + c], 2) << i << " " << c;
    }
  }
}

TEST(FillAndKey, RaisesTheKeyWhereAShadowTakesMoreOfOneColourAndTellsWhere) {
  const Picture picture = picture_of([](std::size_t i) {
    Pixel pixel{{0.5F, 0.5F, 0.5F}, 0, {}, {}};
    if (i % 2 == 0) pixel.lost = {0.7F, 0.5F, 0.3F};
    return pixel;
  });
  const auto display = display_of("Rec.1886", "Un-tone-mapped");
  const Split parts = split(display, picture);
  EXPECT_EQ(parts.raised, static_cast<std::int64_t>((pixels + 1) / 2));
  EXPECT_EQ(parts.fill[0], 0);
  EXPECT_GT(parts.fill[2], 0);
  const double red_left = std::pow(0.3, 1 / 2.4);
  EXPECT_NEAR(parts.key[0], 255 * (1 - red_left), 1.5);
}

TEST(FillAndKey, HidesThePlateWhereTheMatteIsNoNumber) {
  Picture picture = picture_of([](std::size_t) { return Pixel{{0.4F, 0.4F, 0.4F}, 0, {}, {}}; });
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  picture.matte.pixels[0] = capture::half_from_float(nan);
  picture.matte.pixels[1] = capture::half_from_float(infinity);
  picture.matte.pixels[2] = capture::half_from_float(-infinity);
  picture.rgba.pixels[3 * 4 + 3] = capture::half_from_float(nan);
  picture.rgba.pixels[4 * 4 + 3] = capture::half_from_float(-infinity);
  picture.plate.pixels[5 * 3] = capture::half_from_float(nan);
  const auto display = display_of("Rec.1886", "Un-tone-mapped");
  const Split parts = split(display, picture);
  EXPECT_EQ(parts.key[0], 255);
  EXPECT_EQ(parts.key[1], 255);
  EXPECT_EQ(parts.key[3], 255);
  const Codes programme = codes_of(*display, picture.rgba);
  const Codes plate = codes_of(*display, picture.plate);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(mixed(parts, plate, i, 0), programme[i * 3]) << i;
}

TEST(FillAndKey, RefusesPicturesOfTwoSizesAndNoDisplay) {
  EXPECT_THROW(FillAndKey{nullptr}, std::invalid_argument);
  const auto display = display_of("Rec.1886", "Un-tone-mapped");
  FillAndKey splitter(display);
  const Picture good = picture_of([](std::size_t) { return Pixel{}; });
  const Codes programme(pixels * 3);
  Codes fill(pixels * 3), key(pixels);
  const auto refused = [&](const Codes& shown, const Picture& picture, Codes& into, Codes& under) {
    EXPECT_THROW(splitter.split(shown, picture.rgba, picture.plate, picture.matte, {}, into, under),
                 std::invalid_argument);
  };
  Codes small(pixels - 1);
  refused(small, good, fill, key);
  refused(programme, good, small, key);
  refused(programme, good, fill, small);
  Picture bad = good;
  bad.plate.width = 60;
  refused(programme, bad, fill, key);
  bad = good;
  bad.matte.pixels.pop_back();
  refused(programme, bad, fill, key);
  bad = good;
  bad.rgba.pixels.resize(pixels * 3);
  refused(programme, bad, fill, key);
}

}  // namespace
}  // namespace compositing::fill_and_key_test
