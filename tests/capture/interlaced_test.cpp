// Interlaced video: pictures made whole, one for one.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/video_file.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::interlaced_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Deinterlace = std::optional<bool>;

// From 50 moments a second to 25 frames of two fields, the upper one first.
const std::string fields = "tinterlace=interleave_top,setfield=tff";
const std::string marked = " -flags +ilme+ildct -top 1 ";
// A grey and orange edge that moves 5 pixels from moment to moment, on blue.
const std::string moving_edge =
    "color=c=0x2040c0:size=96x64:rate=50:duration=1[b];color=c=0xd0a060:size=30x200:rate=50:"
    "duration=1[f];[b][f]overlay=x=mod(5*n\\,120)-30:y=-20:format=yuv444";

std::vector<Frame> all_frames(Camera& camera) {
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = camera.next()) frames.push_back(std::move(*frame));
  return frames;
}

std::unique_ptr<Camera> open(const std::string& clip,
                             Deinterlace deinterlace = {},
                             CameraOptions options = {}) {
  options.deinterlace = deinterlace;
  return open_camera("file:" + clip, options);
}

std::vector<Frame> frames_of(const std::string& clip, Deinterlace deinterlace = {}) {
  return all_frames(*open(clip, deinterlace));
}

// The largest step from one row to the next.
float comb_of(const Image& image) {
  float most = 0;
  for (int y = 0; y + 1 < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        most = std::max(most, std::abs(image.at(y, x, c) - image.at(y + 1, x, c)));
      }
    }
  }
  return most;
}

double rms_between(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double by = a.pixels[i] - b.pixels[i];
    sum += by * by;
  }
  return std::sqrt(sum / static_cast<double>(a.pixels.size()));
}

// All but the pictures.
void expect_same_frames(const std::vector<Frame>& these,
                        const std::vector<Frame>& those,
                        const std::string& what) {
  ASSERT_EQ(these.size(), those.size()) << what;
  for (std::size_t n = 0; n < these.size(); ++n) {
    EXPECT_EQ(these[n].number, those[n].number) << what << " " << n;
    EXPECT_EQ(these[n].time, those[n].time) << what << " " << n;
    EXPECT_EQ(these[n].status, those[n].status) << what << " " << n;
    EXPECT_EQ(these[n].note, those[n].note) << what << " " << n;
  }
}

void expect_same_pictures(const std::vector<Frame>& these,
                          const std::vector<Frame>& those,
                          const std::string& what) {
  ASSERT_EQ(these.size(), those.size()) << what;
  for (std::size_t n = 0; n < these.size(); ++n) {
    EXPECT_TRUE(these[n].image->pixels == those[n].image->pixels) << what << " " << n;
  }
}

class Interlaced : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return (directory_ / name).string(); }
  std::string make(const std::string& name,
                   const std::string& source,
                   const std::string& filter,
                   const std::string& options) {
    independent::ffmpeg("-filter_complex \"" + source + "," + filter + "\" " + options + " '" +
                        at(name) + "'");
    return at(name);
  }
  // 25 frames of noise and much that moves.
  std::string make_busy(const std::string& name,
                        const std::string& options,
                        const std::string& format = "yuv420p",
                        const std::string& size = "64x48") {
    return make(
        name, "testsrc2=size=" + size + ":rate=50:duration=1,noise=alls=20:allf=t,format=" + format,
        fields + ",setsar=4/3,format=" + format, options + marked + "-pix_fmt " + format);
  }
  void join(const std::string& name, const std::vector<std::string>& parts) {
    std::ofstream whole(at(name), std::ios::binary);
    for (const std::string& part : parts) {
      whole << std::ifstream(at(part), std::ios::binary).rdbuf();
    }
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
};

// The truth is the moment of the first field. Errors are of light, whose white is 1.
TEST_F(Interlaced, AMovingEdgeHasNoCombAndIsWhereItWasAtTheFirstField) {
  for (const std::string order : {"tff", "bff"}) {
    const std::string top = order == "tff" ? "1" : "0";
    const std::string woven = order == "tff" ? "tinterlace=interleave_top,setfield=tff"
                                             : "tinterlace=interleave_bottom,setfield=bff";
    const std::string truth = make(order + "_truth.mkv", moving_edge,
                                   "format=yuv420p,select=not(mod(n\\,2))", "-r 25 -c:v ffv1");
    const std::vector<Frame> true_frames = frames_of(truth);
    for (const auto& [name, options] :
         {std::pair{"a.mkv", "-c:v ffv1"}, std::pair{"a.ts", "-c:v mpeg2video -q:v 1 -bf 2"},
          std::pair{"a.mp4", "-c:v libx264 -qp 4 -bf 2"}}) {
      const std::string clip = make(order + name, moving_edge, "format=yuv420p," + woven,
                                    std::string(options) + " -flags +ilme+ildct -top " + top +
                                        (order == "bff" ? " -x264-params bff=1" : ""));
      const std::vector<Frame> whole = frames_of(clip), mixed = frames_of(clip, false);
      ASSERT_EQ(whole.size(), 25U) << clip;
      ASSERT_EQ(true_frames.size(), 25U);
      float comb = 0, comb_of_mixed = 0;
      double error = 0, error_of_mixed = 0;
      for (std::size_t n = 0; n < whole.size(); ++n) {
        comb = std::max(comb, comb_of(*whole[n].image));
        comb_of_mixed = std::max(comb_of_mixed, comb_of(*mixed[n].image));
        error = std::max(error, rms_between(*whole[n].image, *true_frames[n].image));
        error_of_mixed =
            std::max(error_of_mixed, rms_between(*mixed[n].image, *true_frames[n].image));
      }
      EXPECT_GT(comb_of_mixed, 0.3F) << clip << ": else it tries nothing";
      EXPECT_LT(comb, 0.08F) << clip;
      EXPECT_LT(error, 0.01) << clip;
      EXPECT_GT(error_of_mixed, 0.05) << clip;
    }
  }
}

// Every bit is that of the ffmpeg program's own filter.
TEST_F(Interlaced, IsWhatTheFfmpegProgramMakesOfIt) {
  for (const auto& [format, size] :
       {std::pair{"yuv420p", "64x48"}, std::pair{"yuv420p", "63x45"}, std::pair{"yuv422p", "64x48"},
        std::pair{"yuv422p10le", "64x50"}, std::pair{"yuv444p", "33x21"},
        std::pair{"yuv411p", "64x48"}, std::pair{"gbrp10le", "64x48"}, std::pair{"gray", "64x48"},
        std::pair{"yuva420p", "64x48"}, std::pair{"yuv420p", "6x8"}}) {
    const std::string clip = make_busy("a.mkv", "-c:v ffv1", format, size);
    independent::ffmpeg("-i '" + clip + "' -vf bwdif=send_frame:auto:interlaced -c:v ffv1 '" +
                        at("b.mkv") + "'");
    const std::string what = std::string(format) + " " + size;
    const std::vector<Frame> whole = frames_of(clip);
    ASSERT_EQ(whole.size(), 25U) << what;
    expect_same_pictures(whole, frames_of(at("b.mkv"), false), what);
    EXPECT_NE(whole[4].image->pixels, frames_of(clip, false)[4].image->pixels) << what;
  }
}

TEST_F(Interlaced, HasTheNumbersTimesAndTagsThatItHasAsItIs) {
  for (const auto& [name, options] :
       {std::pair{"a.mkv", "-c:v libx264 -bf 2 -colorspace bt2020nc -color_range pc"},
        std::pair{"b.mkv", "-c:v ffv1"}, std::pair{"a.ts", "-c:v mpeg2video -bf 2"},
        std::pair{"b.ts", "-c:v libx264 -bf 2"}, std::pair{"a.mp4", "-c:v libx264 -bf 2"},
        std::pair{"a.mov", "-c:v prores_ks"}, std::pair{"a.mxf", "-c:v mpeg2video -bf 2"},
        std::pair{"a.avi", "-c:v mpeg2video"}}) {
    const std::string format = std::string(name) == "a.mov" ? "yuv422p10le" : "yuv420p";
    const std::string clip = make_busy(name, options, format);
    const auto whole = open(clip), mixed = open(clip, false);
    EXPECT_EQ(whole->info().rate, mixed->info().rate) << name;
    EXPECT_EQ(whole->info().frames, mixed->info().frames) << name;
    EXPECT_EQ(whole->info().pixel_aspect, mixed->info().pixel_aspect) << name;
    EXPECT_NE(whole->info().pixel_aspect, (Rational{1, 1})) << name;
    std::string read_as = mixed->info().description;
    const std::string left = "(taken as it is)";
    read_as.replace(read_as.find(left), left.size(), "(deinterlaced)");
    EXPECT_EQ(whole->info().description, read_as);
    const std::vector<Frame> frames = all_frames(*whole);
    EXPECT_GE(frames.size(), 24U) << name;
    expect_same_frames(frames, all_frames(*mixed), name);
    EXPECT_EQ(whole->statistics().cut_short, mixed->statistics().cut_short);
    EXPECT_EQ(whole->next(), std::nullopt) << "after the end comes nothing";
    EXPECT_NE(frames[4].image->pixels, frames_of(clip, false)[4].image->pixels) << name;
  }
}

TEST_F(Interlaced, HasTheSoundThatItHasAsItIs) {
  for (const auto& [name, codec] : {std::pair{"a.ts", "-c:v mpeg2video -bf 2 -c:a mp2"},
                                    std::pair{"a.mov", "-c:v libx264 -bf 2 -c:a pcm_s16le"}}) {
    const std::string clip =
        make(name, "sine=duration=1;testsrc2=size=64x48:rate=50:duration=1,format=yuv420p", fields,
             codec + marked);
    CameraOptions looping;
    looping.loop = true;
    const auto whole = open(clip, {}, looping), mixed = open(clip, false, looping);
    std::size_t samples = 0;
    for (int n = 0; n < 60; ++n) {
      EXPECT_EQ(whole->next()->time, mixed->next()->time);
      const std::optional<Sound> sound = whole->take_sound(), same = mixed->take_sound();
      ASSERT_EQ(sound.has_value(), same.has_value()) << name << " " << n;
      if (!sound) continue;
      EXPECT_EQ(sound->time, same->time) << name << " " << n;
      EXPECT_TRUE(sound->samples == same->samples) << name << " " << n;
      samples += sound->samples.size();
    }
    EXPECT_GT(samples, 44100U) << name;
  }
}

TEST_F(Interlaced, IsTheSameWhereverItStartsAndHoweverOftenItLoops) {
  for (const auto& [name, options] :
       {std::pair{"a.mp4", "-c:v libx264 -bf 2 -g 12"}, std::pair{"a.mkv", "-c:v ffv1"},
        std::pair{"a.ts", "-c:v mpeg2video -bf 2 -g 12"},
        std::pair{"a.mov", "-c:v libx264 -bf 2 -g 12"}}) {
    const std::string clip =
        make(name, "testsrc2=size=64x48:rate=50:duration=6,noise=alls=20:allf=t,format=yuv420p",
             fields, options + marked);
    const std::vector<Frame> all = frames_of(clip);
    ASSERT_EQ(all.size(), 150U) << name;
    for (const int start : {1, 2, 49, 51, 60, 61, 72, 73, 120, 148, 149}) {
      CameraOptions options_there;
      options_there.frame = start;
      const auto camera = open(clip, {}, options_there);
      for (std::size_t n = static_cast<std::size_t>(start); n < all.size(); ++n) {
        const std::optional<Frame> frame = camera->next();
        ASSERT_TRUE(frame) << name << " " << start;
        EXPECT_EQ(frame->number, all[n].number);
        EXPECT_EQ(frame->time, all[n].time);
        ASSERT_EQ(frame->image->pixels, all[n].image->pixels)
            << name << " from " << start << ", " << n;
      }
      EXPECT_EQ(camera->next(), std::nullopt);
    }
    CameraOptions looping;
    looping.loop = true;
    const auto camera = open(clip, {}, looping);
    for (std::size_t n = 0; n < 2 * all.size() + 5; ++n) {
      const std::optional<Frame> frame = camera->next();
      ASSERT_TRUE(frame);
      ASSERT_EQ(frame->image->pixels, all[n % all.size()].image->pixels) << name << " " << n;
    }
    const auto skipping = open(clip);
    for (std::size_t n = 0; n < all.size(); ++n) {
      if (n % 7 < 3) {
        EXPECT_TRUE(skipping->skip());
      } else {
        ASSERT_EQ(skipping->next()->image->pixels, all[n].image->pixels) << name << " " << n;
      }
    }
  }
}

TEST_F(Interlaced, WhatIsNotMarkedStaysAsItIs) {
  for (const auto& [name, options] :
       {std::pair{"a.mp4", "-c:v libx264 -bf 2"}, std::pair{"a.ts", "-c:v mpeg2video -bf 2"},
        std::pair{"a.mkv", "-c:v ffv1"}}) {
    const std::string clip =
        make(name, "testsrc2=size=64x48:rate=25:duration=1,noise=alls=20:allf=t,format=yuv420p",
             "null", options);
    const auto camera = open(clip), plain = open(clip, false);
    EXPECT_THAT(camera->info().description, Not(HasSubstr("interlaced")));
    EXPECT_EQ(camera->info().doubt, "");
    EXPECT_EQ(camera->info().description, plain->info().description);
    const std::vector<Frame> frames = all_frames(*camera), same = all_frames(*plain);
    expect_same_frames(frames, same, name);
    expect_same_pictures(frames, same, name);
    // The ffmpeg program's planes are those of `same` by Plate's tests.
  }
}

// As where a programme and its advertisements follow each other.
TEST_F(Interlaced, OnlyMarkedPicturesOfAFileAreChanged) {
  const std::string coding = "-c:v mpeg2video -q:v 2 -bf 2 -g 6";
  make("still.ts", "testsrc2=size=64x48:rate=25:duration=0.4,format=yuv420p", "null", coding);
  make_busy("moving.ts", coding);
  join("both.ts", {"still.ts", "moving.ts", "still.ts"});
  const std::vector<Frame> whole = frames_of(at("both.ts")),
                           mixed = frames_of(at("both.ts"), false);
  expect_same_frames(whole, mixed, "both.ts");
  // The decoder drops the last picture before each join.
  ASSERT_EQ(whole.size(), 43U);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const bool is_changed = whole[n].image->pixels != mixed[n].image->pixels;
    EXPECT_EQ(is_changed, n >= 9 && n < 33) << n;
  }
}

// A hostile or joined file may become one of another size or format.
TEST_F(Interlaced, GoesOnWhereSizeOrFormatChange) {
  const std::string coding = "-c:v mpeg2video -q:v 2 -bf 2 -g 6";
  make_busy("a.ts", coding);
  make_busy("b.ts", coding, "yuv420p", "80x32");
  make_busy("c.ts", coding, "yuv422p");
  join("all.ts", {"a.ts", "b.ts", "c.ts", "b.ts", "a.ts"});
  const std::vector<Frame> whole = frames_of(at("all.ts"));
  expect_same_frames(whole, frames_of(at("all.ts"), false), "all.ts");
  ASSERT_GT(whole.size(), 100U);
  const std::vector<Frame> first = frames_of(at("a.ts"));
  EXPECT_EQ(whole[5].image->pixels, first[5].image->pixels);
  EXPECT_EQ(whole.back().status, FrameStatus::good);
  EXPECT_EQ(whole.back().image->pixels, first.back().image->pixels);
}

TEST_F(Interlaced, LosesAndDamagesTheFramesThatItDoesAsItIs) {
  for (const auto& [name, options] : {std::pair{"a.avi", "-c:v ffv1 -level 3 -slicecrc 1 -g 1"},
                                      std::pair{"a.ts", "-c:v mpeg2video -bf 2 -g 6"}}) {
    const std::string clip = make_busy(name, options);
    std::vector<std::uint8_t> bytes = independent::read_bytes(clip);
    for (std::size_t part = 2; part < 6; ++part) {
      const std::size_t begin = bytes.size() * part / 7;
      for (std::size_t i = begin; i < begin + 300; ++i) bytes[i] ^= 0x5a;
    }
    std::ofstream(clip, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    const auto whole = open(clip), mixed = open(clip, false);
    expect_same_frames(all_frames(*whole), all_frames(*mixed), name);
    EXPECT_EQ(whole->statistics().lost, mixed->statistics().lost) << name;
    EXPECT_EQ(whole->statistics().damaged, mixed->statistics().damaged) << name;
    EXPECT_GT(whole->statistics().lost + whole->statistics().damaged, 0) << name;
  }
}

// What cameras and capture cards write without a codec.
TEST_F(Interlaced, PackedSamplesAreAsThoseInPlanes) {
  for (const auto& [packed, planes] :
       {std::pair{"uyvy422", "yuv422p"}, std::pair{"yuyv422", "yuv422p"},
        std::pair{"nv12", "yuv420p"}, std::pair{"rgb24", "gbrp"}, std::pair{"bgr24", "gbrp"},
        std::pair{"bgr0", "gbrp"}}) {
    for (const std::string size : {"64x48", "66x46", "63x45"}) {
      const std::string in_planes = make_busy("planes.nut", "-c:v rawvideo", planes, size);
      independent::ffmpeg("-i '" + in_planes + "' -c:v rawvideo -pix_fmt " + packed + " '" +
                          at("a.nut") + "'");
      const auto camera = open(at("a.nut"), true);
      EXPECT_THAT(camera->info().description, HasSubstr("deinterlaced")) << packed;
      expect_same_pictures(all_frames(*camera), frames_of(in_planes, true), packed + (" " + size));
    }
  }
}

TEST_F(Interlaced, IsLeftAsItIsOrForcedWhereItIsSaid) {
  const std::string is_marked = make_busy("a.mkv", "-c:v ffv1");
  const std::string is_not = at("b.mkv");
  independent::ffmpeg("-i '" + is_marked + "' -vf setfield=prog -c:v ffv1 '" + is_not + "'");
  expect_same_pictures(frames_of(is_not), frames_of(is_marked, false), "not marked");
  expect_same_pictures(frames_of(is_not, true), frames_of(is_marked), "forced");
  EXPECT_EQ(open(is_not)->info().doubt, "");
  EXPECT_EQ(open(is_not, true)->info().doubt, "");
  EXPECT_THAT(open(is_not, true)->info().description, HasSubstr("interlaced (deinterlaced)"));
  EXPECT_EQ(open(is_marked, false)->info().doubt, "");
  EXPECT_THAT(open(is_marked, false)->info().description, HasSubstr("interlaced (taken as it is)"));
  EXPECT_THAT(open(is_marked)->info().description, HasSubstr("interlaced (deinterlaced)"));
  EXPECT_THAT(open(is_marked)->info().doubt,
              AllOf(HasSubstr("is deinterlaced"), HasSubstr("deinterlace = false keeps all rows")));
}

// They have rows of one moment already.
TEST_F(Interlaced, LeavesSingleFieldsAsTheyAre) {
  const std::string clip = make("a.mkv", "testsrc2=size=64x48:rate=50:duration=0.4", "null",
                                "-c:v libx265 -x265-params interlace=tff:log-level=none");
  const auto camera = open(clip);
  EXPECT_THAT(camera->info().description, HasSubstr("single fields (taken as they are)"));
  EXPECT_THAT(camera->info().doubt, HasSubstr("ffmpeg -vf weave,bwdif"));
  expect_same_pictures(all_frames(*camera), frames_of(clip, false), clip);
}

TEST_F(Interlaced, SaysWhatCannotBeDeinterlaced) {
  make_busy("a.mkv", "-c:v ffv1", "gray10le");
  make_busy("b.mkv", "-c:v ffv1", "yuv420p", "16x2");
  for (const auto& [name, what] : {std::pair{"a.mkv", "pictures of gray10le, 64 x 48, cannot be"},
                                   std::pair{"b.mkv", "pictures of yuv420p, 16 x 2, cannot be"}}) {
    for (const Deinterlace deinterlace : {Deinterlace(), Deinterlace(true)}) {
      const auto camera = open(at(name), deinterlace);
      EXPECT_THAT(camera->info().description, HasSubstr("interlaced (taken as it is)"));
      EXPECT_THAT(camera->info().doubt, AllOf(HasSubstr(what), HasSubstr("deinterlace it first")));
      expect_same_pictures(all_frames(*camera), frames_of(at(name), false), name);
    }
  }
}

}  // namespace
}  // namespace capture::interlaced_test
