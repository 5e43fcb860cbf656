// Video files as cameras: counts, times, options, damage.
#include "capture/video_file.h"

#include <gmock/gmock.h>

#include <fstream>
#include <stdexcept>

#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::video_file_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

std::vector<Frame> all_frames(Camera& camera) {
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = camera.next()) frames.push_back(std::move(*frame));
  return frames;
}

class VideoFile : public testing::Test {
 protected:
  std::string make(const std::string& name, const std::string& source, const std::string& options) {
    const std::string clip = (directory_ / name).string();
    independent::ffmpeg("-f lavfi -i \"" + source + "\" " + options + " '" + clip + "'");
    return clip;
  }
  // 20 frames, all different.
  std::string make_clip(const std::string& name, const std::string& options) {
    return make(name, "testsrc2=size=64x48:rate=25:duration=0.8,noise=alls=20:allf=t", options);
  }
  void expect_refusal(const std::string& path,
                      const std::string& words,
                      const CameraOptions& options = {}) {
    try {
      open_camera("file:" + path, options);
      ADD_FAILURE() << path << " was accepted";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(path), HasSubstr(words)));
    }
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
};

TEST_F(VideoFile, CountsAndTimesEveryFrameInEveryContainer) {
  for (const auto& [name, options] :
       {std::pair{"a.mp4", "-c:v libx264 -bf 2"}, std::pair{"a.mkv", "-c:v libx264 -bf 2"},
        std::pair{"a.ts", "-c:v mpeg2video -bf 2"}, std::pair{"a.avi", "-c:v mpeg4"},
        std::pair{"a.webm", "-c:v libvpx -deadline realtime"}, std::pair{"a.mov", "-c:v prores_ks"},
        std::pair{"a.mkv", "-c:v ffv1"}}) {
    const std::string clip =
        make(name, "testsrc2=size=64x48:rate=30000/1001:duration=0.7,format=yuv420p", options);
    const auto camera = open_camera(clip);
    EXPECT_EQ(camera->info().width, 64);
    EXPECT_EQ(camera->info().height, 48);
    EXPECT_EQ(camera->info().rate, (Rational{30000, 1001})) << name;
    EXPECT_NEAR(static_cast<double>(camera->info().frames), 21, 1)
        << name << ": a container may only tell its length";
    const std::vector<Frame> frames = all_frames(*camera);
    ASSERT_EQ(frames.size(), 21U) << name << options;
    for (std::size_t n = 0; n < frames.size(); ++n) {
      const auto number = static_cast<std::int64_t>(n);
      EXPECT_EQ(frames[n].number, number);
      EXPECT_EQ(frames[n].time, time_of_frame(number, {30000, 1001})) << name << " " << n;
      EXPECT_EQ(frames[n].status, FrameStatus::good) << name << ": " << frames[n].note;
    }
    EXPECT_EQ(camera->statistics().delivered, 21);
    EXPECT_EQ(camera->next(), std::nullopt) << "after the end comes nothing";
  }
}

// One that is whole says nothing, whatever its sound is like.
TEST_F(VideoFile, TellsThatAFileIsCutShort) {
  const std::string sound = "-f lavfi -i sine=duration=1 -c:a aac -b:a 32k ";
  for (const auto& [name, options] :
       {std::pair{"a.mp4", "-c:v libx264 -bf 2 -movflags +faststart"},
        std::pair{"a.mkv", "-c:v ffv1"}, std::pair{"b.mkv", "-c:v libx264 -bf 2"},
        std::pair{"a.avi", "-c:v mpeg4"}, std::pair{"a.webm", "-c:v libvpx -deadline realtime"}}) {
    for (const std::string& with : {std::string(), sound}) {
      if (!with.empty() && std::string(name) == "a.webm") continue;  // has no AAC
      const std::string clip = make_clip(name, with + options);
      const auto whole = open_camera(clip);
      all_frames(*whole);
      EXPECT_EQ(whole->statistics().cut_short, "") << name << with;
      std::filesystem::resize_file(clip, std::filesystem::file_size(clip) / 2);
      if (std::string(name) == "a.avi") continue;  // its index is at the end
      for (const bool loop : {false, true}) {
        CameraOptions again;
        again.loop = loop;
        const auto cut = open_camera(clip, again);
        for (int i = 0; i < 25; ++i) cut->next();
        EXPECT_THAT(cut->statistics().cut_short, HasSubstr("s that it tells of are not there"))
            << name << with;
      }
    }
  }
}

// A picture that stands for long at the end is one of a whole file.
TEST_F(VideoFile, TakesALastPictureThatStandsForTheFilesEnd) {
  for (const char* name : {"a.mp4", "a.mkv"}) {
    const std::string clip =
        make(name, "testsrc2=size=64x48:rate=25:duration=0.4,setpts='if(lt(N,9),PTS,PTS+3/TB)'",
             "-fps_mode vfr -c:v libx264 -bf 0");
    const auto camera = open_camera(clip);
    all_frames(*camera);
    EXPECT_EQ(camera->statistics().cut_short, "") << name;
  }
}

// What is passed over is not made, and all the rest is as without.
TEST_F(VideoFile, PassesOverFrames) {
  const std::string clip = make_clip("clip.mp4", "-c:v libx264 -bf 2");
  const std::vector<Frame> all = all_frames(*open_camera(clip));
  ASSERT_EQ(all.size(), 20U);
  const auto camera = open_camera(clip);
  for (const std::size_t n : {0U, 3U, 4U, 11U}) {
    while (camera->statistics().delivered < static_cast<std::int64_t>(n)) {
      EXPECT_TRUE(camera->skip());
    }
    const std::optional<Frame> frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, all[n].number);
    EXPECT_EQ(frame->time, all[n].time);
    EXPECT_EQ(frame->image->pixels, all[n].image->pixels) << n;
  }
  for (int n = 12; n < 20; ++n) EXPECT_TRUE(camera->skip());
  EXPECT_FALSE(camera->skip());
  EXPECT_EQ(camera->next(), std::nullopt);
  EXPECT_EQ(camera->statistics().delivered, 20);
}

TEST_F(VideoFile, TellsTheShapeOfPixelsWhicheverOfItsPartsDoes) {
  const std::string square = make_clip("square.mp4", "-c:v libx264");
  const std::string told = (directory_ / "told.mp4").string();
  independent::ffmpeg("-i '" + square + "' -c copy -aspect 16:9 '" + told + "'");
  const std::string shape = "-vf setsar=4/3 -c:v ";
  for (const std::string& clip :
       {told, make_clip("a.mov", shape + "prores_ks"), make_clip("a.mkv", shape + "ffv1"),
        make_clip("a.ts", shape + "mpeg2video"), make_clip("a.mp4", shape + "libx264")}) {
    EXPECT_EQ(open_camera(clip)->info().pixel_aspect, (Rational{4, 3})) << clip;
  }
  EXPECT_EQ(open_camera(square)->info().pixel_aspect, (Rational{1, 1}));
}

TEST_F(VideoFile, KeepsTheDepthOfAMosaic) {
  constexpr std::uint16_t code = 1000;
  const std::string raw = (directory_ / "codes.raw").string();
  std::ofstream codes(raw, std::ios::binary);
  for (int i = 0; i < 16 * 16; ++i)
    codes << static_cast<char>(code & 0xff) << static_cast<char>(code >> 8);
  codes.close();
  const std::string clip = (directory_ / "mosaic.nut").string();
  independent::ffmpeg(
      "-f rawvideo -pixel_format bayer_rggb16le -video_size 16x16 -framerate 25 -i '" + raw +
      "' -c copy '" + clip + "'");
  const auto camera = open_camera(clip);
  EXPECT_THAT(camera->info().description, HasSubstr("bayer_rggb16le by swscale as rgb48le"));
  const auto frame = camera->next();
  ASSERT_TRUE(frame);
  const double light = decode(Transfer::rec1886, code / 65535.0);
  for (const float value : frame->image->pixels) EXPECT_NEAR(value / light, 1, 1e-3);
}

TEST_F(VideoFile, StartsAtTheFrameThatIsAskedFor) {
  const std::string clip = make_clip("a.mp4", "-c:v libx264 -bf 2 -g 8");
  const auto whole = open_camera(clip);
  const std::vector<Frame> frames = all_frames(*whole);
  for (const std::int64_t start : {0, 1, 7, 19}) {
    CameraOptions options;
    options.frame = start;
    const auto camera = open_camera(clip, options);
    const std::optional<Frame> first = camera->next();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->number, start);
    EXPECT_EQ(first->time, frames[static_cast<std::size_t>(start)].time);
    EXPECT_EQ(first->image->pixels, frames[static_cast<std::size_t>(start)].image->pixels);
  }
}

TEST_F(VideoFile, FindsFarFramesExactlyWhereverItMayJump) {
  for (const auto& [name, codec] :
       {std::pair{"a.mp4", "-c:v libx264 -bf 2 -g 40 -preset ultrafast -c:a aac"},
        std::pair{"b.mp4", "-c:v libx264 -x264-params open-gop=1:bframes=3:keyint=30 -c:a aac"},
        std::pair{"a.mkv", "-c:v libx264 -bf 2 -g 40 -preset ultrafast -c:a pcm_s16le"},
        std::pair{"a.avi", "-c:v mpeg4 -g 30 -c:a pcm_s16le"}}) {
    const std::string clip = make(
        name, "testsrc2=size=32x24:rate=30000/1001:duration=9,noise=alls=30:allf=t,format=yuv420p",
        std::string("-f lavfi -i aevalsrc=t/10:duration=9:sample_rate=8000 ") + codec);
    const std::vector<Frame> frames = all_frames(*open_camera(clip));
    for (const std::int64_t start : {51, 90, 171, 269}) {
      CameraOptions options;
      options.frame = start;
      const auto camera = open_camera(clip, options);
      const std::optional<Frame> first = camera->next();
      ASSERT_TRUE(first) << name;
      EXPECT_EQ(first->number, start);
      EXPECT_EQ(first->time, frames[static_cast<std::size_t>(start)].time);
      EXPECT_EQ(first->image->pixels, frames[static_cast<std::size_t>(start)].image->pixels)
          << name << " at " << start;
      ASSERT_TRUE(start == 269 || camera->next());
      const std::optional<Sound> sound = camera->take_sound();
      ASSERT_TRUE(sound);
      const std::size_t middle = sound->samples.size() / 2;
      const double middle_s = static_cast<double>(sound->time.count()) * 1e-9 +
                              static_cast<double>(middle) / sound->rate;
      if (std::string(codec).find("pcm") != std::string::npos) {
        EXPECT_NEAR(10 * sound->samples[middle], middle_s, 0.002) << "the sound tells its time";
      }
    }
  }
}

TEST_F(VideoFile, RefusesAFrameThatItDoesNotHave) {
  const std::string clip = make_clip("a.mp4", "-c:v libx264");
  CameraOptions options;
  options.frame = 20;
  expect_refusal(clip, "it has 20 frames", options);
  options.frame = -1;
  expect_refusal(clip, "count from 0", options);
}

TEST_F(VideoFile, CropsWithoutMovingChroma) {
  const std::string clip = make_clip("a.mkv", "-c:v ffv1 -pix_fmt yuv420p");
  const auto whole = open_camera(clip)->next();
  CameraOptions options;
  options.crop = {{5, 3, 21, 17}};
  const auto camera = open_camera(clip, options);
  EXPECT_EQ(camera->info().width, 21);
  EXPECT_EQ(camera->info().height, 17);
  const auto part = camera->next();
  for (int y = 0; y < 17; ++y) {
    for (int x = 0; x < 21; ++x) {
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(part->image->at(y, x, c), whole->image->at(y + 3, x + 5, c));
      }
    }
  }
}

TEST_F(VideoFile, RefusesACropOutsideThePicture) {
  const std::string clip = make_clip("a.mkv", "-c:v ffv1");
  for (const std::array<int, 4> crop :
       {std::array{0, 0, 65, 48}, std::array{-1, 0, 5, 5}, std::array{60, 0, 5, 5},
        std::array{0, 0, 0, 5}, std::array{1, 1, 2147483647, 5}}) {
    CameraOptions options;
    options.crop = crop;
    expect_refusal(clip, "is not inside its 64 x 48", options);
  }
}

TEST_F(VideoFile, LoopsWithTimeGoingOn) {
  for (const auto& [name, codec] :
       {std::pair{"a.mp4", "-c:v libx264 -bf 2"}, std::pair{"a.mkv", "-c:v ffv1"},
        std::pair{"a.h264", "-c:v libx264"}, std::pair{"a.ts", "-c:v libx264 -bf 2"},
        std::pair{"b.ts", "-c:v mpeg2video -bf 2 -g 8"},
        std::pair{"a.mpg", "-c:v mpeg2video -bf 2 -g 8"}}) {
    const std::string clip = make_clip(name, codec);
    CameraOptions options;
    options.loop = true;
    const auto camera = open_camera(clip, options);
    std::vector<Frame> frames;
    for (int i = 0; i < 50; ++i) {
      std::optional<Frame> frame = camera->next();
      ASSERT_TRUE(frame);
      frames.push_back(std::move(*frame));
    }
    for (std::size_t n = 0; n < frames.size(); ++n) {
      EXPECT_EQ(frames[n].number, static_cast<std::int64_t>(n));
      EXPECT_EQ(frames[n].pass_first, static_cast<std::int64_t>(n / 20 * 20)) << name;
      EXPECT_EQ(frames[n].time, milliseconds(40 * n)) << name;
      EXPECT_EQ(frames[n].image->pixels, frames[n % 20].image->pixels) << name << " " << n;
    }
  }
}

TEST_F(VideoFile, PlaysAFileThatWasCutShort) {
  const std::string clip = make_clip("a.mkv", "-c:v ffv1");
  std::filesystem::resize_file(clip, std::filesystem::file_size(clip) / 2);
  const auto camera = open_camera(clip);
  const std::vector<Frame> frames = all_frames(*camera);
  EXPECT_GT(frames.size(), 5U);
  EXPECT_LT(frames.size(), 20U);
  for (const Frame& frame : frames) EXPECT_NE(frame.image, nullptr);
}

TEST_F(VideoFile, CountsDamageAndPlaysOn) {
  const std::string clip =
      make_clip("a.avi", "-c:v ffv1 -level 3 -slicecrc 1 -g 1 -pix_fmt yuv420p");
  std::vector<std::uint8_t> bytes = independent::read_bytes(clip);
  const auto whole = all_frames(*open_camera(clip));
  for (std::size_t i = bytes.size() / 3; i < bytes.size() / 3 + 200; ++i) bytes[i] ^= 0x5a;
  std::ofstream(clip, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  const auto camera = open_camera(clip);
  const std::vector<Frame> frames = all_frames(*camera);
  EXPECT_EQ(frames.size(), whole.size());
  const CameraStatistics statistics = camera->statistics();
  EXPECT_GE(statistics.lost + statistics.damaged, 1);
  EXPECT_LE(statistics.lost + statistics.damaged, 4);
  std::size_t same = 0;
  for (std::size_t n = 0; n < std::min(frames.size(), whole.size()); ++n) {
    EXPECT_EQ(frames[n].note.empty(), frames[n].status == FrameStatus::good);
    same += frames[n].image->pixels == whole[n].image->pixels ? 1 : 0;
  }
  EXPECT_GE(same, frames.size() - 4) << "one place is damaged, not the rest";
}

TEST_F(VideoFile, ShowsThePictureBeforeInPlaceOfALostOne) {
  // A JPEG whose packet is garbage cannot be decoded at all.
  const std::string clip = make_clip("a.avi", "-c:v mjpeg -q:v 2");
  std::vector<std::uint8_t> bytes = independent::read_bytes(clip);
  const auto whole = all_frames(*open_camera(clip));
  int picture = 0;
  for (std::size_t i = 0; i + 3 < bytes.size(); ++i) {
    if (bytes[i] == 0xff && bytes[i + 1] == 0xd8 && bytes[i + 2] == 0xff && picture++ == 7) {
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(i), 700, std::uint8_t{0});
    }
  }
  ASSERT_EQ(picture, 20);
  std::ofstream(clip, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  const auto camera = open_camera(clip);
  const std::vector<Frame> frames = all_frames(*camera);
  ASSERT_EQ(frames.size(), 20U);
  EXPECT_EQ(camera->statistics().lost, 1);
  EXPECT_EQ(frames[7].status, FrameStatus::lost);
  EXPECT_EQ(frames[7].image, frames[6].image);
  EXPECT_THAT(frames[7].note, HasSubstr("could not be decoded"));
  EXPECT_EQ(frames[8].image->pixels, whole[8].image->pixels);
  EXPECT_EQ(frames[8].time, milliseconds(320));
}

TEST_F(VideoFile, LosesPicturesOfAnotherSizeInTheMiddle) {
  const std::string clip =
      make("a.ts", "testsrc2=size=64x48:rate=25:duration=0.2", "-c:v mpeg2video");
  const std::string other = make("b.ts", "testsrc2=size=96x80:rate=25:duration=0.2",
                                 "-c:v mpeg2video -output_ts_offset 0.2");
  const std::vector<std::uint8_t> more = independent::read_bytes(other);
  std::ofstream(clip, std::ios::binary | std::ios::app)
      .write(reinterpret_cast<const char*>(more.data()), static_cast<std::streamsize>(more.size()));
  const auto camera = open_camera(clip);
  const std::vector<Frame> frames = all_frames(*camera);
  // The decoder may give up a picture where one stream turns into the other.
  ASSERT_GE(frames.size(), 9U);
  for (std::size_t n = 0; n < frames.size(); ++n) {
    EXPECT_EQ(frames[n].image->width, 64);
    EXPECT_TRUE(n > 3 || frames[n].status == FrameStatus::good) << n;
    EXPECT_TRUE(n < 6 || frames[n].status == FrameStatus::lost) << n;
  }
  EXPECT_THAT(frames[6].note, HasSubstr("size changed to 96 x 80"));
  EXPECT_GE(camera->statistics().lost, 3);
}

TEST_F(VideoFile, RefusesWhatIsNoVideo) {
  const std::string text = (directory_ / "letter.mp4").string();
  std::ofstream(text) << "Dear Sir,\nthis is not a film.\n";
  expect_refusal(text, "is the file whole");
  const std::string notes = (directory_ / "notes.txt").string();
  std::ofstream(notes) << "Text that libav would draw as a picture.\n";
  expect_refusal(notes, "cannot open");
  const std::string list = (directory_ / "list.m3u8").string();
  std::ofstream(list) << "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\n/etc/passwd\n";
  expect_refusal(list, "cannot open");
  const std::string empty = (directory_ / "empty.mp4").string();
  std::ofstream{empty};
  expect_refusal(empty, "it is empty");
  expect_refusal((directory_ / "missing.mp4").string(), "no such file");
  expect_refusal(directory_.string(), "replay:");
  expect_refusal("/dev/zero", "not a plain file");
}

TEST(OpenVideoFile, RefusesEveryBadFile) {
  const auto open = [](const std::string& path) { open_camera("file:" + path); };
  made::expect_refusals("", ".mp4",
                        {{"empty.mp4", "it is empty"},
                         {"text.mp4", "is the file whole"},
                         {"index_cut.mp4", "cannot open"},
                         {"index_missing.mp4", "moov atom not found"}},
                        open);
  made::expect_refusals("", ".mkv", {{"only_sound.mkv", "there is no video in it"}}, open);
  made::expect_refusals("", ".avi", {{"side_of_100000.avi", "cannot open"}}, open);
}

TEST_F(VideoFile, RefusesSoundWithoutPictures) {
  const std::string clip = make("a.wav", "sine=duration=0.2", "");
  expect_refusal(clip, "no video in it");
}

TEST_F(VideoFile, RefusesAnMp4WithoutItsIndex) {
  const std::string clip = make_clip("a.mp4", "-c:v libx264");
  std::filesystem::resize_file(clip, std::filesystem::file_size(clip) / 2);
  expect_refusal(clip, "moov atom not found");
}

TEST_F(VideoFile, RefusesCurvesOfHighDynamicRange) {
  const std::string clip = make_clip(
      "hdr.mkv", "-c:v ffv1 -pix_fmt yuv420p10le -color_trc smpte2084 -colorspace bt2020nc");
  expect_refusal(clip, "smpte2084");
}

TEST_F(VideoFile, TellsThePixelAspectAsTheContainerDoes) {
  for (const auto& [name, codec] : {std::pair{"a.mkv", "-c:v ffv1"}, {"a.mp4", "-c:v libx264"}}) {
    const auto camera = open_camera(make_clip(name, std::string("-vf setsar=2 ") + codec));
    EXPECT_EQ(camera->info().pixel_aspect, (Rational{2, 1})) << name;
  }
}

TEST_F(VideoFile, TakesLinearVideoAsLinear) {
  const std::string clip = make_clip("linear.mkv", "-c:v ffv1 -pix_fmt gbrp -color_trc linear");
  const auto raw = independent::raw_planes(clip, "gbrp", directory_);
  const auto frame = open_camera(clip)->next();
  EXPECT_EQ(frame->image->at(0, 0, 1), static_cast<float>(raw[0] / 255.0));
}

TEST_F(VideoFile, SurvivesRandomDamageEverywhere) {
  const std::vector<std::uint8_t> whole =
      independent::read_bytes(make_clip("a.mp4", "-c:v libx264 -bf 2 -g 10"));
  std::uint32_t random = 12345;
  const auto next_random = [&] { return random = random * 1664525U + 1013904223U; };
  int opened = 0;
  for (int round = 0; round < 60; ++round) {
    std::vector<std::uint8_t> bytes = whole;
    for (int hit = 0; hit < 1 + round; ++hit) {
      bytes[next_random() % bytes.size()] = static_cast<std::uint8_t>(next_random() >> 24);
    }
    const std::string clip = (directory_ / "damaged.mp4").string();
    std::ofstream(clip, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    try {
      const auto camera = open_camera(clip);
      ++opened;
      int frames = 0;
      while (const auto frame = camera->next()) {
        ASSERT_LT(++frames, 1000);
      }
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(clip));
    }
  }
  EXPECT_GT(opened, 10);
}

TEST(VideoFileOnRealData, PlaysTheDamagedBoxToItsEnd) {
  const std::filesystem::path clip = made::real_data() / "video/box.mp4";
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << "no real data";
  CameraOptions options;
  options.crop = {{0, 0, 8, 8}};
  const auto camera = open_camera(clip.string(), options);
  EXPECT_EQ(camera->info().rate, (Rational{30000, 1001}));
  EXPECT_EQ(camera->info().frames, 456);
  // The container's edit list leaves the 456th out.
  const std::vector<Frame> frames = all_frames(*camera);
  ASSERT_EQ(frames.size(), 455U);
  EXPECT_EQ(frames[0].status, FrameStatus::damaged);
  EXPECT_EQ(camera->statistics().damaged, 1);
  EXPECT_EQ(camera->statistics().lost, 0);
  // Its stamps stray by up to 3 ms, and are in decoding order.
  for (std::size_t n = 0; n < frames.size(); ++n) {
    ASSERT_EQ(frames[n].time, time_of_frame(static_cast<std::int64_t>(n), {30000, 1001}));
  }
}

TEST(VideoFileOnRealData, PlaysTheStreet) {
  const std::filesystem::path clip = made::real_data() / "video/vtest20.avi";
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << "no real data";
  const auto camera = open_camera(clip.string());
  EXPECT_EQ(camera->info().width, 768);
  EXPECT_EQ(camera->info().height, 576);
  EXPECT_EQ(camera->info().rate, (Rational{10, 1}));
  EXPECT_THAT(camera->info().description, HasSubstr("BT.601 (untagged) limited"));
  std::int64_t frames = 0;
  while (const auto frame = camera->next()) {
    ASSERT_EQ(frame->status, FrameStatus::good) << frame->note;
    ASSERT_EQ(frame->time, milliseconds(100 * frames));
    ++frames;
  }
  EXPECT_EQ(frames, 200);
}

}  // namespace
}  // namespace capture::video_file_test
