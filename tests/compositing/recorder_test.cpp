// Takes as other programs see them: ffprobe, ffmpeg and oiiotool read what the recorder wrote.
#include "compositing/recorder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace compositing {
namespace {

namespace fs = std::filesystem;
using Rgb = std::vector<std::uint8_t>;

// A folder that this test alone uses, removed afterwards.
class RecorderTest : public testing::Test {
 protected:
  RecorderTest() {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = fs::path(testing::TempDir()) /
           ("platelight_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    fs::remove_all(dir_);
    fs::create_directories(dir_);
  }
  ~RecorderTest() override { fs::remove_all(dir_); }
  std::string path(const std::string& name) const { return (dir_ / name).string(); }

  fs::path dir_;
};

// What a command writes to its standard output; fails the test if it reports an error.
std::string output_of(const std::string& command) {
  std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return "no " + command;
  std::string text;
  std::array<char, 4096> block{};
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) {
    text.append(block.data(), count);
  }
  EXPECT_EQ(::pclose(pipe), 0) << command << "\n" << text.substr(0, 2000);
  return text;
}

std::string probe(const std::string& file,
                  const std::string& entries,
                  const std::string& more = "-select_streams v:0") {
  std::string text = output_of("ffprobe -v error " + more + " -show_entries " + entries +
                               " -of default=noprint_wrappers=1:nokey=1 " + file);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::vector<double> picture_times_s(const std::string& file) {
  std::istringstream text(probe(file, "frame=best_effort_timestamp_time"));
  std::vector<double> times;
  for (double time = 0; text >> time;) times.push_back(time);
  return times;
}

// A textured picture that moves with n.
std::shared_ptr<const Rgb> textured(int width, int height, std::int64_t n) {
  auto rgb = std::make_shared<Rgb>();
  rgb->reserve(static_cast<std::size_t>(width * height * 3));
  std::minstd_rand random(static_cast<unsigned>(n + 1));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double wave =
            std::sin(0.05 * (x + 4.0 * static_cast<double>(n)) + c) + std::cos(0.07 * y - c);
        const int noise = static_cast<int>(random() % 8);
        rgb->push_back(static_cast<std::uint8_t>(124 + 60 * wave + noise));
      }
    }
  }
  return rgb;
}

std::shared_ptr<const Rgb> flat(int width, int height, int grey) {
  return std::make_shared<Rgb>(static_cast<std::size_t>(width * height * 3),
                               static_cast<std::uint8_t>(grey));
}

RecordedFrame picture(std::int64_t number, std::shared_ptr<const Rgb> rgb) {
  RecordedFrame frame;
  frame.number = number;
  frame.display_rgb8 = std::move(rgb);
  return frame;
}

RecorderSettings small_take(const std::string& file) {
  RecorderSettings settings;
  settings.file = file;
  settings.rate = {25, 1};
  settings.width = 64;
  settings.height = 48;
  return settings;
}

RecorderStatus record(const RecorderSettings& settings, std::vector<RecordedFrame> frames) {
  Recorder recorder(settings);
  for (RecordedFrame& frame : frames) {
    recorder.wait_for_room();
    recorder.push(std::move(frame));
  }
  recorder.close();
  return recorder.status();
}

TEST_F(RecorderTest, WritesEveryFrameAtTheRateWithItsTimecode) {
  const std::string file = path("take.mkv");
  RecorderSettings settings = small_take(file);
  settings.rate = {30000, 1001};
  settings.start = Timecode{1, 0, 59, 28, true};
  std::vector<RecordedFrame> frames;
  for (int n = 0; n < 45; ++n) frames.push_back(picture(n, textured(64, 48, n)));
  const RecorderStatus status = record(settings, std::move(frames));
  EXPECT_EQ(status.written, 45);
  EXPECT_EQ(status.dropped, 0);
  EXPECT_EQ(status.error, "");
  EXPECT_GT(status.worst_write_s, 0);

  EXPECT_EQ(probe(file, "stream=nb_read_frames", "-count_frames -select_streams v:0"), "45");
  EXPECT_EQ(probe(file, "stream=r_frame_rate,avg_frame_rate"), "30000/1001\n30000/1001");
  EXPECT_EQ(probe(file, "stream=codec_name,width,height,pix_fmt"), "h264\n64\n48\nyuv420p");
  EXPECT_EQ(probe(file, "stream=color_range,color_space,color_transfer,color_primaries"),
            "tv\nbt709\nbt709\nbt709");
  EXPECT_EQ(probe(file, "stream_tags=timecode"), "01:00:59;28");
  EXPECT_EQ(probe(file, "format_tags=timecode", ""), "01:00:59;28");
  EXPECT_NEAR(std::stod(probe(file, "format=duration", "")), 45 * 1.001 / 30, 0.002);
  const std::vector<double> times = picture_times_s(file);
  ASSERT_EQ(times.size(), 45U);
  for (std::size_t n = 0; n < times.size(); ++n) {
    EXPECT_NEAR(times[n], static_cast<double>(n) * 1.001 / 30, 0.0006);
  }
}

TEST_F(RecorderTest, LeavesAGapWhereFramesAreLeftOut) {
  const std::string file = path("take.mkv");
  std::vector<RecordedFrame> frames;
  for (const int n : {100, 101, 105, 106}) frames.push_back(picture(n, textured(64, 48, n)));
  record(small_take(file), std::move(frames));
  const std::vector<double> times = picture_times_s(file);
  ASSERT_EQ(times.size(), 4U);
  EXPECT_NEAR(times[0], 0.0, 0.0006);
  EXPECT_NEAR(times[1], 0.04, 0.0006);
  EXPECT_NEAR(times[2], 0.20, 0.0006);
  EXPECT_NEAR(times[3], 0.24, 0.0006);
}

TEST_F(RecorderTest, KeepsEveryBitInALosslessTake) {
  for (const auto& [width, height] : {std::pair{64, 48}, {33, 17}, {1, 1}}) {
    const std::string file = path("take.mkv");
    RecorderSettings settings = small_take(file);
    settings.width = width;
    settings.height = height;
    settings.codec = "lossless";
    std::vector<RecordedFrame> frames;
    Rgb all;
    for (int n = 0; n < 12; ++n) {
      frames.push_back(picture(n, textured(width, height, n)));
      all.insert(all.end(), frames.back().display_rgb8->begin(), frames.back().display_rgb8->end());
    }
    record(settings, std::move(frames));
    const std::string raw =
        output_of("ffmpeg -v error -i " + file + " -f rawvideo -pix_fmt rgb24 -");
    ASSERT_EQ(raw.size(), all.size());
    EXPECT_EQ(std::memcmp(raw.data(), all.data(), all.size()), 0) << width << "x" << height;
  }
}

TEST_F(RecorderTest, KeepsColoursInH264) {
  const std::string file = path("take.mkv");
  std::vector<RecordedFrame> frames;
  const std::array<std::array<int, 3>, 4> colours{
      {{200, 40, 30}, {20, 180, 60}, {30, 60, 210}, {128, 128, 128}}};
  for (std::size_t n = 0; n < colours.size(); ++n) {
    auto rgb = std::make_shared<Rgb>();
    for (int i = 0; i < 64 * 48; ++i) {
      for (const int value : colours[n]) rgb->push_back(static_cast<std::uint8_t>(value));
    }
    frames.push_back(picture(static_cast<std::int64_t>(n), rgb));
  }
  record(small_take(file), std::move(frames));
  const std::string raw = output_of("ffmpeg -v error -i " + file + " -f rawvideo -pix_fmt rgb24 -");
  ASSERT_EQ(raw.size(), 4U * 64 * 48 * 3);
  for (std::size_t n = 0; n < colours.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto value = static_cast<std::uint8_t>(raw[(n * 64 * 48 + 24 * 64 + 32) * 3 + c]);
      EXPECT_NEAR(value, colours[n][c], 4) << n << c;
    }
  }
}

// A made clap: one white picture, and a click at the very time of it.
TEST_F(RecorderTest, KeepsAClapInSync) {
  constexpr int rate = 48000;
  constexpr int clap_frame = 31;
  for (const bool with_drops : {false, true}) {
    const std::string file = path("take.mkv");
    RecorderSettings settings = small_take(file);
    settings.rate = {30000, 1001};
    settings.sound_channels = 2;
    settings.sound_rate = rate;
    const capture::Time start = std::chrono::milliseconds(1234);  // the source was running before
    const auto time_of = [&](std::int64_t n) {
      return start + capture::time_of_frame(n, settings.rate);
    };
    const auto sample_at = [&](capture::Time time) {
      return static_cast<std::int64_t>(
          std::llround(1e-9 * rate * static_cast<double>(time.count())));
    };
    const std::int64_t click = sample_at(time_of(clap_frame));
    std::vector<RecordedFrame> frames;
    for (int n = 0; n < 60; ++n) {
      if (with_drops && n > 5 && n < 20) continue;
      RecordedFrame frame = picture(n, flat(64, 48, n == clap_frame ? 255 : 16));
      frame.time = time_of(n);
      capture::Sound sound{time_of(n), 2, rate, {}};
      for (std::int64_t s = sample_at(time_of(n)); s < sample_at(time_of(n + 1)); ++s) {
        sound.samples.insert(sound.samples.end(), 2, s >= click && s < click + 48 ? 0.9F : 0.0F);
      }
      frame.sound = std::move(sound);
      frames.push_back(std::move(frame));
    }
    const RecorderStatus status = record(settings, std::move(frames));
    EXPECT_EQ(status.sounds_left_out, 0);

    const std::string stream =
        probe(file, "stream=codec_name,sample_rate,channels", "-select_streams a:0");
    EXPECT_EQ(stream, "pcm_s24le\n48000\n2");
    const std::string sound =
        output_of("ffmpeg -v error -i " + file + " -map a:0 -f s16le -ac 1 -");
    std::size_t heard = 0;
    std::int16_t value = 0;
    for (; heard < sound.size() / 2; ++heard) {
      std::memcpy(&value, sound.data() + heard * 2, 2);
      if (value > 10000) break;
    }
    ASSERT_LT(heard, sound.size() / 2);
    const double heard_s = static_cast<double>(heard) / rate;

    const std::string grey = output_of("ffmpeg -v error -i " + file +
                                       " -fps_mode passthrough -vf scale=1:1 -f rawvideo "
                                       "-pix_fmt gray -");
    const std::vector<double> times = picture_times_s(file);
    ASSERT_EQ(grey.size(), times.size());
    const auto brightest = std::max_element(grey.begin(), grey.end(), [](char a, char b) {
      return static_cast<std::uint8_t>(a) < static_cast<std::uint8_t>(b);
    });
    const double seen_s = times[static_cast<std::size_t>(brightest - grey.begin())];
    EXPECT_NEAR(seen_s, clap_frame * 1.001 / 30, 0.001);
    EXPECT_LE(std::abs(heard_s - seen_s), 0.010) << "heard " << heard_s << " seen " << seen_s;
    EXPECT_LE(std::abs(heard_s - seen_s), 0.002);  // what it is today
  }
}

TEST_F(RecorderTest, KeepsTheSoundOfDroppedFrames) {
  constexpr int rate = 8000;
  const std::string file = path("take.mkv");
  RecorderSettings settings = small_take(file);
  settings.width = 1280;
  settings.height = 720;
  settings.sound_channels = 1;
  settings.sound_rate = rate;
  settings.queue_frames = 1;
  Recorder recorder(settings);
  const auto rgb = textured(1280, 720, 0);
  for (int n = 0; n < 50; ++n) {
    RecordedFrame frame = picture(n, rgb);
    frame.time = capture::time_of_frame(n, settings.rate);
    frame.sound = capture::Sound{frame.time, 1, rate, std::vector<float>(rate / 25, 0.5F)};
    recorder.push(std::move(frame));
  }
  recorder.close();
  EXPECT_GT(recorder.status().dropped, 0);
  const std::string sound = output_of("ffmpeg -v error -i " + file + " -map a:0 -f s16le -");
  EXPECT_EQ(sound.size(), 50U * rate / 25 * 2);
  std::int16_t value = 0;
  for (std::size_t i = 0; i + 1 < sound.size(); i += 2) {
    std::memcpy(&value, sound.data() + i, 2);
    ASSERT_EQ(value, 16384) << i / 2;
  }
}

TEST_F(RecorderTest, NeverBlocksAndCountsWhatItDrops) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.width = 1920;
  settings.height = 1080;
  settings.codec = "lossless";
  settings.queue_frames = 2;
  Recorder recorder(settings);
  const auto rgb = textured(1920, 1080, 0);
  int accepted = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (int n = 0; n < 200; ++n) accepted += recorder.push(picture(n, rgb)) ? 1 : 0;
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  EXPECT_LT(taken.count(), 0.1);  // 200 frames of some 30 ms each would take 6 s
  recorder.close();
  const RecorderStatus status = recorder.status();
  EXPECT_GE(accepted, 2);
  EXPECT_EQ(status.written, accepted);
  EXPECT_EQ(status.dropped, 200 - accepted);
  EXPECT_GT(status.dropped, 150);
  EXPECT_EQ(status.queued, 0);
  EXPECT_FALSE(recorder.push(picture(200, rgb)));
}

TEST_F(RecorderTest, WaitsForRoomWhereTheRunIsNotLive) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.queue_frames = 1;
  std::vector<RecordedFrame> frames;
  for (int n = 0; n < 100; ++n) frames.push_back(picture(n, textured(64, 48, n)));
  const RecorderStatus status = record(settings, std::move(frames));
  EXPECT_EQ(status.written, 100);
  EXPECT_EQ(status.dropped, 0);
}

// The life of a child process: records, and says so once 100 frames are written.
[[noreturn]] void record_until_killed(const RecorderSettings& settings, int pipe) {
  Recorder recorder(settings);
  for (std::int64_t n = 0; recorder.status().error.empty(); ++n) {
    recorder.wait_for_room();
    RecordedFrame frame = picture(n, textured(settings.width, settings.height, n));
    frame.time = capture::time_of_frame(n, settings.rate);
    frame.sound = capture::Sound{frame.time, 1, 8000, std::vector<float>(320, 0.1F)};
    recorder.push(std::move(frame));
    if (recorder.status().written >= 100 && ::write(pipe, "x", 1) != 1) break;
  }
  ::_exit(1);
}

TEST_F(RecorderTest, LeavesAPlayableFileWhenKilled) {
  const std::string file = path("take.mkv");
  RecorderSettings settings = small_take(file);
  settings.width = 160;
  settings.height = 120;
  settings.sound_channels = 1;
  settings.sound_rate = 8000;
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe(pipe.data()), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) record_until_killed(settings, pipe[1]);
  ::close(pipe[1]);
  char ready = 0;
  EXPECT_EQ(::read(pipe[0], &ready, 1), 1);
  ::close(pipe[0]);
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));

  const int frames =
      std::stoi(probe(file, "stream=nb_read_frames", "-count_frames -select_streams v:0"));
  EXPECT_GE(frames, 100 - 13 - 1);  // half a second is still in memory
  EXPECT_EQ(probe(file, "stream_tags=timecode"), "00:00:00:00");
  output_of("ffmpeg -v error -xerror -i " + file + " -f null -");
}

// The limit on a file's size stands for a full disk: write() fails in the same way.
TEST_F(RecorderTest, StopsCleanlyWhenTheDiskIsFull) {
  for (const char* codec : {"h264", "lossless"}) {
    const std::string file = path(std::string(codec) + ".mkv");
    RecorderSettings settings = small_take(file);
    settings.width = 160;
    settings.height = 120;
    settings.codec = codec;
    settings.sound_channels = 1;
    settings.sound_rate = 8000;
    struct rlimit before {};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = ::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit limited { 1'500'000, before.rlim_max };
    ::setrlimit(RLIMIT_FSIZE, &limited);
    RecorderStatus status;
    {
      Recorder recorder(settings);
      int n = 0;
      for (; n < 2000 && recorder.status().error.empty(); ++n) {
        recorder.wait_for_room();
        RecordedFrame frame = picture(n, textured(160, 120, n));
        frame.time = capture::time_of_frame(n, settings.rate);
        frame.sound = capture::Sound{frame.time, 1, 8000, std::vector<float>(320, 0.1F)};
        recorder.push(std::move(frame));
      }
      recorder.wait_for_room();
      EXPECT_FALSE(recorder.push(picture(n, textured(160, 120, n))));  // the show goes on
      recorder.close();
      status = recorder.status();
      EXPECT_EQ(status.written + status.dropped, n + 1);
    }
    ::setrlimit(RLIMIT_FSIZE, &before);
    ::signal(SIGXFSZ, handler);

    EXPECT_NE(status.error.find(file), std::string::npos) << status.error;
    EXPECT_NE(status.error.find("File too large"), std::string::npos) << status.error;
    EXPECT_LE(fs::file_size(file), 1'500'000U);
    EXPECT_GT(fs::file_size(file), 700'000U);
    const std::int64_t frames =
        std::stoll(probe(file, "stream=nb_read_frames", "-count_frames -select_streams v:0"));
    EXPECT_GE(frames, 20) << codec;
    EXPECT_LE(frames, status.written + 1);
    const double duration_s = std::stod(probe(file, "format=duration", ""));
    EXPECT_NEAR(duration_s, static_cast<double>(frames) / 25, 1.1) << codec;
    EXPECT_EQ(output_of("ffmpeg -v error -xerror -i " + file + " -f null -"), "");
    // No packet lies behind the hole that the lost ones left.
    std::istringstream packets(probe(file, "packet=pts_time"));
    for (std::int64_t n = 0; n < frames; ++n) {
      double time_s = -1;
      packets >> time_s;
      ASSERT_NEAR(time_s, static_cast<double>(n) / 25, 0.001) << codec;
    }
    packets >> std::ws;
    EXPECT_TRUE(packets.eof()) << codec;
    if (settings.codec != "lossless") continue;
    const std::string raw =
        output_of("ffmpeg -v error -i " + file + " -f rawvideo -pix_fmt rgb24 -");
    const std::size_t size = 160 * 120 * 3;
    ASSERT_EQ(raw.size(), static_cast<std::size_t>(frames) * size);
    for (std::int64_t n = 0; n < frames; ++n) {
      const auto at = static_cast<std::size_t>(n) * size;
      ASSERT_EQ(std::memcmp(raw.data() + at, textured(160, 120, n)->data(), size), 0) << n;
    }
  }
}

// Values of an EXR file's channels as FFmpeg reads them, plane by plane.
std::vector<float> channel_values(const std::string& file,
                                  const std::string& channels,
                                  const std::string& format) {
  const std::string split = file + ".split.exr";
  output_of("oiiotool " + file + " --ch " + channels + " -o " + split);
  const std::string raw =
      output_of("ffmpeg -v error -i " + split + " -f rawvideo -pix_fmt " + format + " -");
  fs::remove(split);
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

TEST_F(RecorderTest, WritesExrFramesBitForBitForOtherPrograms) {
  RecorderSettings settings;
  settings.exr_dir = path("take");
  settings.rate = {30000, 1001};
  settings.width = 37;
  settings.height = 21;
  settings.start = Timecode{0, 0, 59, 28, true};
  std::mt19937 random(9);
  std::vector<std::shared_ptr<const capture::HalfImage>> pictures;
  std::vector<std::shared_ptr<const capture::HalfImage>> mattes;
  std::vector<RecordedFrame> frames;
  for (int n = 0; n < 4; ++n) {
    auto rgba = std::make_shared<capture::HalfImage>(
        capture::HalfImage{21, 37, std::vector<capture::Half>(21 * 37 * 4), 4});
    auto matte = std::make_shared<capture::HalfImage>(
        capture::HalfImage{21, 37, std::vector<capture::Half>(21 * 37), 1});
    for (auto* image : {rgba.get(), matte.get()}) {
      for (capture::Half& value : image->pixels) {
        value = static_cast<capture::Half>(random() % 0x7c00 | (random() & 1U) << 15U);
      }
    }
    pictures.push_back(rgba);
    mattes.push_back(matte);
    RecordedFrame frame;
    frame.number = 7 + n;
    frame.rgba = rgba;
    frame.matte = matte;
    frames.push_back(frame);
  }
  EXPECT_EQ(record(settings, std::move(frames)).written, 4);

  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(settings.exr_dir)) {
    names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"frame.000007.exr", "frame.000008.exr",
                                             "frame.000009.exr", "frame.000010.exr"}));
  const std::string first = settings.exr_dir + "/frame.000007.exr";
  const std::string info = output_of("oiiotool --info -v " + first);
  EXPECT_NE(info.find("37 x   21, 5 channel, half"), std::string::npos) << info;
  EXPECT_NE(info.find("R, G, B, A, matte"), std::string::npos) << info;
  EXPECT_NE(info.find("30000/1001"), std::string::npos) << info;
  // oiiotool writes the drop-frame label with colons.
  const std::string third =
      output_of("oiiotool --info -v " + settings.exr_dir + "/frame.000009.exr");
  EXPECT_NE(third.find("00:01:00"), std::string::npos) << third;

  // oiiotool splits the channels, FFmpeg's own reader gives their values: planes G, B, R, A.
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::string name = settings.exr_dir + "/" + names[n];
    expect_same_bits(channel_values(name, "R,G,B,A", "gbrapf32le"), *pictures[n], {2, 0, 1, 3});
    const std::vector<float> matte = channel_values(name, "R=matte,G=matte,B=matte", "gbrpf32le");
    expect_same_bits(std::span(matte).first(21 * 37), *mattes[n], {0});
  }
}

TEST_F(RecorderTest, RecordsWithoutTimecodeWhereTheRateHasNone) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.rate = {120, 1};
  std::vector<RecordedFrame> frames;
  for (int n = 0; n < 5; ++n) frames.push_back(picture(n, textured(64, 48, n)));
  EXPECT_EQ(record(settings, std::move(frames)).written, 5);
  EXPECT_EQ(probe(settings.file, "stream=r_frame_rate"), "120/1");
  EXPECT_EQ(probe(settings.file, "stream_tags=timecode"), "");
  settings.start = Timecode{};
  EXPECT_THROW(Recorder{settings}, std::invalid_argument);
}

TEST_F(RecorderTest, ClosesTheVideoWholeWhenItIsTheExrFramesThatFail) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.exr_dir = path("take");
  Recorder recorder(settings);
  RecordedFrame frame = picture(0, flat(64, 48, 100));
  frame.rgba = std::make_shared<capture::HalfImage>(
      capture::HalfImage{48, 64, std::vector<capture::Half>(48 * 64 * 4), 4});
  frame.matte = std::make_shared<capture::HalfImage>(
      capture::HalfImage{48, 64, std::vector<capture::Half>(48 * 64), 1});
  for (; frame.number < 5; ++frame.number) EXPECT_TRUE(recorder.push(frame));
  while (recorder.status().written < 5) std::this_thread::yield();
  fs::remove_all(settings.exr_dir);
  EXPECT_TRUE(recorder.push(frame));
  recorder.wait_for_room();
  recorder.close();
  const RecorderStatus status = recorder.status();
  EXPECT_NE(status.error.find("frame.000005.exr"), std::string::npos) << status.error;
  EXPECT_EQ(status.written, 5);
  EXPECT_EQ(status.dropped, 1);
  EXPECT_EQ(picture_times_s(settings.file).size(), 6U);
  EXPECT_NEAR(std::stod(probe(settings.file, "format=duration", "")), 0.24, 0.001);
}

TEST_F(RecorderTest, RefusesWhatCannotBeWrittenAtOnceWithPathAndReason) {
  const auto reason = [](const RecorderSettings& settings) -> std::string {
    try {
      const Recorder recorder(settings);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  const std::string missing = path("no/such/folder/take.mkv");
  EXPECT_EQ(reason(small_take(missing)),
            missing + ": cannot be written: No such file or directory");
  fs::create_directories(path("folder.mkv"));
  EXPECT_EQ(reason(small_take(path("folder.mkv"))),
            path("folder.mkv") + ": cannot be written: Is a directory");
  RecorderSettings settings = small_take("");
  std::ofstream(path("file")) << "x";
  settings.exr_dir = path("file");
  EXPECT_NE(reason(settings).find(path("file")), std::string::npos) << reason(settings);
  settings.exr_dir = path("file/deeper");
  EXPECT_NE(reason(settings).find(path("file/deeper")), std::string::npos) << reason(settings);
}

TEST_F(RecorderTest, RefusesHostileSettings) {
  const auto refused = [&](auto change) {
    RecorderSettings settings = small_take(path("take.mkv"));
    change(settings);
    EXPECT_THROW(Recorder{settings}, std::invalid_argument);
    EXPECT_FALSE(fs::exists(path("take.mkv")));
  };
  refused([](RecorderSettings& s) { s.file = ""; });
  refused([](RecorderSettings& s) { s.file += ".mov"; });
  refused([](RecorderSettings& s) { s.rate = {0, 1}; });
  refused([](RecorderSettings& s) { s.rate = {25, 0}; });
  refused([](RecorderSettings& s) { s.rate = {-25, -1}; });
  refused([](RecorderSettings& s) { s.rate = {std::int64_t{25} << 40, std::int64_t{1} << 40}; });
  refused([](RecorderSettings& s) { s.width = 0; });
  refused([](RecorderSettings& s) { s.width = 63; });
  refused([](RecorderSettings& s) { s.height = -48; });
  refused([](RecorderSettings& s) { s.width = 2'000'000'000; });
  refused([](RecorderSettings& s) { s.codec = "h265"; });
  refused([](RecorderSettings& s) { s.crf = 52; });
  refused([](RecorderSettings& s) { s.crf = -1; });
  refused([](RecorderSettings& s) { s.transfer = capture::Transfer::linear; });
  refused([](RecorderSettings& s) { s.queue_frames = 0; });
  refused([](RecorderSettings& s) { s.queue_frames = 1'000'000; });
  refused([](RecorderSettings& s) { s.sound_channels = -1; });
  refused([](RecorderSettings& s) { s.sound_channels = 1; });
  refused([](RecorderSettings& s) { s.start = Timecode{24, 0, 0, 0, false}; });
  refused([](RecorderSettings& s) { s.start = Timecode{0, 0, 0, 0, true}; });
  refused([this](RecorderSettings& s) {
    s.exr_dir = path("take");
    s.exr_compression = "jpeg";
  });
}

TEST_F(RecorderTest, RefusesFramesThatLackWhatIsRecorded) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.exr_dir = path("take");
  Recorder recorder(settings);
  RecordedFrame frame = picture(0, flat(64, 48, 100));
  EXPECT_THROW(recorder.push(frame), std::invalid_argument);
  frame.rgba = std::make_shared<capture::HalfImage>(
      capture::HalfImage{48, 64, std::vector<capture::Half>(48 * 64 * 4), 4});
  EXPECT_THROW(recorder.push(frame), std::invalid_argument);
  frame.matte = std::make_shared<capture::HalfImage>(
      capture::HalfImage{48, 64, std::vector<capture::Half>(48 * 64), 1});
  EXPECT_TRUE(recorder.push(frame));
  EXPECT_THROW(recorder.push(frame), std::invalid_argument);  // the same number again
  frame.number = 1;
  frame.display_rgb8 = flat(62, 48, 100);
  EXPECT_THROW(recorder.push(frame), std::invalid_argument);
  recorder.close();
  EXPECT_EQ(recorder.status().written, 1);
}

}  // namespace
}  // namespace compositing
