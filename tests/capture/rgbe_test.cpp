// Radiance pictures: the encoding's laws, its files, and what must be refused.
#include "capture/rgbe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>

#include "capture/exr.h"
#include "tests/made_files.h"

namespace capture::rgbe_test {
namespace {

constexpr char head[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n";

std::string write_text(const std::string& name, const std::string& bytes) {
  const std::string path = made::make_temporary_directory() / name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

// A pixel whose red tells which one it is: 0.5 to 1.5 steps of 1/256 above.
std::string pixel(int number) { return {static_cast<char>(128 + number), 0, 0, char(128)}; }
int number_of(float red) { return static_cast<int>(std::lround(red * 256 - 0.5F)) - 128; }

TEST(RgbeFromRadiance, KeepsTheLargestChannelToOnePartIn256) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> stops(-100, 100);
  for (int i = 0; i < 200'000; ++i) {
    const float r = std::exp2(stops(random));
    const float g = r * 0.3F;
    const auto back = radiance_from_rgbe(rgbe_from_radiance(r, g, 0));
    ASSERT_NEAR(back[0] / r, 1, 1.0 / 256) << r;
    ASSERT_NEAR(back[1], g, r / 256) << r;
  }
}

TEST(RgbeFromRadiance, IsUnbiased) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(1, 2);
  double sum = 0;
  constexpr int count = 100'000;
  for (int i = 0; i < count; ++i) {
    const float r = value(random);
    sum += radiance_from_rgbe(rgbe_from_radiance(r, 0, 0))[0] - r;
  }
  EXPECT_NEAR(sum / count, 0, 5e-5);
}

TEST(RgbeFromRadiance, GivesBackEveryCode) {
  for (int exponent = 1; exponent < 256; ++exponent) {
    for (int mantissa = 128; mantissa < 256; ++mantissa) {
      const Rgbe code{static_cast<std::uint8_t>(mantissa),
                      static_cast<std::uint8_t>(255 - mantissa), 0,
                      static_cast<std::uint8_t>(exponent)};
      const auto rgb = radiance_from_rgbe(code);
      ASSERT_EQ(rgbe_from_radiance(rgb[0], rgb[1], rgb[2]), code);
    }
  }
}

TEST(RgbeFromRadiance, StoresNothingBelowZeroAndNothingBeyondItsRange) {
  EXPECT_EQ(rgbe_from_radiance(0, 0, 0), Rgbe{});
  EXPECT_EQ(rgbe_from_radiance(-1, std::numeric_limits<float>::quiet_NaN(), 0), Rgbe{});
  EXPECT_EQ(rgbe_from_radiance(1e-40F, 0, 0), Rgbe{});
  EXPECT_EQ(rgbe_from_radiance(std::numeric_limits<float>::max(), 0, 0), (Rgbe{255, 0, 0, 255}));
}

TEST(WriteRgbe, IsReadBackWithinItsPrecisionForAnyWidth) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(0, 1000);
  for (const int width : {1, 7, 8, 9, 127, 128, 129, 300}) {
    Image image = make_image(5, width);
    // Half noise, half constant: literals and runs of every length meet.
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      image.pixels[i] = random() % 8 == 0 ? value(random) : 3.0F;
    }
    const std::string path = made::make_temporary_directory() / "a.hdr";
    write_rgbe(path, image);
    const Image back = read_rgbe(path);
    ASSERT_EQ(back.width, width);
    ASSERT_EQ(back.height, 5);
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < width; ++x) {
        const float* p = &image.pixels[image.index(y, x)];
        const Rgbe code = rgbe_from_radiance(p[0], p[1], p[2]);
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(back.at(y, x, c), radiance_from_rgbe(code)[static_cast<std::size_t>(c)]);
        }
      }
    }
  }
}

TEST(WriteRgbe, RefusesOtherChannelCountsAndValuesThatAreNotFinite) {
  const std::string path = made::make_temporary_directory() / "a.hdr";
  EXPECT_THROW(write_rgbe(path, make_image(1, 1, 4)), std::invalid_argument);
  Image image = make_image(1, 1);
  image.pixels[1] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(write_rgbe(path, image), std::invalid_argument);
}

TEST(ReadRgbe, PutsAllEightOrientationsUpright) {
  // Pixel number = 3 y + x of a picture of two rows and three columns.
  const std::vector<std::pair<std::string, std::vector<int>>> orders{
      {"-Y 2 +X 3", {0, 1, 2, 3, 4, 5}}, {"-Y 2 -X 3", {2, 1, 0, 5, 4, 3}},
      {"+Y 2 +X 3", {3, 4, 5, 0, 1, 2}}, {"+Y 2 -X 3", {5, 4, 3, 2, 1, 0}},
      {"+X 3 -Y 2", {0, 3, 1, 4, 2, 5}}, {"-X 3 -Y 2", {2, 5, 1, 4, 0, 3}},
      {"+X 3 +Y 2", {3, 0, 4, 1, 5, 2}}, {"-X 3 +Y 2", {5, 2, 4, 1, 3, 0}}};
  for (const auto& [resolution, order] : orders) {
    std::string bytes = std::string(head) + "\n" + resolution + "\n";
    for (const int number : order) bytes += pixel(number);
    const Image image = read_rgbe(write_text("a.hdr", bytes));
    ASSERT_EQ(image.height, 2);
    ASSERT_EQ(image.width, 3);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(number_of(image.at(i / 3, i % 3)), i) << resolution;
  }
}

TEST(ReadRgbe, ReadsOldRunsAcrossTheirSteps) {
  const std::string repeat_4{1, 1, 1, 4};
  const std::string repeat_256{1, 1, 1, 1};
  const std::string bytes =
      std::string(head) + "\n-Y 1 +X 262\n" + pixel(1) + repeat_4 + repeat_256 + pixel(2);
  const Image image = read_rgbe(write_text("a.hdr", bytes));
  for (int x = 0; x < 261; ++x) ASSERT_EQ(number_of(image.at(0, x)), 1) << x;
  EXPECT_EQ(number_of(image.at(0, 261)), 2);
}

TEST(ReadRgbe, DividesExposureAndColourCorrectionOut) {
  const std::string bytes = std::string(head) + "EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 1\n" +
                            "\n-Y 1 +X 1\n" + std::string{char(128), char(128), 0, char(129)};
  const Image image = read_rgbe(write_text("a.hdr", bytes));
  EXPECT_FLOAT_EQ(image.at(0, 0, 0), 128.5F / 128 / 8);
  EXPECT_FLOAT_EQ(image.at(0, 0, 1), 128.5F / 128 / 16);
}

TEST(ReadRgbe, TurnsXyzIntoRec709) {
  // D65 white.
  const Rgbe white = rgbe_from_radiance(0.9505F, 1, 1.089F);
  const std::string bytes =
      "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + std::string(white.begin(), white.end());
  const Image image = read_rgbe(write_text("a.hdr", bytes));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at(0, 0, c), 1, 0.02);
}

TEST(ReadRgbe, AgreesWithAnIndependentReaderOnRealMaps) {
  const auto maps = made::real_data() / "env";
  if (!std::filesystem::exists(maps)) GTEST_SKIP() << "no real data at " << maps;
  for (const char* name : {"park.hdr", "studio.hdr"}) {
    const std::string theirs = made::make_temporary_directory() / "a.exr";
    const std::string command =
        "oiiotool " + (maps / name).string() + " -d float --compression none -o " + theirs;
    ASSERT_EQ(std::system(command.c_str()), 0);
    const Image a = read_rgbe(maps / name);
    const Image b = read_exr(theirs);
    ASSERT_EQ(a.pixels.size(), b.pixels.size());
    for (std::size_t i = 0; i < a.pixels.size(); i += 3) {
      const float step = std::max({b.pixels[i], b.pixels[i + 1], b.pixels[i + 2]}) / 128;
      for (std::size_t c = i; c < i + 3; ++c) ASSERT_NEAR(a.pixels[c], b.pixels[c], step) << name;
    }
  }
}

TEST(ReadRgbe, RefusesEveryBadFileWithItsReason) {
  made::expect_refusals("", ".hdr",
                        {{"no_magic.hdr", "is no Radiance picture"},
                         {"no_format.hdr", "has no FORMAT"},
                         {"unknown_format.hdr", "line 2"},
                         {"truncated.hdr", "ends too early"},
                         {"header_only.hdr", "ends too early"},
                         {"size_of_millions.hdr", "1000000 x 1000000"},
                         {"size_over_memory.hdr", "limit of 2048 MiB"},
                         {"size_negative.hdr", "1 to 16384 a side"},
                         {"one_axis_twice.hdr", "malformed resolution"},
                         {"run_past_the_end.hdr", "run beyond"},
                         {"run_of_nothing.hdr", "run beyond"},
                         {"scan_line_too_short.hdr", "another length"},
                         {"old_run_before_any_pixel.hdr", "run beyond"},
                         {"old_run_past_the_end.hdr", "run beyond"},
                         {"exposure_zero.hdr", "not above 0"},
                         {"exposure_word.hdr", "malformed number"},
                         {"gamma_of_two.hdr", "not linear"},
                         {"primaries_on_a_line.hdr", "no colour space"}},
                        [](const std::string& path) { read_rgbe(path); });
}

TEST(ReadRgbe, SurvivesDamageAnywhere) {
  const std::string path = made::make_temporary_directory() / "a.hdr";
  Image image = make_image(12, 40);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = static_cast<float>(i * i % 37);
  }
  write_rgbe(path, image);
  std::ifstream file(path, std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(file), {}};
  std::mt19937 random(4);
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    std::string bytes = good;
    for (int flips = 0; flips < 3; ++flips) bytes[random() % bytes.size()] = char(random());
    if (i % 3 == 0) bytes.resize(random() % bytes.size());
    std::ofstream(path, std::ios::binary) << bytes;
    try {
      const Image read = read_rgbe(path);
      EXPECT_EQ(read.pixels.size(), read.index(read.height, 0));
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace capture::rgbe_test
