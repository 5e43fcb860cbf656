// Stills in memory, and PNG files.
#include "capture/still.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>

#include "capture/files.h"
#include "capture/linearise.h"
#include "capture/png.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::still_test {
namespace {

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name)
      : path_(std::filesystem::path(testing::TempDir()) /
              ("platelight_still_" + std::to_string(std::random_device{}()) + "_" + name)) {}
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::vector<std::byte> bytes() const {
    std::ifstream file(path_, std::ios::binary);
    const std::vector<char> chars{std::istreambuf_iterator<char>(file), {}};
    std::vector<std::byte> bytes(chars.size());
    std::transform(chars.begin(), chars.end(), bytes.begin(), [](char c) { return std::byte(c); });
    return bytes;
  }

 private:
  std::filesystem::path path_;
};

std::vector<std::uint8_t> made_texels(int width, int height, int channels) {
  std::mt19937 random(7);
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(width * height * channels));
  for (std::uint8_t& texel : texels) {
    texel = static_cast<std::uint8_t>(random());
  }
  return texels;
}

TEST(DecodeStill8, ReadsBackEveryTexelOfAWrittenPng) {
  for (const int channels : {3, 4}) {
    const TemporaryFile file("round_trip.png");
    const std::vector<std::uint8_t> texels = made_texels(37, 19, channels);
    write_png(file.path(), 37, 19, channels, texels);
    const Still8 still = decode_still8(file.bytes(), "round_trip.png");
    EXPECT_EQ(still.width, 37);
    EXPECT_EQ(still.height, 19);
    EXPECT_EQ(still.channels, channels);
    EXPECT_EQ(still.texels, texels);
  }
}

TEST(DecodeStill8, MakesRgbOfGrey) {
  const TemporaryFile file("grey.png");
  const std::vector<std::uint8_t> texels = made_texels(5, 4, 1);
  write_png(file.path(), 5, 4, 1, texels);
  const Still8 still = decode_still8(file.bytes(), "grey.png");
  ASSERT_EQ(still.texels.size(), texels.size() * 3);
  for (std::size_t i = 0; i < texels.size(); ++i) {
    EXPECT_EQ(still.texels[3 * i], texels[i]);
    EXPECT_EQ(still.texels[3 * i + 2], texels[i]);
  }
}

// PNG, third edition, 11.3.4.3: pixels in a unit across, then down, four bytes each.
TEST(WritePng, TellsTheShapeOfPixels) {
  for (const Rational aspect : {Rational{1, 1}, Rational{4, 3}, Rational{64, 45}}) {
    const TemporaryFile file("shape.png");
    write_png(file.path(), 5, 4, 1, made_texels(5, 4, 1), aspect);
    const std::vector<std::byte> bytes = file.bytes();
    constexpr std::array name{std::byte{'p'}, std::byte{'H'}, std::byte{'Y'}, std::byte{'s'}};
    const auto chunk = std::search(bytes.begin(), bytes.end(), name.begin(), name.end());
    ASSERT_NE(chunk, bytes.end());
    const auto number = [&](int at) {
      std::int64_t value = 0;
      for (int i = 0; i < 4; ++i) value = 256 * value + std::to_integer<int>(chunk[at + i]);
      return value;
    };
    EXPECT_EQ(number(4) * aspect.num, number(8) * aspect.den) << aspect.num << ":" << aspect.den;
    EXPECT_GT(number(4), 0);
  }
}

TEST(DecodeStill8, RefusesATruncatedPng) {
  const TemporaryFile file("whole.png");
  write_png(file.path(), 64, 64, 3, made_texels(64, 64, 3));
  std::vector<std::byte> bytes = file.bytes();
  for (const std::size_t keep : {bytes.size() / 2, std::size_t{20}, std::size_t{8}}) {
    EXPECT_THROW(decode_still8(std::span(bytes).first(keep), "half.png"), std::runtime_error)
        << keep;
  }
}

TEST(DecodeStill8, NamesWhatItRefuses) {
  const std::vector<std::byte> text(100, std::byte{'a'});
  EXPECT_THAT([&] { decode_still8(text, "letter.png"); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("letter.png")));
  EXPECT_THROW(decode_still8({}, "empty.png"), std::runtime_error);
}

const std::map<std::string, std::string> bad_pngs{{"checksum_wrong.png", "CRC mismatch"},
                                                  {"empty.png", ""},
                                                  {"no_pixels.png", "is the file whole"},
                                                  {"no_rows.png", "is the file whole"},
                                                  {"picture_of_gigabytes.png", "cannot read"},
                                                  {"side_of_a_million.png", "cannot read"},
                                                  {"text.png", ""},
                                                  {"truncated.png", "is the file whole"}};
const std::map<std::string, std::string> bad_jpegs{{"header_only.jpg", "is the file whole"},
                                                   {"no_huffman_table.jpg", "cannot read"},
                                                   {"truncated.jpg", "cut short"}};

TEST(ReadStill, RefusesEveryBadFile) {
  const auto read = [](const std::string& path) { read_still(path, LightCurves{}); };
  made::expect_refusals("", ".png", bad_pngs, read);
  made::expect_refusals("", ".jpg", bad_jpegs, read);
  made::expect_refusals(
      "", ".tif",
      {{"header_only.tif", "is the file whole"}, {"directory_outside.tif", "is the file whole"}},
      read);
}

TEST(DecodeStill8, RefusesEveryBadFile) {
  const auto read = [](const std::string& path) { decode_still8(read_file(path), path); };
  made::expect_refusals("", ".png", bad_pngs, read);
  made::expect_refusals("", ".jpg", bad_jpegs, read);
}

TEST(ReadStill, ReadsTheKindsThatItNames) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string png = (directory / "truth.png").string();
  independent::ffmpeg("-f lavfi -i testsrc2=size=48x32:rate=1:duration=1 -pix_fmt rgb24 '" + png +
                      "'");
  const Still truth = read_still(png, LightCurves{});
  for (const char* name : {"a.tif", "a.bmp", "a.ppm", "a.pam", "a.tga", "a.jp2"}) {
    const std::string path = (directory / name).string();
    independent::ffmpeg("-i '" + png + "' -pix_fmt rgb24 -frames:v 1 -update 1 '" + path + "'");
    EXPECT_TRUE(is_still(path)) << name;
    const Still still = read_still(path, LightCurves{});
    EXPECT_EQ(still.image.width, 48) << name;
    if (std::string(name) != "a.jp2") {
      EXPECT_EQ(still.image.pixels, truth.image.pixels) << name;
    }
  }
}

TEST(ReadStill, ReadsDeepAndGreyAndPalettedPictures) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const auto write = [&](const std::string& name, const std::string& format) {
    const std::string path = (directory / name).string();
    independent::ffmpeg("-f lavfi -i testsrc2=size=48x32:rate=1:duration=1 -pix_fmt " + format +
                        " '" + path + "'");
    return path;
  };
  const std::string deep = write("deep.png", "rgb48be");
  const Still still = read_still(deep, LightCurves{{Transfer::linear}, {}});
  const std::vector<std::uint8_t> raw = independent::raw_planes(deep, "rgb48be", directory);
  for (std::size_t i = 0; i < still.image.pixels.size(); ++i) {
    const int code = 256 * raw[2 * i] + raw[2 * i + 1];
    ASSERT_EQ(still.image.pixels[i], static_cast<float>(code / 65535.0));
  }
  for (const auto& [name, format] :
       {std::pair{"grey.png", "gray"}, std::pair{"grey16.png", "gray16be"},
        std::pair{"greyalpha.png", "ya8"}, std::pair{"bits.png", "monob"},
        std::pair{"whitebits.tif", "monow"}}) {
    const Still grey = read_still(write(name, format), LightCurves{{Transfer::linear}, {}});
    for (std::size_t i = 0; i < grey.image.pixels.size(); i += 3) {
      ASSERT_EQ(grey.image.pixels[i], grey.image.pixels[i + 2]) << name;
    }
    EXPECT_GT(*std::max_element(grey.image.pixels.begin(), grey.image.pixels.end()), 0.85F) << name;
    EXPECT_LT(*std::min_element(grey.image.pixels.begin(), grey.image.pixels.end()), 0.1F) << name;
  }
  const std::string paletted = write("palette.png", "pal8");
  const auto colours = independent::raw_planes(paletted, "rgb24", directory);
  const Still picture = read_still(paletted, LightCurves{{Transfer::linear}, {}});
  for (std::size_t i = 0; i < picture.image.pixels.size(); ++i) {
    ASSERT_EQ(picture.image.pixels[i], static_cast<float>(colours[i] / 255.0));
  }
}

TEST(DecodeStill8, RoundsDeepCodesAndKeepsAlpha) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string path = (directory / "deep.png").string();
  independent::ffmpeg(
      "-f lavfi -i \"testsrc2=size=48x32:rate=1:duration=1,format=rgba,geq=r='r(X,Y)':g='g(X,Y)':"
      "b='b(X,Y)':a='X*5'\" -pix_fmt rgba64be '" +
      path + "'");
  const Still8 still = decode_still8(read_file(path), path);
  const auto raw = independent::raw_planes(path, "rgba64be", directory);
  ASSERT_EQ(still.channels, 4);
  for (std::size_t i = 0; i < still.texels.size(); ++i) {
    const int code = 256 * raw[2 * i] + raw[2 * i + 1];
    ASSERT_EQ(still.texels[i], std::lround(code / 257.0));
  }
}

TEST(WritePng, RefusesTexelsOfAnotherSize) {
  EXPECT_THROW(write_png("/tmp/no.png", 2, 2, 3, made_texels(2, 2, 4)), std::invalid_argument);
  EXPECT_THROW(write_png("/tmp/no.png", 0, 2, 3, {}), std::invalid_argument);
  for (const Rational aspect : {Rational{0, 1}, Rational{1, 0}, Rational{-4, 3}}) {
    EXPECT_THROW(write_png("/tmp/no.png", 1, 1, 1, made_texels(1, 1, 1), aspect),
                 std::invalid_argument);
  }
}

TEST(WritePng, NamesTheFolderThatIsNotThere) {
  EXPECT_THAT([] { write_png("/no/such/folder/a.png", 1, 1, 1, made_texels(1, 1, 1)); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("/no/such/folder")));
}

}  // namespace
}  // namespace capture::still_test
