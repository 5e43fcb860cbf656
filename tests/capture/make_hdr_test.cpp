// From files to radiance: made and real brackets, HDR pictures, and what must be refused.
#include "capture/make_hdr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "capture/colour.h"
#include "capture/exr.h"
#include "capture/hdr.h"
#include "capture/png.h"
#include "capture/rgbe.h"
#include "tests/capture/made_bracket.h"
#include "tests/capture/made_exif.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::make_hdr_test {
namespace {

std::string message_of(const std::vector<std::string>& paths, const HdrOptions& options = {}) {
  try {
    make_hdr(paths, options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

std::string write_still(const std::string& path, const Still8& still) {
  write_png(path, still.width, still.height, still.channels, still.texels);
  return path;
}

TEST(MakeHdr, RecoversAMadeSceneFromFiles) {
  const auto directory = made::make_temporary_directory();
  const made::Scene scene = made::patches(240, 160, 1);
  const auto curve = [](double z) { return 0.1 * z + 0.4 * z * z + 0.5 * std::pow(z, 4); };
  std::vector<std::string> paths;
  HdrOptions options;
  for (int i = -3; i <= 3; ++i) {
    options.exposures_s.push_back(std::exp2(2 * i));
    paths.push_back(write_still(
        directory / (std::to_string(i + 3) + ".png"),
        made::photograph(scene, options.exposures_s.back(), curve, static_cast<unsigned>(i + 50))));
  }
  const HdrResult result = make_hdr(paths, options);
  ASSERT_EQ(result.radiance.pixels.size(), scene.radiance.size());
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < scene.radiance.size(); ++i) {
    if (scene.radiance[i] > 50) continue;  // 64 clips in the shortest shot
    squares += std::pow(static_cast<double>(result.radiance.pixels[i]) / scene.radiance[i] - 1, 2);
    ++count;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.05);
  EXPECT_NEAR(range_stops(result.radiance), 14, 1);
  EXPECT_EQ(result.exposures_s.size(), paths.size());
  EXPECT_FALSE(result.candidates.empty());
  EXPECT_GT(result.time_ms, 0);
}

TEST(MakeHdr, TakesOneShotAsSrgb) {
  const std::string path =
      write_still(made::make_temporary_directory() / "a.png", {1, 1, 3, {0, 128, 200}});
  const HdrResult result = make_hdr(std::vector{path}, {.exposures_s = {0.5}});
  EXPECT_NEAR(result.radiance.at(0, 0, 1), decode(Transfer::srgb, 128 / 255.0) / 0.5, 1e-5);
  EXPECT_EQ(result.response.name, "sRGB");
}

TEST(MakeHdr, ConvertsOneHdrPictureBitForBit) {
  const auto directory = made::make_temporary_directory();
  Image image = make_image(4, 9);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = static_cast<float>(i) * 1e3F;
  }
  write_exr(directory / "a.exr", image);
  write_rgbe(directory / "a.hdr", image);
  EXPECT_EQ(make_hdr(std::vector<std::string>{directory / "a.exr"}).radiance.pixels, image.pixels);
  EXPECT_EQ(make_hdr(std::vector<std::string>{directory / "a.hdr"}).radiance.pixels,
            read_rgbe(directory / "a.hdr").pixels);
}

TEST(MakeHdr, CountsWhatIsNoNumberAsBlackAndSaysSo) {
  const auto directory = made::make_temporary_directory();
  Image image = make_image(2, 4);
  std::ranges::fill(image.pixels, 0.5F);
  image.pixels[3] = image.pixels[7] = std::nanf("");
  image.pixels[11] = HUGE_VALF;
  write_exr(directory / "a.exr", image);
  const HdrResult result = make_hdr(std::vector<std::string>{directory / "a.exr"});
  EXPECT_EQ(result.radiance.pixels[3], 0);
  EXPECT_EQ(result.radiance.pixels[4], 0.5F);
  EXPECT_TRUE(std::isfinite(result.radiance.pixels[11]));
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_EQ(result.warnings[0], "2 values (8 %) are no numbers and count as black");
  EXPECT_FALSE(result.heldout_error.has_value());
}

TEST(MakeHdr, WarnsOfABracketThatContradictsItself) {
  const auto directory = made::make_temporary_directory();
  const made::Scene scene = made::patches(240, 160, 1);
  std::vector<std::string> paths;
  HdrOptions options{.exposures_s = {}, .response = "sRGB"};
  for (int i = -2; i <= 2; ++i) {
    options.exposures_s.push_back(std::exp2(2 * i));
    paths.push_back(write_still(
        directory / (std::to_string(i + 2) + ".png"),
        made::photograph(
            scene, options.exposures_s.back(), [](double z) { return decode(Transfer::srgb, z); },
            static_cast<unsigned>(i + 50))));
  }
  EXPECT_LT(make_hdr(paths, options).shares.contradicting, 0.02);
  std::ranges::reverse(options.exposures_s);
  const HdrResult reversed = make_hdr(paths, options);
  EXPECT_GT(reversed.shares.contradicting, 0.8);
  ASSERT_FALSE(reversed.warnings.empty());
  EXPECT_NE(reversed.warnings[0].find("the shots contradict each other"), std::string::npos);
}

TEST(MakeHdr, MergesLinearShotsInExrFiles) {
  const auto directory = made::make_temporary_directory();
  Image bright{1, 1, {1, 0.5F, 0.1F}};
  Image dark{1, 1, {0.2F, 0.05F, 0.01F}};
  write_exr(directory / "a.exr", bright);
  write_exr(directory / "b.exr", dark);
  const HdrResult result =
      make_hdr(std::vector<std::string>{directory / "a.exr", directory / "b.exr"},
               {.exposures_s = {1, 0.1}});
  EXPECT_NEAR(result.radiance.at(0, 0, 0), 2, 1e-5);
  EXPECT_NEAR(result.radiance.at(0, 0, 1), 0.5, 1e-5);
}

TEST(MakeHdr, MergesTheRealFishEyeBracket) {
  const auto directory = made::real_data() / "brackets" / "fisheye8mm";
  if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no real data at " << directory;
  std::vector<std::string> paths;
  for (int number = 6955; number <= 6971; number += 2) {
    paths.push_back(directory / ("IMG_" + std::to_string(number) + ".JPG"));
  }
  const HdrResult result = make_hdr(paths);
  EXPECT_EQ(result.radiance.width, 2808);
  EXPECT_EQ(result.radiance.height, 1872);
  EXPECT_NEAR(range_stops(result.radiance), 14, 0.5);
  for (const float value : result.radiance.pixels) {
    ASSERT_TRUE(std::isfinite(value) && value >= 0);
  }
}

TEST(MakeHdr, RefusesShotsOfTwoSizesNamingBoth) {
  const auto directory = made::make_temporary_directory();
  const std::string a = write_still(directory / "a.png", {2, 1, 3, std::vector<std::uint8_t>(6)});
  const std::string b = write_still(directory / "b.png", {1, 1, 3, std::vector<std::uint8_t>(3)});
  const std::string message = message_of({a, b}, {.exposures_s = {1, 2}});
  EXPECT_NE(message.find(b + ": is 1 x 1"), std::string::npos) << message;
  EXPECT_NE(message.find(a + " is 2 x 1"), std::string::npos) << message;
}

TEST(MakeHdr, RefusesShotsWithoutExposureTimes) {
  const std::string a = write_still(made::make_temporary_directory() / "a.png",
                                    {1, 1, 3, std::vector<std::uint8_t>(3)});
  EXPECT_NE(message_of({a}).find(a + ": tells no exposure time"), std::string::npos);
}

// A picture that tells its exposure of 1/100 s, f-number and ISO.
std::string write_told(const std::string& path, std::uint32_t f_number_tenths, std::uint16_t iso) {
  independent::ffmpeg("-f lavfi -i color=gray:size=16x16 -frames:v 1 '" + path + "'");
  std::ifstream in(path, std::ios::binary);
  const std::string jpeg((std::istreambuf_iterator<char>(in)), {});
  const made::ExifBytes told = made::made_exif(1, 100, f_number_tenths, iso);
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(told.data()), std::ssize(told) - 2);  // but for its end
  out << jpeg.substr(2);
  return path;
}

TEST(MakeHdr, RefusesABracketOfWhichOnlySomeTellFNumberOrIso) {
  const auto directory = made::make_temporary_directory();
  const std::string all = write_told(directory / "all.jpg", 80, 200);
  const std::string same = write_told(directory / "same.jpg", 80, 200);
  const std::string no_f = write_told(directory / "no_f.jpg", 0, 200);
  const std::string no_iso = write_told(directory / "no_iso.jpg", 80, 0);
  EXPECT_EQ(message_of({all, same}), "");
  EXPECT_EQ(message_of({all, no_f}),
            no_f + ": tells no f-number, but " + all + " does; state the exposures of all shots");
  EXPECT_EQ(message_of({no_iso, all}),
            no_iso + ": tells no ISO, but " + all + " does; state the exposures of all shots");
  EXPECT_EQ(message_of({no_f, no_f}), "");
  EXPECT_EQ(message_of({all, no_f}, {.exposures_s = {1, 2}}), "");
}

TEST(MakeHdr, RefusesWhatIsNoBracket) {
  const auto directory = made::make_temporary_directory();
  const std::string still =
      write_still(directory / "a.png", {1, 1, 3, std::vector<std::uint8_t>(3)});
  const std::string picture = directory / "a.exr";
  write_exr(picture, make_image(1, 1));
  EXPECT_THROW(make_hdr({}), std::invalid_argument);
  EXPECT_THROW(make_hdr(std::vector{still}, {.exposures_s = {1, 2}}), std::invalid_argument);
  EXPECT_NE(message_of({still, picture}, {.exposures_s = {1, 2}}).find("one kind"),
            std::string::npos);
  EXPECT_NE(message_of({picture, picture}).find("tells no exposure time"), std::string::npos);
  EXPECT_NE(message_of({directory / "missing.jpg"}).find("missing.jpg"), std::string::npos);
  EXPECT_NE(
      message_of({PLATELIGHT_SOURCE_DIR "/tests/data/bad/truncated.exr"}).find("truncated.exr"),
      std::string::npos);
}

TEST(RangeStops, IsTheRatioOfBrightestToFaintest) {
  Image image = make_image(100, 100);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = i < 9000 ? 0.0F : i < 18000 ? 0.25F : 8.0F;  // black does not count
  }
  for (std::size_t i = 0; i < 9; ++i) image.pixels[i] = 1e6F;  // nor do three pixels
  EXPECT_NEAR(range_stops(image), 5, 1e-9);
  EXPECT_EQ(range_stops(make_image(1, 1)), 0);
}

}  // namespace
}  // namespace capture::make_hdr_test
