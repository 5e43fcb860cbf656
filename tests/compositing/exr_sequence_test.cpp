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

namespace compositing {
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

TEST_F(ExrSequenceTest, LeavesTheTimecodeOutWhereTheFileHasNoRoom) {
  const ExrSequence sequence({path("take"), {50, 1}, "none"});
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
}  // namespace compositing
