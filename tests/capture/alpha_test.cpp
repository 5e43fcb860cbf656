// Alpha of stills, OpenEXR files and videos, where it is asked for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/exr.h"
#include "capture/png.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::alpha_test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

CameraOptions with_alpha(Transfer transfer = Transfer::rec1886) {
  CameraOptions options;
  options.alpha = true;
  options.colour.transfer = transfer;
  return options;
}

class Alpha : public testing::Test {
 protected:
  std::string in(const std::string& name) const { return (directory_ / name).string(); }
  // 21 x 13, of all alphas.
  std::string make(const std::string& name, const std::string& format, const std::string& codec) {
    independent::ffmpeg(
        "-f lavfi -i \"nullsrc=size=21x13:rate=25:duration=0.12,format=rgba,geq="
        "r='12*X':g='19*Y':b='128+40*N':a='mod(X+21*Y+N,256)',format=" +
        format + "\" " + codec + " '" + in(name) + "'");
    return in(name);
  }
  // Expects colour as without alpha, times alpha; returns alpha in codes up to `most`.
  static std::vector<int> codes_in(const Frame& frame, const Frame& without, int most) {
    const Image& image = *frame.image;
    EXPECT_EQ(image.channels, 4);
    EXPECT_EQ(without.image->channels, 3);
    std::vector<int> codes;
    for (std::size_t i = 0; i < image.pixels.size() / 4; ++i) {
      const float alpha = image.pixels[4 * i + 3];
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(image.pixels[4 * i + c], alpha * without.image->pixels[3 * i + c]) << i;
      }
      const auto code = static_cast<int>(std::lround(alpha * static_cast<float>(most)));
      EXPECT_EQ(alpha, static_cast<float>(code) / static_cast<float>(most));
      codes.push_back(code);
    }
    return codes;
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
};

TEST_F(Alpha, OfAPngIsMultipliedInLinearLight) {
  write_png(in("a.png"), 2, 1, 4, std::vector<std::uint8_t>{255, 188, 0, 128, 255, 255, 255, 0});
  const auto camera = open_camera(in("a.png"), with_alpha(Transfer::srgb));
  EXPECT_THAT(camera->info().description, EndsWith("sRGB, alpha"));
  const auto frame = camera->next();
  const std::vector<float>& rgba = frame->image->pixels;
  ASSERT_EQ(rgba.size(), 8U);
  EXPECT_NEAR(rgba[0], 0.50196, 1e-5);
  EXPECT_NEAR(rgba[1], 0.50196 * 0.50289, 1e-5);
  EXPECT_EQ(rgba[2], 0);
  EXPECT_NEAR(rgba[3], 0.50196, 1e-5);
  EXPECT_THAT(std::vector<float>(rgba.begin() + 4, rgba.end()), testing::Each(0));
}

TEST_F(Alpha, ComesOnlyWhereItIsAskedForAndThere) {
  write_png(in("a.png"), 2, 1, 4, std::vector<std::uint8_t>(8, 128));
  EXPECT_EQ(open_camera(in("a.png"))->next()->image->channels, 3);
  write_png(in("b.png"), 2, 1, 3, std::vector<std::uint8_t>(6, 128));
  const auto plain = open_camera(in("b.png"), with_alpha());
  EXPECT_EQ(plain->next()->image->channels, 3);
  EXPECT_THAT(plain->info().description, EndsWith("Rec.1886"));
  write_exr(in("c.exr"), make_image(2, 2, 3));
  EXPECT_EQ(open_camera(in("c.exr"), with_alpha())->next()->image->channels, 3);
}

// Either way round: nobody sees a picture turn from cut out to whole, or back, without being told.
TEST_F(Alpha, OfASequenceIsThatOfItsFirstPicture) {
  for (const int first : {3, 4}) {
    for (const int number : {0, 1, 2}) {
      const int channels = number == 1 ? 7 - first : first;
      write_png(in("s" + std::to_string(number) + ".png"), 1, 1, channels,
                std::vector<std::uint8_t>(static_cast<std::size_t>(channels), 128));
    }
    const auto camera = open_camera(in("s%d.png"), with_alpha());
    const auto good = camera->next(), other = camera->next(), again = camera->next();
    EXPECT_EQ(good->image->channels, first);
    EXPECT_EQ(other->status, FrameStatus::lost);
    EXPECT_EQ(other->image, good->image);
    EXPECT_THAT(other->note, HasSubstr(first == 3 ? "s1.png has alpha" : "s1.png has no alpha"));
    EXPECT_EQ(again->status, FrameStatus::good);
    const auto without = open_camera(in("s%d.png"));
    without->next();
    EXPECT_EQ(without->next()->status, FrameStatus::good) << "nobody asks for it";
  }
}

TEST_F(Alpha, OfDeepAndGreyPngsIsReadInItsOwnCodes) {
  for (const auto& [format, channels, deep] :
       {std::tuple{"rgba64be", 4, true}, {"ya8", 2, false}, {"ya16be", 2, true}}) {
    SCOPED_TRACE(format);
    const std::string file = make(std::string(format) + ".png", format, "-frames:v 1 -update 1");
    const auto raw = independent::raw_planes(file, format, directory_);
    const std::size_t word = deep ? 2 : 1, pixel = word * channels;
    ASSERT_EQ(raw.size(), 21 * 13 * pixel);
    const auto codes = codes_in(*open_camera(file, with_alpha())->next(),
                                *open_camera(file)->next(), deep ? 65535 : 255);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const std::uint8_t* its = &raw[i * pixel + pixel - word];
      ASSERT_EQ(codes[i], deep ? 256 * its[0] + its[1] : its[0]) << i;
    }
  }
}

TEST_F(Alpha, OfOpenExrIsThatOfPremultipliedLightAndLimited) {
  Image image = make_image(1, 4, 4);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  image.pixels = {0.3F, 0.2F, 7, 0.5F, 1, 1, 1, 1.5F, 0.1F, 0, 0, -0.2F, 0.4F, 0, 0, nan};
  write_exr(in("a.exr"), image);
  CameraOptions options = with_alpha(Transfer::srgb);
  const auto camera = open_camera(in("a.exr"), options);
  EXPECT_EQ(camera->info().description, "OpenEXR, linear, alpha");
  const auto light = [&](const Image& of) { return of.pixels; };
  EXPECT_THAT(light(*camera->next()->image),
              testing::ElementsAre(0.3F, 0.2F, 7, 0.5F, 1, 1, 1, 1, 0.1F, 0, 0, 0, 0.4F, 0, 0, 0));
  options.crop = {{1, 0, 1, 1}};
  EXPECT_THAT(light(*open_camera(in("a.exr"), options)->next()->image),
              testing::ElementsAre(1, 1, 1, 1));
  options.alpha = false;
  EXPECT_THAT(light(*open_camera(in("a.exr"), options)->next()->image),
              testing::ElementsAre(1, 1, 1));
}

// Bytes of packed formats, planes of others; alpha is of full range, whatever the colours' is.
TEST_F(Alpha, OfVideosIsThatOfTheFfmpegProgramInEveryCode) {
  struct Clip {
    const char* name;
    const char* format;  // as it is decoded
    const char* codec;
    bool packed;
    int depth;
  };
  for (const Clip& clip :
       {Clip{"a.mkv", "bgra", "-c:v ffv1", true, 8}, Clip{"a.mov", "rgba", "-c:v png", true, 8},
        Clip{"b.mkv", "yuva420p", "-c:v ffv1", false, 8},
        Clip{"b.mov", "yuva444p12le", "-c:v prores_ks", false, 12}}) {
    SCOPED_TRACE(clip.name);
    const std::string wanted = clip.depth > 8 ? "yuva444p10le" : clip.format;
    const std::string file = make(clip.name, wanted, clip.codec);
    const auto raw = independent::raw_planes(file, clip.format, directory_);
    const std::size_t pixels = 21 * 13, word = clip.depth > 8 ? 2 : 1;
    const std::size_t frame_bytes = raw.size() / 3;
    const auto camera = open_camera(file, with_alpha()), without = open_camera(file);
    EXPECT_THAT(camera->info().description, HasSubstr(", alpha"));
    for (std::size_t n = 0; n < 3; ++n) {
      const auto codes = codes_in(*camera->next(), *without->next(), (1 << clip.depth) - 1);
      for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint8_t* frame = &raw[n * frame_bytes];
        const std::uint8_t* its =
            clip.packed ? frame + 4 * i + 3 : frame + frame_bytes - word * (pixels - i);
        ASSERT_EQ(codes[i], word == 2 ? its[0] + 256 * its[1] : its[0]) << n << " " << i;
      }
    }
  }
}

TEST_F(Alpha, OfVp9IsReadThoughItIsAStreamOfItsOwn) {
  const std::string file =
      make("a.webm", "yuva420p", "-c:v libvpx-vp9 -lossless 1 -deadline realtime");
  EXPECT_EQ(open_camera(file)->next()->image->channels, 3);
  CameraOptions options = with_alpha();
  options.loop = true;
  const auto camera = open_camera(file, options);
  for (int n = 0; n < 7; ++n) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->status, FrameStatus::good) << frame->note;
    ASSERT_EQ(frame->image->channels, 4);
    for (int y = 0; y < 13; ++y) {
      for (int x = 0; x < 21; ++x) {
        ASSERT_EQ(frame->image->at(y, x, 3),
                  static_cast<float>((x + 21 * y + n % 3) % 256) / 255.0F);
      }
    }
  }
}

TEST_F(Alpha, IsThatOfACropsPixels) {
  const std::string file = make("a.mkv", "bgra", "-c:v ffv1");
  CameraOptions options = with_alpha();
  const auto whole = open_camera(file, options)->next();
  options.crop = {{5, 3, 7, 9}};
  const auto part = open_camera(file, options)->next();
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 7; ++x) {
      for (int c = 0; c < 4; ++c) {
        ASSERT_EQ(part->image->at(y, x, c), whole->image->at(y + 3, x + 5, c));
      }
    }
  }
}

}  // namespace
}  // namespace capture::alpha_test
