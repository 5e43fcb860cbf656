// Stills in memory, and PNG files.
#include "capture/still.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>

#include "capture/png.h"

namespace capture {
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

TEST(WritePng, RefusesTexelsOfAnotherSize) {
  EXPECT_THROW(write_png("/tmp/no.png", 2, 2, 3, made_texels(2, 2, 4)), std::invalid_argument);
  EXPECT_THROW(write_png("/tmp/no.png", 0, 2, 3, {}), std::invalid_argument);
}

TEST(WritePng, NamesTheFolderThatIsNotThere) {
  EXPECT_THAT([] { write_png("/no/such/folder/a.png", 1, 1, 1, made_texels(1, 1, 1)); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("/no/such/folder")));
}

}  // namespace
}  // namespace capture
