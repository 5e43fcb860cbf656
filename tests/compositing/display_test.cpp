// The display: its tables against OpenColorIO, against the plate's decode, and on bad values.
#include "compositing/display.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

#include "capture/colour.h"
#include "compositing/view_transform.h"

namespace compositing::display_test {
namespace {

std::string data_dir() {
  const char* given = std::getenv("PLATELIGHT_DATA");
  return given != nullptr ? given : PLATELIGHT_SOURCE_DIR "/../shared/data";
}

capture::HalfImage half_image(int height, int width) {
  capture::HalfImage image{height, width, {}, 4};
  image.pixels.assign(static_cast<std::size_t>(height) * static_cast<std::size_t>(width) * 4, 0);
  return image;
}

// A grey ramp of display codes, decoded as a plate is and rounded to half.
capture::HalfImage decoded_codes(capture::Transfer transfer) {
  capture::HalfImage image = half_image(1, 256);
  for (int code = 0; code < 256; ++code) {
    const auto light = static_cast<float>(capture::decode(transfer, code / 255.0));
    for (int c = 0; c < 3; ++c) {
      image.pixels[image.index(0, code, c)] = capture::half_from_float(light);
    }
  }
  return image;
}

// Colours of 11 stops of brightness, each channel from `lowest` to 1 times the brightness: 1 is
// grey, 0 as saturated as the gamut allows, less lies outside.
capture::HalfImage random_colours(int height, int width, float lowest = 0.0F) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  capture::HalfImage image = half_image(height, width);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const float brightness = std::exp2(-8.0F + 11.0F * uniform(random));
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = brightness * (lowest + (1.0F - lowest) * uniform(random));
      image.pixels[i + c] = capture::half_from_float(value);
    }
  }
  return image;
}

std::vector<std::uint8_t> rgb8(const Display& display, const capture::HalfImage& image) {
  std::vector<std::uint8_t> rgb(image.pixels.size() / 4 * 3);
  display.to_rgb8(image, rgb);
  return rgb;
}

// Distance between a display's codes and the exact view, in 8-bit codes. 0.25 in the mean is the
// price of rounding alone.
struct CodeError {
  double mean = 0;
  double p99 = 0;
  double max = 0;
};

CodeError measure_error(const DisplaySettings& settings, const capture::HalfImage& image) {
  const std::vector<std::uint8_t> codes = rgb8(Display(settings), image);
  std::vector<float> exact(codes.size());
  for (std::size_t i = 0; i < exact.size(); ++i) {
    exact[i] = capture::float_from_half(image.pixels[i / 3 * 4 + i % 3]);
  }
  ViewTransform(settings).apply(exact);
  std::vector<double> differences(exact.size());
  for (std::size_t i = 0; i < exact.size(); ++i) {
    differences[i] = std::abs(codes[i] - 255.0 * std::clamp(exact[i], 0.0F, 1.0F));
  }
  std::sort(differences.begin(), differences.end());
  const double sum = std::accumulate(differences.begin(), differences.end(), 0.0);
  return {sum / static_cast<double>(differences.size()), differences[differences.size() * 99 / 100],
          differences.back()};
}

TEST(Display, GivesBackEveryCodeOfAPlateInItsOwnUnToneMappedView) {
  const std::pair<const char*, capture::Transfer> pairs[] = {
      {"Rec.1886", capture::Transfer::rec1886}, {"sRGB", capture::Transfer::srgb}};
  for (const auto& [name, transfer] : pairs) {
    const Display display({.display = name});
    ASSERT_TRUE(display.separable());
    const std::vector<std::uint8_t> rgb = rgb8(display, decoded_codes(transfer));
    for (int code = 0; code < 256; ++code) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_LE(std::abs(rgb[static_cast<std::size_t>(code * 3 + c)] - code), 1)
            << name << " code " << code;
      }
    }
  }
}

TEST(Display, IsMonotoneOverAllHalves) {
  for (const char* name : {"Rec.1886", "sRGB"}) {
    for (const char* view : {"Un-tone-mapped", "ACES SDR"}) {
      const Display display({.display = name, .view = view});
      capture::HalfImage ramp = half_image(1, 2 * 0x7c00);
      for (int i = 0; i < 2 * 0x7c00; ++i) {
        const int bits = i < 0x7c00 ? 0x8000 + 0x7bff - i : i - 0x7c00;
        for (int c = 0; c < 3; ++c) {
          ramp.pixels[ramp.index(0, i, c)] = static_cast<capture::Half>(bits);
        }
      }
      std::vector<std::uint16_t> rgb(ramp.pixels.size() / 4 * 3);
      display.to_rgb16(ramp, rgb);
      for (std::size_t i = 3; i < rgb.size(); ++i) {
        // A baked view's interpolation may step back by float rounding.
        ASSERT_GE(rgb[i] + (display.separable() ? 0 : 1), rgb[i - 3]) << name << view << i / 3;
      }
      EXPECT_LT(rgb.front(), 1000);
      EXPECT_GT(rgb.back(), 65000);
    }
  }
}

TEST(Display, IsExactToRoundingWhereChannelsDoNotMix) {
  for (const char* name : {"Rec.1886", "sRGB"}) {
    EXPECT_LE(measure_error({.display = name}, random_colours(64, 64)).max, 0.5 + 1e-3) << name;
  }
}

TEST(Display, StaysWithinTwoCodesOfTheExactAcesView) {
  for (const char* name : {"Rec.1886", "sRGB"}) {
    const DisplaySettings settings{.display = name, .view = "ACES SDR"};
    ASSERT_FALSE(Display(settings).separable());
    const CodeError muted = measure_error(settings, random_colours(128, 256, 0.3F));
    EXPECT_LT(muted.mean, 0.27) << name;  // 0.25 is rounding alone
    EXPECT_LT(muted.max, 2.5) << name;
    const CodeError saturated = measure_error(settings, random_colours(128, 256, 0.0F));
    EXPECT_LT(saturated.mean, 0.27) << name;
    EXPECT_LT(saturated.p99, 1.5) << name;
    const CodeError beyond = measure_error(settings, random_colours(128, 256, -0.05F));
    EXPECT_LT(beyond.mean, 0.30) << name;
    EXPECT_LT(beyond.p99, 3.0) << name;
  }
}

TEST(Display, ErrsLessWithALargerTable) {
  const capture::HalfImage colours = random_colours(128, 128);
  double before = std::numeric_limits<double>::infinity();
  for (const int size : {5, 17, 65}) {
    const double mean = measure_error({.view = "ACES SDR", .table_size = size}, colours).mean;
    EXPECT_LT(mean, before) << size;
    before = mean;
  }
}

TEST(Display, MapsAcesGreyAndWhiteWhereOpenColorIoDoes) {
  const Display display({.view = "ACES SDR"});
  capture::HalfImage image = half_image(1, 2);
  for (int c = 0; c < 3; ++c) {
    image.pixels[image.index(0, 0, c)] = capture::half_from_float(0.18F);
    image.pixels[image.index(0, 1, c)] = capture::half_from_float(1.0F);
  }
  const std::vector<std::uint8_t> rgb = rgb8(display, image);
  EXPECT_NEAR(rgb[0], 0.39 * 255, 2);
  EXPECT_NEAR(rgb[3], 0.82 * 255, 2);
}

TEST(Display, CountsNanAndShowsItBlack) {
  constexpr capture::Half nan = 0x7e00;
  constexpr capture::Half infinity = 0x7c00;
  for (const char* view : {"Un-tone-mapped", "ACES SDR"}) {
    const Display display({.view = view});
    capture::HalfImage image = half_image(2, 2);
    image.pixels = {nan,      nan,          nan,      0,    //
                    infinity, infinity,     infinity, 0,    //
                    0,        0x8000 | nan, 0,        nan,  //
                    0,        0x8000,       0,        nan};
    std::vector<std::uint8_t> rgb(12, 99);
    EXPECT_EQ(display.to_rgb8(image, rgb), 2) << view;
    const std::uint8_t black = rgb8(display, half_image(1, 1)).front();  // 2 in the ACES view
    for (const std::size_t i : {0, 1, 2, 6, 7, 8, 9, 10, 11}) EXPECT_EQ(rgb[i], black) << view << i;
    for (const std::size_t i : {3, 4, 5}) EXPECT_GT(rgb[i], 252) << view << i;
  }
}

TEST(Display, GivesTheSameCodesWholeInRunsAndAsWords) {
  const capture::HalfImage image = random_colours(37, 23);
  for (const char* view : {"Un-tone-mapped", "ACES SDR"}) {
    const Display display({.view = view});
    const std::vector<std::uint8_t> whole = rgb8(display, image);
    std::vector<std::uint8_t> runs(whole.size());
    const std::span<const capture::Half> pixels(image.pixels);
    const std::span<std::uint8_t> codes(runs);
    for (std::size_t first = 0; first < whole.size() / 3; first += 100) {
      const std::size_t length = std::min<std::size_t>(100, whole.size() / 3 - first);
      display.to_rgb8(pixels.subspan(first * 4, length * 4), codes.subspan(first * 3, length * 3));
    }
    EXPECT_EQ(runs, whole);
    std::vector<std::uint32_t> words(whole.size() / 3);
    display.to_rgb32(image, words);
    for (std::size_t i = 0; i < words.size(); ++i) {
      ASSERT_EQ(words[i], 0xff000000U | std::uint32_t{whole[i * 3]} << 16U |
                              std::uint32_t{whole[i * 3 + 1]} << 8U | whole[i * 3 + 2]);
    }
  }
}

TEST(Display, RefusesWhatIsNotThereAndSaysWhatIs) {
  const auto reason = [](const DisplaySettings& settings) -> std::string {
    try {
      const Display display(settings);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(reason({.display = "Projector"}).find("\"sRGB\""), std::string::npos);
  EXPECT_NE(reason({.view = "Filmic"}).find("\"ACES SDR\""), std::string::npos);
  EXPECT_NE(reason({.working_space = "log"}).find("\"linear Rec.709\""), std::string::npos);
  for (const int size : {-1, 0, 1, 130, std::numeric_limits<int>::max()}) {
    EXPECT_NE(reason({.view = "ACES SDR", .table_size = size}), "") << size;
  }
}

TEST(Display, RefusesSizesThatDoNotAgree) {
  const Display display;
  std::vector<std::uint8_t> rgb(11);
  EXPECT_THROW(display.to_rgb8(half_image(2, 2), rgb), std::invalid_argument);
  capture::HalfImage three_channels{2, 2, std::vector<capture::Half>(12), 3};
  rgb.resize(12);
  EXPECT_THROW(display.to_rgb8(three_channels, rgb), std::invalid_argument);
}

TEST(Display, RefusesDamagedConfigAndLookFilesByName) {
  const std::filesystem::path dir =
      std::filesystem::path(testing::TempDir()) / "platelight_display_refusals";
  std::filesystem::create_directories(dir);
  const auto written = [&](const char* name, const std::string& text) {
    std::ofstream(dir / name) << text;
    return (dir / name).string();
  };
  const auto reason = [](const DisplaySettings& settings) -> std::string {
    try {
      const Display display(settings);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  for (const std::string& file :
       {written("empty.ocio", ""), written("noise.ocio", "\x01\xff{[%"),
        written("future.ocio", "ocio_profile_version: 9\n"), (dir / "missing.ocio").string(),
        dir.string(), std::string("/dev/zero")}) {
    EXPECT_NE(reason({.config_file = file}).find(file), std::string::npos) << file;
  }
  for (const std::string& file :
       {written("empty.clf", ""), written("cut.clf", "<ProcessList id=\"a\" compCLFversion=\"3\">"),
        written("empty.cube", "LUT_3D_SIZE 2\n0 0 0\n"), (dir / "missing.clf").string()}) {
    EXPECT_NE(reason({.look_file = file}).find(file), std::string::npos) << file;
  }
  std::filesystem::remove_all(dir);
}

TEST(Display, RefusesTheIllegalLooksOfTheDataFolder) {
  const std::string dir = data_dir() + "/ocio/";
  if (!std::filesystem::exists(dir)) GTEST_SKIP() << "no data folder " << dir;
  for (const char* name : {"illegal_array_missing_values.clf", "illegal_lut3d_unequal_size.clf"}) {
    EXPECT_THROW(Display({.look_file = dir + name}), std::runtime_error) << name;
  }
}

TEST(Display, AppliesLooksBeforeTheView) {
  const std::string file = data_dir() + "/ocio/matrix_3x4_example.clf";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no data file " << file;
  const Display plain;
  const Display with_look({.look_file = file});
  const capture::HalfImage image = random_colours(16, 16);
  EXPECT_NE(rgb8(plain, image), rgb8(with_look, image));
  EXPECT_LT(measure_error({.look_file = file}, image).mean, 2);
}

TEST(Display, ReadsAPublishedConfig) {
  const std::string file = data_dir() + "/ocio/cg-config-v1.0.0_aces-v1.3_ocio-v2.1.ocio";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no data file " << file;
  const capture::HalfImage image = random_colours(64, 64);
  const Display theirs({.display = "Rec.1886 Rec.709 - Display",
                        .view = "ACES 1.0 - SDR Video",
                        .config_file = file});
  const Display ours({.view = "ACES SDR"});
  const std::vector<std::uint8_t> a = rgb8(theirs, image);
  const std::vector<std::uint8_t> b = rgb8(ours, image);
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1) << i;
  EXPECT_TRUE(Display({.display = "sRGB - Display", .view = "Un-tone-mapped", .config_file = file})
                  .separable());
  EXPECT_THROW(Display({.config_file = file}), std::invalid_argument);
}

TEST(Display, TakesTheDefaultWhereNoNameIsGiven) {
  const capture::HalfImage image = random_colours(8, 8);
  EXPECT_EQ(rgb8(Display({.display = "", .view = ""}), image), rgb8(Display(), image));
  EXPECT_EQ(rgb8(Display({.display = "sRGB", .view = ""}), image),
            rgb8(Display({.display = "sRGB"}), image));
}

}  // namespace
}  // namespace compositing::display_test
