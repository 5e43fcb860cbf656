// The plate, bit for bit, against another program's decoding and another arithmetic.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "capture/camera.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::plate_test {
namespace {

// A moving test card under noise strong enough that codes go beyond their legal range.
constexpr const char* card =
    "-f lavfi -i \"testsrc2=size=75x53:rate=25:duration=0.12,format=yuv444p,"
    "noise=alls=80:allf=t:all_seed=5,scale=out_range=";

// Expects every frame that we read to be that of the ffmpeg program, in every half.
void expect_same_plate(const std::filesystem::path& clip,
                       const std::string& pixel_format,
                       const independent::Planes& planes) {
  const std::vector<std::uint8_t> raw =
      independent::raw_planes(clip, pixel_format, clip.parent_path());
  ASSERT_GT(raw.size(), 0U);
  ASSERT_EQ(raw.size() % planes.bytes(), 0U);
  const auto camera = open_camera("file:" + clip.string());
  std::size_t frames = 0;
  while (const auto frame = camera->next()) {
    ASSERT_LE((frames + 1) * planes.bytes(), raw.size());
    const HalfImage ours = to_half(*frame->image);
    ASSERT_EQ(ours.width, planes.width);
    ASSERT_EQ(ours.height, planes.height);
    const std::vector<Half> theirs =
        independent::linear_halves(planes, raw.data() + frames * planes.bytes());
    ASSERT_EQ(ours.pixels.size(), theirs.size());
    const auto differs = std::mismatch(ours.pixels.begin(), ours.pixels.end(), theirs.begin());
    ASSERT_EQ(differs.first, ours.pixels.end())
        << camera->info().description << ", frame " << frames << ", value "
        << differs.first - ours.pixels.begin() << ": " << float_from_half(*differs.first)
        << ", not " << float_from_half(*differs.second);
    ++frames;
  }
  EXPECT_EQ(frames, raw.size() / planes.bytes());
}

class Plate : public testing::Test {
 protected:
  std::filesystem::path make(const std::string& name,
                             const std::string& range,
                             const std::string& output_options) {
    const std::filesystem::path clip = directory_ / name;
    independent::ffmpeg(card + range + "\" " + output_options + " '" + clip.string() + "'");
    return clip;
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
};

TEST_F(Plate, IsExactForUntaggedSdVideo) {
  const auto clip = make("sd.mkv", "tv", "-c:v ffv1 -pix_fmt yuv420p");
  expect_same_plate(clip, "yuv420p", {.width = 75, .height = 53, .share_x = 2, .share_y = 2});
}

TEST_F(Plate, IsExactForBt709) {
  const auto clip =
      make("hd.mkv", "tv", "-c:v ffv1 -pix_fmt yuv420p -colorspace bt709 -color_range tv");
  expect_same_plate(
      clip, "yuv420p",
      {.width = 75, .height = 53, .share_x = 2, .share_y = 2, .kr = 0.2126, .kb = 0.0722});
}

TEST_F(Plate, IsExactForUntaggedHdVideo) {
  const std::filesystem::path clip = directory_ / "untagged_hd.mkv";
  independent::ffmpeg(
      "-f lavfi -i \"testsrc2=size=32x578:rate=25:duration=0.04,noise=alls=80\" -c:v ffv1 -pix_fmt "
      "yuv420p '" +
      clip.string() + "'");
  expect_same_plate(
      clip, "yuv420p",
      {.width = 32, .height = 578, .share_x = 2, .share_y = 2, .kr = 0.2126, .kb = 0.0722});
}

TEST_F(Plate, IsExactForMotionJpeg) {
  const auto clip = make("jpeg.avi", "pc", "-c:v mjpeg -q:v 3 -pix_fmt yuvj420p");
  expect_same_plate(
      clip, "yuvj420p",
      {.width = 75, .height = 53, .share_x = 2, .share_y = 2, .full = true, .centred = true});
}

TEST_F(Plate, IsExactForAJpegStill) {
  const auto clip =
      make("still.jpg", "pc", "-c:v mjpeg -q:v 3 -pix_fmt yuvj422p -frames:v 1 -update 1");
  expect_same_plate(clip, "yuvj422p",
                    {.width = 75, .height = 53, .share_x = 2, .full = true, .centred = true});
}

TEST_F(Plate, IsExactForFullRangeH264) {
  const std::filesystem::path clip = directory_ / "full.mp4";
  independent::ffmpeg(
      "-f lavfi -i testsrc2=size=76x54:rate=25:duration=0.4 -vf scale=out_range=pc -c:v libx264 "
      "-pix_fmt yuvj420p -color_range pc -bf 2 '" +
      clip.string() + "'");
  expect_same_plate(clip, "yuvj420p",
                    {.width = 76, .height = 54, .share_x = 2, .share_y = 2, .full = true});
}

TEST_F(Plate, IsExactForTenBits) {
  const auto clip = make("ten.mkv", "tv", "-c:v ffv1 -pix_fmt yuv422p10le");
  expect_same_plate(clip, "yuv422p10le", {.width = 75, .height = 53, .depth = 10, .share_x = 2});
}

TEST_F(Plate, IsExactForRgb) {
  const auto clip = make("rgb.mkv", "tv", "-c:v ffv1 -pix_fmt gbrp");
  expect_same_plate(clip, "gbrp", {.width = 75, .height = 53, .gbr = true});
}

TEST_F(Plate, IsExactForSixteenBitRgb) {
  const auto clip = make("rgb16.mkv", "tv", "-c:v ffv1 -pix_fmt gbrp16le");
  expect_same_plate(clip, "gbrp16le", {.width = 75, .height = 53, .depth = 16, .gbr = true});
}

TEST_F(Plate, IsExactWithoutSubsampling) {
  const auto clip = make("444.mkv", "tv", "-c:v ffv1 -pix_fmt yuv444p");
  expect_same_plate(clip, "yuv444p", {.width = 75, .height = 53});
}

TEST_F(Plate, IsExactForChromaSharedByFour) {
  const auto clip = make("411.mkv", "tv", "-c:v ffv1 -pix_fmt yuv411p");
  expect_same_plate(clip, "yuv411p", {.width = 75, .height = 53, .share_x = 4});
}

// Every format in which a decoder may hand over the same picture gives the same light.
TEST_F(Plate, IsTheSameHoweverTheSamplesArePacked) {
  const auto read = [&](const std::string& format, const std::string& options) {
    const std::filesystem::path clip = directory_ / (format + ".nut");
    independent::ffmpeg(
        "-f lavfi -i testsrc2=size=74x52:rate=25:duration=0.04 -sws_flags "
        "accurate_rnd+full_chroma_int " +
        options + " -c:v rawvideo -pix_fmt " + format + " '" + clip.string() + "'");
    return open_camera(clip.string())->next()->image->pixels;
  };
  const std::string from_420 = "-vf format=yuv420p";
  const std::string from_422 = "-vf format=yuv422p";
  const std::string from_rgb = "-vf format=gbrp";
  EXPECT_EQ(read("nv12", from_420), read("yuv420p", from_420));
  EXPECT_EQ(read("yuyv422", from_422), read("yuv422p", from_422));
  EXPECT_EQ(read("uyvy422", from_422), read("yuv422p", from_422));
  const auto rgb = read("gbrp", from_rgb);
  for (const char* format : {"rgb24", "bgr24", "rgba", "bgra", "argb", "0bgr", "gbrap"}) {
    EXPECT_EQ(read(format, from_rgb), rgb) << format;
  }
  const auto deep = read("gbrp16le", from_rgb);
  EXPECT_EQ(read("rgb48be", from_rgb), deep);
  EXPECT_EQ(read("rgb48le", from_rgb), deep);
}

TEST_F(Plate, ComesBackWithinOneCodeByEveryCurve) {
  const auto clip = make("codes.mkv", "tv", "-c:v ffv1 -pix_fmt yuv420p");
  const independent::Planes planes{.width = 75, .height = 53, .share_x = 2, .share_y = 2};
  const auto raw = independent::raw_planes(clip, "yuv420p", directory_);
  for (const Transfer transfer :
       {Transfer::rec1886, Transfer::srgb, Transfer::rec709_camera, Transfer::linear}) {
    CameraOptions options;
    options.colour.transfer = transfer;
    const HalfImage image = to_half(*open_camera(clip.string(), options)->next()->image);
    const auto code = [](double value) {
      return static_cast<int>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
    };
    for (int y = 0; y < planes.height; ++y) {
      for (int x = 0; x < planes.width; ++x) {
        double rgb[3];
        independent::values_at(planes, raw.data(), x, y, rgb);
        for (int c = 0; c < 3; ++c) {
          const float light = float_from_half(image.pixels[image.index(y, x, c)]);
          ASSERT_NEAR(code(encode(transfer, light)), code(rgb[c]), 1) << name_of(transfer);
        }
      }
    }
  }
}

// Decoding and linearising together, of all threads; only meaningful on a machine at rest.
TEST(PlateInTheLongTests, TakesATenthOfAFrameAt25PerSecond) {
#if PLATELIGHT_FULL_TESTS
  const std::filesystem::path clip = made::real_data() / "video/box.mp4";
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << "no real data";
  const auto camera = open_camera(clip.string());
  const std::clock_t begin = std::clock();
  int frames = 0;
  while (camera->next()) ++frames;
  const double frame_ms = 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / frames;
  RecordProperty("frame_ms", std::to_string(frame_ms));
  EXPECT_LE(frame_ms, 4.0) << "640 x 480, H.264 and sound";
#else
  GTEST_SKIP() << "times are measured in the long tests only";
#endif
}

}  // namespace
}  // namespace capture::plate_test
