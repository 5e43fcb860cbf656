// OpenEXR files: bits kept, colours and windows right, hostile files harmless.
#include "capture/exr.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <stdexcept>

#include "capture/camera.h"
#include "capture/primaries.h"
#include "tests/made_files.h"

namespace capture::exr_test {
namespace {

// What an independent tool prints.
std::string output_of(const std::string& command) {
  std::string text;
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  if (pclose(pipe) != 0) text += " FAILED";
  return text;
}

HalfImage made_half_image(int height, int width, int channels, unsigned seed) {
  std::mt19937 random(seed);
  HalfImage image{height, width, {}, channels};
  image.pixels.resize(image.index(height, 0));
  for (Half& half : image.pixels) half = static_cast<Half>(random());  // NaN and infinity too
  return image;
}

bool is_nan(Half half) { return (half & 0x7FFF) > 0x7C00; }

TEST(ReadExr, TellsTheShapeOfPixels) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string path = directory / "a.exr";
  for (const Rational aspect :
       {Rational{1, 1}, Rational{2, 1}, Rational{1, 2}, Rational{4, 3}, Rational{64, 45},
        Rational{128, 117}, Rational{4320, 4739}, Rational{16, 1}, Rational{1, 16}}) {
    ExrOptions options;
    options.pixel_aspect = aspect;
    write_exr(path, make_image(2, 3), options);
    const ExrPicture picture = read_exr_picture(path);
    EXPECT_EQ(picture.pixel_aspect, aspect) << aspect.num << "/" << aspect.den;
    EXPECT_EQ(picture.image.width, 3);
    EXPECT_EQ(open_camera(path)->info().pixel_aspect, aspect);
  }
  for (const Rational absurd : {Rational{17, 1}, Rational{1, 17}}) {
    ExrOptions options;
    options.pixel_aspect = absurd;
    write_exr(path, make_image(2, 3), options);
    EXPECT_EQ(read_exr_picture(path).pixel_aspect, (Rational{1, 1}));
  }
}

TEST(WriteExr, KeepsEveryBitOfHalfChannelsUnderEveryCompression) {
  for (const auto compression :
       {ExrCompression::none, ExrCompression::rle, ExrCompression::zip, ExrCompression::piz}) {
    const std::string path = made::make_temporary_directory() / "a.exr";
    const HalfImage rgba = made_half_image(37, 53, 4, 1);
    const HalfImage matte = made_half_image(37, 53, 1, 2);
    const std::vector<ExrPlanes> planes{{rgba, {"R", "G", "B", "A"}}, {matte, {"matte"}}};
    write_exr(path, planes, {.compression = compression});
    const HalfImage back = to_half(read_exr(path));
    ASSERT_EQ(back.pixels.size(), rgba.pixels.size());
    for (std::size_t i = 0; i < rgba.pixels.size(); ++i) {
      if (is_nan(rgba.pixels[i])) {
        ASSERT_TRUE(is_nan(back.pixels[i]));
      } else {
        ASSERT_EQ(back.pixels[i], rgba.pixels[i]);
      }
    }
  }
}

// A file of 1 x 3 half pixels that says other primaries.
std::string write_with_primaries(const HalfImage& image, const std::array<float, 8>& primaries) {
  const std::string path = made::make_temporary_directory() / "a.exr";
  write_exr(path, std::vector<ExrPlanes>{{image, {"R", "G", "B"}}});
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  constexpr std::array<float, 8> written{0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F};
  std::string from(sizeof written, 0), to(sizeof written, 0);
  std::memcpy(from.data(), written.data(), sizeof written);
  std::memcpy(to.data(), primaries.data(), sizeof written);
  bytes.replace(bytes.find(from), from.size(), to);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

// A sun that was too much for half floats.
TEST(ReadExr, TakesInfiniteLightOfAnyPrimariesAsTheLargestHalf) {
  constexpr Half infinite = 0x7C00, one = 0x3C00;
  const HalfImage image{
      1, 3, {infinite, infinite, infinite, infinite, infinite, one, one, one, one}, 3};
  const Image sun = read_exr(write_with_primaries(
      image, {0.713F, 0.293F, 0.165F, 0.830F, 0.128F, 0.044F, 0.32168F, 0.33767F}));
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sun.at(0, 0, c) / 65504, 1, 1e-3) << c;
    EXPECT_TRUE(std::isfinite(sun.at(0, 1, c))) << c;
    EXPECT_NEAR(sun.at(0, 2, c), 1, 1e-3) << c;
  }
  const std::string plain = made::make_temporary_directory() / "plain.exr";
  write_exr(plain, std::vector<ExrPlanes>{{image, {"R", "G", "B"}}});
  EXPECT_EQ(open_camera(plain)->next()->image->pixels,
            (std::vector<float>{65504, 65504, 65504, 65504, 65504, 1, 1, 1, 1}));
}

TEST(WriteExr, KeepsEveryBitOfFloats) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> stops(-120, 120);
  for (const int channels : {1, 3, 4}) {
    const std::string path = made::make_temporary_directory() / "a.exr";
    Image image = make_image(19, 31, channels);
    for (float& value : image.pixels) value = std::exp2(stops(random));
    write_exr(path, image);
    const Image back = read_exr(path);
    EXPECT_EQ(back.channels, channels);
    EXPECT_EQ(back.pixels, image.pixels);
  }
}

TEST(WriteExr, PassesAnIndependentReaderWithItsAttributes) {
  const std::string path = made::make_temporary_directory() / "take.exr";
  const HalfImage rgba = to_half(make_image(40, 60, 4));
  const HalfImage matte = to_half(make_image(40, 60, 1));
  const std::vector<ExrPlanes> planes{{rgba, {"R", "G", "B", "A"}}, {matte, {"matte"}}};
  write_exr(path, planes,
            {.compression = ExrCompression::rle,
             .timecode = ExrTimecode{10, 59, 58, 24, false},
             .frames_per_second = Rational{30000, 1001}});
  const std::string info = output_of("oiiotool --info -v " + path);
  for (const char* part : {"60 x   40, 5 channel, half openexr", "channel list: R, G, B, A, matte",
                           "compression: \"rle\"", "10:59:58:24", "30000/1001",
                           "chromaticities: 0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329"}) {
    EXPECT_NE(info.find(part), std::string::npos) << part << "\n" << info;
  }
  EXPECT_EQ(info.find("FAILED"), std::string::npos) << info;
}

TEST(WriteExr, KeepsHowCodesBecameLight) {
  const std::string path = made::make_temporary_directory() / "a.exr";
  write_exr(path, make_image(3, 4));
  EXPECT_EQ(read_exr_transfer(path), "");
  for (const std::string_view transfer :
       {name_of(Transfer::rec1886), name_of(Transfer::srgb), name_of(Transfer::rec709_camera),
        name_of(Transfer::linear), by_response}) {
    write_exr(path, make_image(3, 4), {.transfer = std::string(transfer)});
    EXPECT_EQ(read_exr_transfer(path), transfer);
    EXPECT_EQ(read_exr_noise(path), std::nullopt);
  }
  write_exr(path, make_image(3, 4), {.transfer = "another program's"});
  EXPECT_EQ(read_exr_transfer(path), "");
}

TEST(WriteExr, KeepsWhatIsKnownOfNoise) {
  const std::string path = made::make_temporary_directory() / "a.exr";
  const Image image = make_image(3, 4);
  write_exr(path, image);
  EXPECT_EQ(read_exr_noise(path), std::nullopt);
  write_exr(path, image, {.noise = LightNoise{2e-4F, 3e-6F}});
  EXPECT_EQ(read_exr_noise(path), (LightNoise{2e-4F, 3e-6F}));
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const LightNoise& bad : {LightNoise{nan, 0}, LightNoise{0, infinity}, LightNoise{-1, 0}}) {
    write_exr(path, image, {.noise = bad});
    EXPECT_EQ(read_exr_noise(path), std::nullopt) << bad.gain << " " << bad.floor;
    EXPECT_EQ(read_exr(path).pixels, image.pixels);
  }
}

// A file of one row of pixels with one more attribute, as another program may have written it.
void write_with_attribute(const std::string& path,
                          const std::string& name,
                          const std::string& type,
                          const std::string& value) {
  write_exr(path, make_image(1, 4));
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  file.close();
  std::string more = name + '\0' + type + '\0';
  for (int i = 0; i < 4; ++i) more += static_cast<char>(value.size() >> (8 * i) & 255);
  more += value;
  const std::size_t row = bytes.size() - 4 * 3 * sizeof(float) - 8;  // its number and its size
  std::uint64_t offset = 0;
  std::memcpy(&offset, &bytes[row - sizeof offset], sizeof offset);
  ASSERT_EQ(offset, row);
  offset += more.size();
  std::memcpy(&bytes[row - sizeof offset], &offset, sizeof offset);
  bytes.insert(8, more);
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(WriteExr, KeepsTheTextOfALens) {
  const std::string path = made::make_temporary_directory() / "a.exr";
  const Image image = make_image(3, 4);
  write_exr(path, image);
  EXPECT_EQ(read_exr_lens(path), "");
  for (const std::string& text : {std::string("model = \"pinhole\"\nfx = 812.25\t# pixels\n"),
                                  std::string(most_lens_text, 'x')}) {
    write_exr(path, image, {.noise = LightNoise{2e-4F, 3e-6F}, .lens = text});
    EXPECT_EQ(read_exr_lens(path), text);
    EXPECT_EQ(read_exr(path).pixels, image.pixels);
    EXPECT_EQ(read_exr_noise(path), (LightNoise{2e-4F, 3e-6F}));
    EXPECT_EQ(read_exr_transfer(path), "");
  }
  for (const std::string& bad : {std::string(most_lens_text + 1, 'x'), std::string("\x1b[2J"),
                                 std::string("a\0b", 3), std::string("\xc3\xa4")}) {
    EXPECT_THROW(write_exr(path, image, {.lens = bad}), std::invalid_argument);
  }
}

TEST(ReadExr, RefusesWhatIsNoTextOfALensButReadsThePicture) {
  const std::string path = made::make_temporary_directory() / "a.exr";
  write_with_attribute(path, "frameLens", "string", "fx = 1\n");
  EXPECT_EQ(read_exr_lens(path), "fx = 1\n");
  write_with_attribute(path, "frameLens", "string", "");
  EXPECT_EQ(read_exr_lens(path), "");
  using namespace std::string_literals;
  for (const auto& [type, value, why] :
       {std::array{"string"s, std::string(most_lens_text + 1, 'x'), "longer than 262144"s},
        std::array{"string"s, std::string(std::size_t{8} << 20, 'x'), "longer than 262144"s},
        std::array{"string"s, "fx = 1\0\x1b[2J"s, "is no text"s},
        std::array{"string"s, "\xff\xfe"s, "is no text"s},
        std::array{"float"s, "\0\0\x80\x3f"s, "is no text"s},
        std::array{"lensOfAnother"s, "fx = 1"s, "is no text"s}}) {
    write_with_attribute(path, "frameLens", type, value);
    try {
      read_exr_lens(path);
      ADD_FAILURE() << type << " " << value.size();
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find(path + ": what it notes of its lens"), 0U);
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
    EXPECT_EQ(read_exr(path).width, 4);
    EXPECT_EQ(read_exr_noise(path), std::nullopt);
  }
}

TEST(WriteExr, LeavesNoFileWhenTheDiskIsFull) {
  const auto directory = made::make_temporary_directory();
  const std::string path = directory / "a.exr";
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_IGN);  // then a write beyond the limit fails, as on a full disk
  const rlimit little{10'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  EXPECT_THROW(write_exr(path, make_image(200, 200)), std::runtime_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_TRUE(std::filesystem::is_empty(directory));
}

TEST(WriteExr, RefusesWhatDoesNotFitTogether) {
  const std::string path = made::make_temporary_directory() / "a.exr";
  const HalfImage a = to_half(make_image(4, 4, 1));
  const HalfImage b = to_half(make_image(4, 5, 1));
  using Planes = std::vector<ExrPlanes>;
  EXPECT_THROW(write_exr(path, Planes{}), std::invalid_argument);
  EXPECT_THROW(write_exr(path, Planes{{a, {"A"}}, {b, {"B"}}}), std::invalid_argument);
  EXPECT_THROW(write_exr(path, Planes{{a, {"A", "B"}}}), std::invalid_argument);
  EXPECT_THROW(write_exr(path, Planes{{a, {"A"}}, {a, {"A"}}}), std::invalid_argument);
  EXPECT_THROW(write_exr(path, Planes{{a, {"A"}}}, {.timecode = ExrTimecode{24, 0, 0, 0, false}}),
               std::invalid_argument);
  EXPECT_THROW(write_exr(path, Planes{{a, {"A"}}}, {.frames_per_second = Rational{0, 1}}),
               std::invalid_argument);
  EXPECT_THROW(write_exr(path, make_image(2, 2, 2)), std::invalid_argument);
  EXPECT_THROW(write_exr("/nowhere/a.exr", make_image(2, 2)), std::runtime_error);
}

TEST(ReadExr, GivesXyzAndRec709FilesOfOnePictureTheSameColours) {
  const auto files = made::real_data() / "exr";
  if (!std::filesystem::exists(files)) GTEST_SKIP() << "no real data at " << files;
  const Image a = read_exr(files / "Rec709.exr");
  const Image b = read_exr(files / "XYZ.exr");
  ASSERT_EQ(a.pixels.size(), b.pixels.size());
  double difference = 0;
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    difference += std::abs(static_cast<double>(a.pixels[i] - b.pixels[i]));
    sum += static_cast<double>(a.pixels[i]);
  }
  EXPECT_LT(difference / sum, 1e-3);  // both files are rounded to halves
}

TEST(ReadExr, ReturnsTheDisplayWindow) {
  const auto file = made::real_data() / "exr" / "displaywindow_t05.exr";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no real data at " << file;
  const Image image = read_exr(file);
  ASSERT_EQ(image.width, 340);
  ASSERT_EQ(image.height, 260);
  const std::string theirs = made::make_temporary_directory() / "a.exr";
  ASSERT_EQ(output_of("oiiotool " + file.string() + " --crop 340x260+30+20 --origin +0+0 " +
                      "--fullpixels -d float -o " + theirs),
            "");
  EXPECT_EQ(image.pixels, read_exr(theirs).pixels);
}

TEST(ReadExr, FillsWhatTheDataWindowLeavesOutWithZero) {
  const auto directory = made::make_temporary_directory();
  const std::string source = directory / "source.exr";
  Image image = make_image(4, 6);
  image.pixels.assign(image.pixels.size(), 0.5F);
  write_exr(source, image);
  const std::string shifted = directory / "shifted.exr";
  ASSERT_EQ(output_of("oiiotool " + source + " --origin +3+2 --fullsize 6x4+0+0 -o " + shifted),
            "");
  const Image read = read_exr(shifted);
  ASSERT_EQ(read.width, 6);
  ASSERT_EQ(read.height, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) EXPECT_EQ(read.at(y, x), x >= 3 && y >= 2 ? 0.5F : 0) << x << y;
  }
}

TEST(ReadExr, ReadsTilesGreyAndOtherCompressions) {
  const auto directory = made::make_temporary_directory();
  const std::string source = directory / "source.exr";
  Image image = make_image(70, 90, 1);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = static_cast<float>(i % 100);
  }
  write_exr(source, image);
  for (const char* options : {"--tile 32 16", "--compression zips", "--compression pxr24",
                              "--compression b44", "--compression dwaa"}) {
    const std::string other = directory / "other.exr";
    ASSERT_EQ(output_of("oiiotool " + source + " " + options + " -d half -o " + other), "");
    const Image read = read_exr(other);
    ASSERT_EQ(read.channels, 1);
    ASSERT_EQ(read.pixels.size(), image.pixels.size());
    EXPECT_NEAR(read.at(35, 45), image.at(35, 45), 2) << options;
  }
}

TEST(ReadExr, TurnsLuminanceAndSubsampledChromaIntoRgb) {
  // Written by OpenEXR 3.1.5's RgbaOutputFile (WRITE_YC) from the ramps below; chroma is kept at
  // half resolution in halves.
  const Image image = read_exr(PLATELIGHT_SOURCE_DIR "/tests/data/luminance_chroma.exr");
  ASSERT_EQ(image.width, 24);
  ASSERT_EQ(image.height, 16);
  ASSERT_EQ(image.channels, 3);
  for (int y = 2; y < 14; ++y) {  // the reconstruction filter bends the ramps at the border
    for (int x = 2; x < 22; ++x) {
      EXPECT_NEAR(image.at(y, x, 0), 0.1 + 0.02 * x, 0.02);
      EXPECT_NEAR(image.at(y, x, 1), 0.5, 0.02);
      EXPECT_NEAR(image.at(y, x, 2), 0.9 - 0.03 * y, 0.02);
    }
  }
}

TEST(ReadExr, RefusesEveryBadFileWithItsReason) {
  made::expect_refusals("", ".exr",
                        {{"no_magic.exr", "no OpenEXR file"},
                         {"empty.exr", "no OpenEXR file"},
                         {"truncated.exr", "ends too early"},
                         {"header_only.exr", "ends too early"},
                         {"no_colour_channels.exr", "only: N, Z"},
                         {"subsampled_red.exr", "subsampled"},
                         {"side_of_a_million.exr", "maximum width"},
                         {"picture_of_gigabytes.exr", "ends too early"},
                         {"display_window_inside_out.exr", "display window"},
                         {"display_window_elsewhere.exr", "outside its display window"},
                         {"deep.exr", "deep data"},
                         {"primaries_on_a_line.exr", "no colour space"}},
                        [](const std::string& path) { read_exr(path); });
}

TEST(ReadExr, RefusesDirectoriesMissingFilesAndPicturesOverItsLimit) {
  const auto directory = made::make_temporary_directory();
  EXPECT_THROW(read_exr(directory), std::runtime_error);
  EXPECT_THROW(read_exr(directory / "missing.exr"), std::runtime_error);
  write_exr(directory / "a.exr", make_image(10, 10));
  EXPECT_THROW(read_exr(directory / "a.exr", {.image_bytes = 1199}), std::runtime_error);
  EXPECT_NO_THROW(read_exr(directory / "a.exr", {.image_bytes = 1200}));
}

TEST(ReadExr, OutlivesEveryDamagedSampleInTimeAndMemory) {
  const auto samples = made::real_data() / "exr" / "damaged";
  if (!std::filesystem::exists(samples)) GTEST_SKIP() << "no real data at " << samples;
  int refused = 0;
  for (const auto& entry : std::filesystem::directory_iterator(samples)) {
    const auto start = std::chrono::steady_clock::now();
    try {
      const Image image = read_exr(entry.path());
      EXPECT_EQ(image.pixels.size(), image.index(image.height, 0)) << entry.path();
    } catch (const std::runtime_error& error) {
      const std::string path = entry.path();
      EXPECT_GT(std::string(error.what()).size(), path.size() + 10) << error.what();
      EXPECT_EQ(std::string(error.what()).find(path), 0U) << error.what();
      ++refused;
    }
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5)) << entry.path();
  }
  EXPECT_GT(refused, 100);
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  EXPECT_LT(usage.ru_maxrss, 1 << 20);  // KiB: the largest child
}

TEST(ReadExr, OutlivesDamageAnywhereInEveryCompression) {
  const auto directory = made::make_temporary_directory();
  std::mt19937 random(5);
  for (const auto compression :
       {ExrCompression::none, ExrCompression::rle, ExrCompression::zip, ExrCompression::piz}) {
    const std::string path = directory / "a.exr";
    Image image = make_image(20, 30);
    for (float& value : image.pixels) value = static_cast<float>(random() % 100);
    write_exr(path, image, {.compression = compression});
    std::ifstream file(path, std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(file), {}};
    for (int i = 0; i < 40; ++i) {
      std::string bytes = good;
      for (int flips = 0; flips < 4; ++flips) bytes[random() % bytes.size()] = char(random());
      std::ofstream(path, std::ios::binary) << bytes;
      try {
        const Image read = read_exr(path);
        EXPECT_EQ(read.pixels.size(), read.index(read.height, 0));
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()).find(path), 0U) << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace capture::exr_test
