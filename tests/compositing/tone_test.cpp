// Laws of the tone curve, and how it meets the display.
#include "compositing/tone.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "compositing/display.h"

namespace compositing::tone_test {
namespace {

capture::HalfImage half_image(int height, int width) {
  capture::HalfImage image{height, width, {}, 4};
  image.pixels.resize(static_cast<std::size_t>(height * width * 4));
  return image;
}

void set_grey(capture::HalfImage& image, std::size_t pixel, float value) {
  for (std::size_t c = 0; c < 3; ++c) {
    image.pixels[pixel * 4 + c] = capture::half_from_float(value);
  }
}

// Colours of many brightnesses, some outside the gamut.
capture::HalfImage random_picture(int height, int width, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> octave(-12, 6), channel(-0.1F, 1);
  capture::HalfImage image = half_image(height, width);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const float level = std::exp2(octave(random));
    for (std::size_t c = 0; c < 3; ++c) {
      image.pixels[i + c] = capture::half_from_float(level * channel(random));
    }
  }
  return image;
}

std::vector<std::uint8_t> codes_of(const Display& display,
                                   const capture::HalfImage& image,
                                   const ToneCurve& tone = {}) {
  std::vector<std::uint8_t> codes(image.pixels.size() / 4 * 3);
  display.to_rgb8(image, codes, tone);
  return codes;
}

constexpr std::array<ToneCurve, 4> curves{{{1, 1}, {1, 8}, {3, 2}, {200, 1000}}};

TEST(ToneCurve, RisesAndKeepsBlackAndMakesTheBrightestWhite) {
  for (const ToneCurve& curve : curves) {
    EXPECT_EQ(curve(0), 0);
    EXPECT_EQ(curve(-1), 0);
    EXPECT_EQ(curve(curve.brightest), 1);
    EXPECT_EQ(curve(2 * curve.brightest), 1);
    EXPECT_EQ(curve(std::numeric_limits<float>::infinity()), 1);
    EXPECT_EQ(curve(NAN), 0);
    float before = 0;
    for (float l = 1e-6F; l < curve.brightest; l *= 1.01F) {
      ASSERT_GT(curve(l), before) << l;
      before = curve(l);
    }
    EXPECT_LE(before, 1);
    EXPECT_NEAR(curve(curve.brightest * 0.9999F), 1, 1e-3) << "no step at white";
  }
}

TEST(ToneCurve, IsOneWhoseParametersTravelOrNone) {
  for (const ToneCurve& curve : curves) EXPECT_EQ(curve_of(parameters_of(curve)), curve);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const std::array<float, 2>& bad : std::vector<std::array<float, 2>>{
           {1, 0}, {NAN, 1}, {1, NAN}, {infinity, 1}, {1, infinity}, {0, 1}, {1, -1}}) {
    EXPECT_FALSE(curve_of(bad).is_on());
  }
}

TEST(ApplyTone, ChangesNothingBelowWhiteWherePIsOneAndWhiteIsTheBrightest) {
  const Display display;
  capture::HalfImage greys = half_image(1, 256);
  for (std::size_t i = 0; i < 256; ++i) set_grey(greys, i, static_cast<float>(i) / 255);
  EXPECT_EQ(codes_of(display, greys, {1, 1}), codes_of(display, greys));
}

TEST(ApplyTone, ShowsBlackAndWhiteInEveryView) {
  capture::HalfImage image = half_image(1, 3);
  set_grey(image, 1, 8);
  set_grey(image, 2, 60000);
  const Display display;
  const std::vector<std::uint8_t> codes = codes_of(display, image, {3, 8});
  for (const std::size_t i : {0, 1, 2}) EXPECT_EQ(codes[i], 0);
  for (const std::size_t i : {3, 4, 5, 6, 7, 8}) EXPECT_EQ(codes[i], 255);
}

TEST(ApplyTone, KeepsColours) {
  const capture::HalfImage image = random_picture(20, 20, 1);
  for (const ToneCurve& curve : curves) {
    std::vector<capture::Half> toned(image.pixels.size());
    apply_tone(curve, image.pixels, toned);
    for (std::size_t i = 0; i < toned.size(); i += 4) {
      const auto at = [](const std::vector<capture::Half>& from, std::size_t k) {
        return capture::float_from_half(from[k]);
      };
      const float before = at(image.pixels, i) * at(toned, i + 1);
      const float after = at(image.pixels, i + 1) * at(toned, i);
      ASSERT_NEAR(before, after, 2e-3F * (std::abs(before) + 1e-6F)) << i;
    }
  }
}

TEST(ApplyTone, GivesTheSameCodesWholeAndInTiles) {
  const capture::HalfImage image = random_picture(31, 37, 2);
  for (const char* view : {"Un-tone-mapped", "ACES SDR"}) {
    const Display display({.view = view});
    const ToneCurve curve{3, 5};
    const std::vector<std::uint8_t> whole = codes_of(display, image, curve);
    EXPECT_NE(whole, codes_of(display, image));
    std::vector<std::uint8_t> tiles(whole.size());
    const std::span<const capture::Half> pixels(image.pixels);
    for (std::size_t first = 0; first < whole.size() / 3; first += 77) {
      const std::size_t length = std::min<std::size_t>(77, whole.size() / 3 - first);
      display.to_rgb8(pixels.subspan(first * 4, length * 4),
                      std::span(tiles).subspan(first * 3, length * 3), curve);
    }
    EXPECT_EQ(tiles, whole);
  }
}

TEST(ApplyTone, LeavesNanToTheDisplayAndShowsInfinityWhite) {
  capture::HalfImage image = half_image(1, 3);
  for (std::size_t c = 0; c < 3; ++c) image.pixels[c] = 0x7e00, image.pixels[4 + c] = 0x7c00;
  image.pixels[8] = 0xfc00;  // -infinity
  std::vector<std::uint8_t> codes(9, 99);
  EXPECT_EQ(Display().to_rgb8(image, codes, {3, 8}), 1);
  EXPECT_EQ(codes, (std::vector<std::uint8_t>{0, 0, 0, 255, 255, 255, 0, 0, 0}));
}

TEST(MeasureLevels, FindsThemWhateverTheThreads) {
  capture::HalfImage image = half_image(100, 200);
  for (std::size_t i = 0; i < 20000; ++i) {
    set_grey(image, i, std::exp2(8 * (static_cast<float>(i * 7919 % 20000) + 0.5F) / 20000 - 4));
  }
  const auto levels = measure_levels(image);
  ASSERT_TRUE(levels);
  EXPECT_NEAR(levels->darkest / std::exp2(-4 + 0.08), 1, 0.01);
  EXPECT_NEAR(levels->middle, 1, 0.01);
  EXPECT_NEAR(levels->brightest / std::exp2(4 - 0.008), 1, 0.01);
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto again = measure_levels(image);
    EXPECT_EQ(again->darkest, levels->darkest);
    EXPECT_EQ(again->middle, levels->middle);
    EXPECT_EQ(again->brightest, levels->brightest);
  }
}

TEST(MeasureLevels, PassesOverBlackAndWhatIsNoNumber) {
  capture::HalfImage image = half_image(10, 10);
  EXPECT_FALSE(measure_levels(image));
  EXPECT_FALSE(measure_levels(capture::HalfImage{}));
  for (std::size_t c = 0; c < 3; ++c) image.pixels[c] = 0x7e00;
  EXPECT_FALSE(measure_levels(image));
  set_grey(image, 5, 0.25F);
  EXPECT_NEAR(measure_levels(image)->middle, 0.25, 0.01);
  for (std::size_t c = 0; c < 3; ++c) image.pixels[4 + c] = 0x7c00;
  EXPECT_TRUE(std::isfinite(measure_levels(image)->brightest));
}

// As skies are that a camera has clipped.
TEST(CurveFor, LeavesAPictureOfWhichMuchIsJustWhite) {
  capture::HalfImage picture = half_image(10, 100);
  for (std::size_t i = 0; i < 1000; ++i) {
    set_grey(picture, i, i < 250 ? 1.0F : 0.1F + 0.0008F * static_cast<float>(i));
  }
  const ToneCurve curve = curve_for(*measure_levels(picture));
  EXPECT_FLOAT_EQ(curve.brightest, 1);
  EXPECT_FLOAT_EQ(curve.p, 1);
}

TEST(CurveFor, LeavesAPictureWithoutAnythingBrighterThanWhite) {
  EXPECT_EQ(curve_for({0.01F, 0.2F, 0.9F}), (ToneCurve{1, 1}));
  EXPECT_EQ(curve_for({0.01F, 0.2F, 1.0F}), (ToneCurve{1, 1}));
}

TEST(CurveFor, PutsTheBrightestAtWhiteAndTheMiddleAtTheKey) {
  for (const float brightest : {2.0F, 20.0F, 200.0F}) {
    const PictureLevels levels{0.02F, 0.3F, brightest};
    EXPECT_EQ(curve_for(levels).brightest, brightest);
    EXPECT_NEAR(curve_for(levels)(0.3F), 0.3F, 1e-4) << "kept without a key";
    EXPECT_NEAR(curve_for(levels, 0.5F)(0.3F), 0.5F, 1e-4);
  }
  EXPECT_NEAR(curve_for({0.5F, 3, 50})(3), 0.5F, 1e-4) << "no brighter than half of white";
}

TEST(CurveFor, KeepsTheDarkestLevelVisible) {
  const PictureLevels levels{0.005F, 0.2F, 50};
  EXPECT_GE(curve_for(levels, 0.02F)(0.005F), 1.0F / 256 * 0.999F);
}

TEST(CurveFor, IsACurveForAnyLevels) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const float a : {0.0F, 1e-9F, 1.0F, 6e4F, infinity, NAN, -1.0F}) {
    for (const float b : {0.0F, 1e-9F, 1.0F, 6e4F, infinity, NAN, -1.0F}) {
      for (const float c : {0.0F, 1.0F, 6e4F, infinity, -1.0F}) {
        const ToneCurve curve = curve_for({a, b, c});
        EXPECT_EQ(curve_of(parameters_of(curve)), curve) << a << " " << b << " " << c;
        EXPECT_TRUE(curve.is_on());
      }
    }
  }
}

}  // namespace
}  // namespace compositing::tone_test
