// EXR frames as other programs read them.
#include "compositing/exr_sequence.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "take.h"

namespace compositing::exr_sequence_test {
namespace {

using ExrSequenceTest = TakeTest;

// Values of an EXR file as FFmpeg's own reader gives them, plane by plane.
std::vector<float> values_of(const std::string& file, const std::string& format) {
  const std::string raw =
      output_of("ffmpeg -v error -i " + file + " -f rawvideo -pix_fmt " + format + " -");
  std::vector<float> values(raw.size() / sizeof(float));
  std::memcpy(values.data(), raw.data(), values.size() * sizeof(float));
  return values;
}

// Plane planes[c] of the values is channel c of the image.
void expect_same_bits(std::span<const float> values,
                      const capture::HalfImage& image,
                      std::vector<std::size_t> planes) {
  ASSERT_EQ(values.size(), image.pixels.size());
  const std::size_t size = image.pixels.size() / planes.size();
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float value = values[planes[i % planes.size()] * size + i / planes.size()];
    ASSERT_EQ(capture::half_from_float(value), image.pixels[i]) << i;
  }
}

// Any finite halves, denormal and negative ones too.
capture::HalfImage random_halves(int height, int width, int channels, unsigned seed) {
  capture::HalfImage image{height, width, {}, channels};
  image.pixels.resize(static_cast<std::size_t>(height * width * channels));
  std::mt19937 random(seed);
  for (capture::Half& value : image.pixels) {
    value = static_cast<capture::Half>(random() % 0x7c00 | (random() & 1U) << 15U);
  }
  return image;
}

// oiiotool splits colours and matte, FFmpeg gives their values; its planes are G, B, R, A.
TEST_F(ExrSequenceTest, KeepsEveryBitForOtherPrograms) {
  const capture::HalfImage rgba = random_halves(21, 37, 4, 1);
  const capture::HalfImage matte = random_halves(21, 37, 1, 2);
  const std::vector<std::string> compressions{"none", "rle", "zip", "piz"};
  std::string split = "oiiotool --nosoftwareattrib";
  for (const std::string& compression : compressions) {
    const ExrSequence sequence({path(compression), {25, 1}, compression});
    sequence.write(7, rgba, matte, Timecode{});
    const std::string file = path(compression) + "/frame.000007.exr";
    EXPECT_EQ(sequence.path_of(7), file);
    split += " " + file + " --ch R,G,B,A -o " + file + ".rgba.exr";
    split += " " + file + " --ch R=matte,G=matte,B=matte -o " + file + ".matte.exr";
  }
  output_of(split);
  for (const std::string& compression : compressions) {
    const std::string file = path(compression) + "/frame.000007.exr";
    expect_same_bits(values_of(file + ".rgba.exr", "gbrapf32le"), rgba, {2, 0, 1, 3});
    const std::vector<float> mattes = values_of(file + ".matte.exr", "gbrpf32le");
    ASSERT_EQ(mattes.size(), 3U * 21 * 37);
    expect_same_bits(std::span(mattes).first(21 * 37), matte, {0});
  }
}

TEST_F(ExrSequenceTest, SaysChannelsRateAndTimecode) {
  const ExrSequence sequence({path("take"), {30000, 1001}, "none"});
  sequence.write(0, random_halves(21, 37, 4, 1), random_halves(21, 37, 1, 2),
                 Timecode{0, 1, 0, 2, true});
  const std::string info = output_of("oiiotool --info -v " + sequence.path_of(0));
  EXPECT_NE(info.find("37 x   21, 5 channel, half openexr"), std::string::npos) << info;
  EXPECT_NE(info.find("channel list: R, G, B, A, matte"), std::string::npos) << info;
  EXPECT_NE(info.find("framesPerSecond: 30000/1001"), std::string::npos) << info;
  EXPECT_NE(info.find("smpte:TimeCode: 00:01:00:02"), std::string::npos) << info;
}

// The attribute's first 32 bits, found by its name and type in the file itself.
std::uint32_t time_and_flags(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::string name("timeCode\0timecode\0\x08\0\0\0", 22);
  const std::size_t at = bytes.find(name);
  if (at == std::string::npos) return 0;
  std::uint32_t bits = 0;
  std::memcpy(&bits, bytes.data() + at + name.size(), sizeof bits);
  return bits;
}

// SMPTE ST 12-1: frames in bits 0 to 5 as decimal digits, drop-frame bit 6, field mark bit 15 of
// the word for 60 fields.
TEST_F(ExrSequenceTest, CountsPairsOfFramesAtHighRates) {
  const auto bits_of = [&](capture::Rational rate, int frames, bool drop) {
    const ExrSequence sequence({path("take"), rate, "none"});
    sequence.write(0, random_halves(2, 2, 4, 1), random_halves(2, 2, 1, 2),
                   Timecode{0, 0, 1, frames, drop});
    return time_and_flags(sequence.path_of(0));
  };
  constexpr std::uint32_t second = 1U << 8, mark = 1U << 15, drop = 1U << 6;
  EXPECT_EQ(bits_of({50, 1}, 48, false), second | 0x24U);
  EXPECT_EQ(bits_of({50, 1}, 49, false), second | 0x24U | mark);
  EXPECT_EQ(bits_of({60000, 1001}, 59, true), second | 0x29U | mark | drop);
  EXPECT_EQ(bits_of({48, 1}, 1, false), second | mark);
  EXPECT_EQ(bits_of({30, 1}, 29, false), second | 0x29U) << "no pairs";
}

TEST_F(ExrSequenceTest, LeavesTheTimecodeOutWhereTheFileHasNoRoom) {
  const ExrSequence sequence({path("take"), {90, 1}, "none"});
  sequence.write(0, random_halves(2, 2, 4, 1), random_halves(2, 2, 1, 2), Timecode{0, 0, 0, 49});
  const std::string info = output_of("oiiotool --info -v " + sequence.path_of(0));
  EXPECT_EQ(info.find("TimeCode"), std::string::npos) << info;
}

TEST_F(ExrSequenceTest, RefusesUnknownCompressionAndFoldersThatCannotBe) {
  EXPECT_THROW(ExrSequence({path("take"), {25, 1}, "jpeg"}), std::invalid_argument);
  EXPECT_FALSE(fs::exists(path("take")));
  std::ofstream(path("file")) << "x";
  EXPECT_THROW(ExrSequence({path("file"), {25, 1}, "none"}), std::runtime_error);
  EXPECT_THROW(ExrSequence({path("file/deeper"), {25, 1}, "none"}), std::runtime_error);
}

}  // namespace
}  // namespace compositing::exr_sequence_test
