// The sound of video files, in step with their frames.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "capture/camera.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::sound_test {
namespace {

constexpr double flash_s = 0.48;  // frame 12 at 25 fps

// 1.6 s of black with one white frame, and a clap with it: 5 ms of noise.
class Clap : public testing::Test {
 protected:
  std::string make(const std::string& name, const std::string& options, double sound_delay_s = 0) {
    const std::string clip = (directory_ / name).string();
    const std::string clap = "between(t\\," + std::to_string(flash_s - sound_delay_s) + "\\," +
                             std::to_string(flash_s + 0.005 - sound_delay_s) + ")";
    independent::ffmpeg(
        "-f lavfi -i \"color=black:size=64x48:rate=25:duration=1.6,"
        "geq=lum='if(eq(N\\,12)\\,235\\,16)':cb=128:cr=128\" -itsoffset " +
        std::to_string(sound_delay_s) + " -f lavfi -i \"aevalsrc='(random(0)-0.5)*" + clap +
        "':sample_rate=48000:duration=" + std::to_string(1.6 - sound_delay_s) + "\" " + options +
        " '" + clip + "'");
    return clip;
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
};

struct Heard {
  double flash_s = -1;
  double clap_s = -1;
  std::vector<float> samples;
  int rate = 0;
};

// Plays to the end (or so many frames), taking the sound after every frame.
Heard play(Camera& camera, int max_frames = 1000) {
  Heard heard;
  heard.rate = camera.info().sound_rate;
  std::int64_t position = -1;
  const auto take = [&] {
    while (const std::optional<Sound> sound = camera.take_sound()) {
      EXPECT_EQ(sound->channels, camera.info().sound_channels);
      const auto start =
          std::llround(static_cast<double>(sound->time.count()) * 1e-9 * sound->rate);
      EXPECT_TRUE(position < 0 || position == start) << "sound must be continuous";
      for (std::size_t i = 0; i < sound->samples.size(); ++i) {
        const double time_s = static_cast<double>(start) / sound->rate +
                              static_cast<double>(i) / sound->channels / sound->rate;
        if (heard.clap_s < 0 && std::abs(sound->samples[i]) > 0.05F) heard.clap_s = time_s;
      }
      heard.samples.insert(heard.samples.end(), sound->samples.begin(), sound->samples.end());
      position = start + static_cast<std::int64_t>(sound->samples.size()) / sound->channels;
    }
  };
  for (int i = 0; i < max_frames; ++i) {
    const std::optional<Frame> frame = camera.next();
    if (!frame) break;
    const double time_s = static_cast<double>(frame->time.count()) * 1e-9;
    const Image& image = *frame->image;
    const bool flashes = image.at(image.height / 2, image.width / 2, 1) > 0.5F;
    if (heard.flash_s < 0 && flashes) heard.flash_s = time_s;
    take();
    // Up to the frame's time, and no further.
    EXPECT_NEAR(static_cast<double>(position) / heard.rate, time_s, 1.5 / heard.rate);
  }
  take();
  return heard;
}

TEST_F(Clap, IsHeardWhenItIsSeen) {
  for (const auto& [name, codecs] :
       {std::pair{"a.mkv", "-c:v ffv1 -c:a pcm_s16le"},
        std::pair{"a.mp4", "-c:v libx264 -pix_fmt yuv420p -c:a aac -b:a 128k"},
        std::pair{"b.mkv", "-c:v libx264 -pix_fmt yuv420p -c:a libopus"},
        std::pair{"a.mov", "-c:v mjpeg -c:a pcm_s24le"},
        std::pair{"a.avi", "-c:v mpeg4 -c:a pcm_s16le"}}) {
    const auto camera = open_camera(make(name, codecs));
    ASSERT_GT(camera->info().sound_channels, 0) << camera->info().description;
    const Heard heard = play(*camera);
    EXPECT_NEAR(heard.flash_s, flash_s, 1e-9) << name;
    EXPECT_NEAR(heard.clap_s, heard.flash_s, 0.010) << name;
    EXPECT_NEAR(static_cast<double>(heard.samples.size()) /
                    (camera->info().sound_channels * camera->info().sound_rate),
                1.6, 0.001)
        << name << ": as long as the pictures";
  }
}

TEST_F(Clap, IsHeardInTimeThoughTheSoundBeginsLater) {
  for (const auto& [name, codecs] :
       {std::pair{"a.mkv", "-c:v ffv1 -c:a pcm_s16le"},
        std::pair{"a.mp4", "-c:v libx264 -pix_fmt yuv420p -c:a aac"}}) {
    const auto camera = open_camera(make(name, codecs, 0.25));
    const Heard heard = play(*camera);
    EXPECT_NEAR(heard.clap_s, heard.flash_s, 0.010) << name;
    EXPECT_EQ(heard.samples[1000], 0) << "silence until it begins";
  }
}

TEST_F(Clap, ComesAgainInEveryPassOfALoop) {
  CameraOptions options;
  options.loop = true;
  for (const auto& [name, codecs] :
       {std::pair{"a.mkv", "-c:v ffv1 -c:a pcm_s16le"},
        std::pair{"a.ts", "-c:v mpeg2video -c:a mp2"}}) {  // is opened again
    const auto camera = open_camera(make(name, codecs), options);
    const Heard heard = play(*camera, 100);
    const auto loud = [&](double time_s) {
      float most = 0;
      const auto first = static_cast<std::size_t>(time_s * heard.rate);
      for (std::size_t i = first; i < first + 240; ++i) most = std::max(most, heard.samples[i]);
      return most > 0.05F;
    };
    EXPECT_TRUE(loud(flash_s)) << name;
    EXPECT_TRUE(loud(flash_s + 1.6)) << name;
    EXPECT_TRUE(loud(flash_s + 3.2)) << name;
    EXPECT_FALSE(loud(flash_s + 1.0)) << name;
  }
}

TEST_F(Clap, IsInTimeWhenTheFileIsStartedLater) {
  CameraOptions options;
  options.frame = 5;
  const auto camera = open_camera(make("a.mkv", "-c:v ffv1 -c:a pcm_s16le"), options);
  ASSERT_TRUE(camera->next());
  const std::optional<Sound> first = camera->take_sound();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->time, std::chrono::milliseconds(200)) << "none from before the first frame";
  const Heard heard = play(*camera);
  EXPECT_NEAR(heard.clap_s, heard.flash_s, 0.010);
}

// Plays to the end. Where bright pictures begin and where sound does, in seconds.
struct Marks {
  std::vector<double> flashes_s, claps_s;
  double end_s = 0;
};

Marks marks_of(const std::string& clip) {
  const auto camera = open_camera(clip);
  const int rate = camera->info().sound_rate;
  Marks marks;
  double quiet_since_s = -1;
  bool bright = false;
  std::int64_t position = 0;
  while (const std::optional<Frame> frame = camera->next()) {
    marks.end_s = static_cast<double>(frame->time.count()) * 1e-9;
    const bool is_bright = frame->image->at(24, 32, 1) > 0.5F;
    if (is_bright && !bright) marks.flashes_s.push_back(marks.end_s);
    bright = is_bright;
    const auto sound = camera->take_sound();
    if (!sound) continue;
    for (std::size_t i = 0; i < sound->samples.size();
         i += static_cast<std::size_t>(sound->channels)) {
      const double time_s = static_cast<double>(position++) / rate;
      if (std::abs(sound->samples[i]) < 0.05F) continue;
      if (time_s - quiet_since_s > 0.5) marks.claps_s.push_back(time_s);
      quiet_since_s = time_s;
    }
  }
  return marks;
}

void expect_together(const Marks& marks, std::size_t count) {
  ASSERT_EQ(marks.flashes_s.size(), count);
  ASSERT_EQ(marks.claps_s.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_NEAR(marks.claps_s[i], marks.flashes_s[i], 0.04) << i;
  }
}

// Recordings, one behind the other, whose sound ends before the pictures: the stamps of each begin
// anew, and what the sound lacks at the ends must not add up.
TEST_F(Clap, IsHeardInEachOfJoinedRecordings) {
  const std::string one = (directory_ / "one.ts").string();
  independent::ffmpeg(
      "-f lavfi -i \"color=black:size=64x48:rate=25:duration=4,"
      "geq=lum='if(eq(N\\,50)\\,235\\,16)':cb=128:cr=128\" -f lavfi -i "
      "\"aevalsrc='(random(0)-0.5)*between(t\\,2\\,2.02)':sample_rate=48000:duration=3.2\" "
      "-c:v mpeg2video -c:a mp2 '" +
      one + "'");
  const std::string joined = (directory_ / "joined.ts").string();
  std::ofstream all(joined, std::ios::binary);
  for (int i = 0; i < 4; ++i) all << std::ifstream(one, std::ios::binary).rdbuf();
  all.close();
  const Marks marks = marks_of(joined);
  EXPECT_NEAR(marks.end_s, 16, 0.2);
  expect_together(marks, 4);
}

// A jump of one track alone is no join.
TEST_F(Clap, IsInTimeBehindAGapOfMpegsStreams) {
  const auto make_ts = [&](const char* name, const std::string& options) {
    const std::string clip = (directory_ / name).string();
    independent::ffmpeg(
        "-f lavfi -i \"color=black:size=64x48:rate=25:duration=34,"
        "geq=lum='if(eq(N\\,750)\\,235\\,16)':cb=128:cr=128\" -f lavfi -i "
        "\"aevalsrc='(random(0)-0.5)*between(t\\,30\\,30.02)':sample_rate=48000:duration=34\" " +
        options + " '" + clip + "'");
    return clip;
  };
  const Marks still = marks_of(make_ts("still.ts",
                                       "-vf \"select='lt(t\\,5)+gte(t\\,20)'\" -vsync vfr -c:v "
                                       "libx264 -pix_fmt yuv420p -bf 0 -c:a mp2"));
  EXPECT_NEAR(still.end_s, 33.96, 0.1);
  expect_together(still, 1);
  const Marks silent = marks_of(
      make_ts("silent.ts", "-af \"aselect='lt(t\\,5)+gte(t\\,25)'\" -c:v mpeg2video -c:a mp2"));
  expect_together(silent, 1);
}

// As screens are recorded: nothing moves for longer than sound is kept.
TEST_F(Clap, IsHeardBehindAPictureThatStandsForLong) {
  const std::string clip = (directory_ / "still.mkv").string();
  independent::ffmpeg(
      "-f lavfi -i color=black:size=16x16:rate=1/12:duration=36 -f lavfi -i "
      "sine=duration=36:sample_rate=8000 -c:v ffv1 -c:a pcm_s16le '" +
      clip + "'");
  const auto camera = open_camera(clip);
  camera->next();
  std::size_t samples = 0, loud = 0;
  for (Time time{}; time < std::chrono::seconds(24); time += std::chrono::milliseconds(40)) {
    if (time % std::chrono::seconds(12) == Time{}) camera->next();  // one is read ahead
    const auto sound = camera->take_sound(time + std::chrono::milliseconds(40));
    ASSERT_TRUE(sound);
    samples += sound->samples.size();
    loud += static_cast<std::size_t>(
        std::ranges::count_if(sound->samples, [](float s) { return std::abs(s) > 0.01F; }));
  }
  EXPECT_EQ(samples, 8000U * 24 + 1);
  EXPECT_GT(loud, samples * 8 / 10);
}

// More pictures lie before its first sound than may wait in memory.
TEST_F(Clap, IsHeardThoughItBeginsFarBehindInTheFile) {
  const std::string clip = (directory_ / "late.mkv").string();
  independent::ffmpeg(
      "-f lavfi -i color=gray:size=1280x720:rate=25:duration=5 -itsoffset 4 -f lavfi -i "
      "sine=duration=1:sample_rate=8000 -c:v rawvideo -pix_fmt gray -c:a pcm_s16le '" +
      clip + "'");
  ASSERT_GT(std::filesystem::file_size(clip), 100U << 20);
  const auto camera = open_camera(clip);
  const Heard heard = play(*camera);
  EXPECT_NEAR(heard.clap_s, 4, 0.01);
  EXPECT_NEAR(static_cast<double>(heard.samples.size()), 40000, 1);
}

// So few bytes of pictures that more than half a minute of them waits in memory.
TEST_F(Clap, IsHeardThoughItBeginsLateInASmallFile) {
  const std::string clip = (directory_ / "small.mkv").string();
  independent::ffmpeg(
      "-f lavfi -i color=gray:size=64x48:rate=25:duration=50 -itsoffset 45 -f lavfi -i "
      "sine=duration=5:sample_rate=8000 -c:v libx264 -pix_fmt yuv420p -c:a pcm_s16le '" +
      clip + "'");
  const auto camera = open_camera(clip);
  const Heard heard = play(*camera, 2000);
  EXPECT_NEAR(heard.clap_s, 45, 0.01);
}

// 3 s of so much sound that it does not all fit in memory, with a clap at 2.5 s.
std::string make_loud_clip(const std::filesystem::path& directory, int rate, int channels) {
  const std::string raw = (directory / "loud.raw").string();
  const std::int64_t second = std::int64_t{rate} * channels * 2;
  std::ofstream sound(raw, std::ios::binary);
  sound.seekp(second * 5 / 2);
  sound << std::string(static_cast<std::size_t>(second / 200), '\x40');
  sound.close();
  std::filesystem::resize_file(raw, static_cast<std::uintmax_t>(second * 3));
  const std::string clip = (directory / "loud.mkv").string();
  independent::ffmpeg("-f lavfi -i color=black:size=16x16:rate=25:duration=3 -f s16le -ar " +
                      std::to_string(rate) + " -ac " + std::to_string(channels) + " -i '" + raw +
                      "' -c:v ffv1 -c:a copy '" + clip + "'");
  return clip;
}

TEST_F(Clap, IsInTimeBehindMoreSoundThanFitsInMemory) {
  CameraOptions options;
  options.frame = 60;
  const auto camera = open_camera(make_loud_clip(directory_, 768000, 20), options);
  const std::optional<Frame> first = camera->next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->number, 60);
  std::optional<Sound> sound = camera->take_sound();
  ASSERT_TRUE(sound);
  EXPECT_EQ(sound->time, first->time);
  const Heard heard = play(*camera);
  EXPECT_NEAR(heard.clap_s, 2.5, 0.001);
}

TEST_F(Clap, IsBoundedInMemoryWhenNobodyListens) {
  const std::string clip = (directory_ / "long.mkv").string();
  independent::ffmpeg(
      "-f lavfi -i color=black:size=16x16:rate=5:duration=20 -f lavfi -i "
      "sine=duration=20:sample_rate=8000 -c:v ffv1 -c:a pcm_s16le '" +
      clip + "'");
  const auto camera = open_camera(clip);
  while (camera->next()) {
  }
  const std::optional<Sound> rest = camera->take_sound();
  ASSERT_TRUE(rest);
  EXPECT_LE(rest->samples.size(), 8000U * 11);
  EXPECT_GE(rest->samples.size(), 8000U * 9);
}

// A header may name any rate, and memory goes with it.
TEST_F(Clap, IsLeftOutIfItsRateIsNoRecorders) {
  const std::string sound = (directory_ / "sound.raw").string();
  std::ofstream(sound) << std::string(20000, '\0');
  const auto make_at = [&](const std::string& rate) {
    const std::string clip = (directory_ / (rate + ".mkv")).string();
    independent::ffmpeg("-f lavfi -i color=black:size=16x16:rate=5:duration=1 -f s16le -ar " +
                        rate + " -ac 1 -i '" + sound + "' -c:v ffv1 -c:a copy '" + clip + "'");
    return clip;
  };
  EXPECT_EQ(open_camera(make_at("768000"))->info().sound_rate, 768000);
  for (const char* rate : {"768001", "2000000000"}) {
    const auto camera = open_camera(make_at(rate));
    EXPECT_EQ(camera->info().sound_channels, 0);
    EXPECT_THAT(camera->info().description,
                testing::HasSubstr("sound left out: its rate is " + std::string(rate) +
                                   " Hz, above the limit of 768000 Hz"));
    ASSERT_TRUE(camera->next());
    EXPECT_FALSE(camera->take_sound());
  }
}

TEST_F(Clap, DoesNotEndTheVideoIfItIsRefused) {
  const auto camera = open_camera(make_loud_clip(directory_, 768001, 20));
  EXPECT_THAT(camera->info().description, testing::HasSubstr("sound left out"));
  int frames = 0;
  while (camera->next()) ++frames;
  EXPECT_EQ(frames, 75);
}

TEST_F(Clap, OfASilentFileIsNothing) {
  const std::string clip = (directory_ / "silent.mkv").string();
  independent::ffmpeg("-f lavfi -i color=black:size=16x16:rate=5:duration=1 -c:v ffv1 '" + clip +
                      "'");
  const auto camera = open_camera(clip);
  EXPECT_EQ(camera->info().sound_channels, 0);
  ASSERT_TRUE(camera->next());
  EXPECT_FALSE(camera->take_sound());
}

}  // namespace
}  // namespace capture::sound_test
