// Takes as other programs see them: ffprobe and ffmpeg read what the recorder wrote.
#include "compositing/recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "capture/camera.h"
#include "take.h"

namespace compositing::recorder_test {
namespace {

using RecorderTest = TakeTest;

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

TEST_F(RecorderTest, TellsTheShapeOfItsPixels) {
  for (const char* codec : {"h264", "lossless"}) {
    const std::string file = path(std::string(codec) + ".mkv");
    RecorderSettings settings = small_take(file);
    settings.codec = codec;
    settings.pixel_aspect = {4, 3};
    std::vector<RecordedFrame> frames;
    for (int n = 0; n < 3; ++n) frames.push_back(picture(n, textured(64, 48, n)));
    record(settings, std::move(frames));
    EXPECT_EQ(probe(file, "stream=sample_aspect_ratio"), "4:3") << codec;
    EXPECT_EQ(capture::open_camera(file)->info().pixel_aspect, (capture::Rational{4, 3})) << codec;
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

TEST_F(RecorderTest, NamesExrFramesByTheirNumbers) {
  RecorderSettings settings = small_take("");
  settings.exr_dir = path("take");
  settings.start = Timecode{0, 0, 59, 23};
  std::vector<RecordedFrame> frames;
  for (const int n : {7, 8, 11}) frames.push_back(half_picture(n, 64, 48));
  EXPECT_EQ(record(settings, std::move(frames)).written, 3);
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(settings.exr_dir)) {
    names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names,
            (std::vector<std::string>{"frame.000007.exr", "frame.000008.exr", "frame.000011.exr"}));
  const std::string info = output_of("oiiotool --info -v " + settings.exr_dir + "/" + names[2]);
  EXPECT_NE(info.find("smpte:TimeCode: 00:01:00:02"), std::string::npos) << info;
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
  recorder.close();
  const RecorderStatus status = recorder.status();
  // Waiting for the disk would take 200 times this; measured, since machines are busy or slow.
  const double write_s = status.write_s / static_cast<double>(status.written);
  EXPECT_LT(taken.count(), 200 * write_s / 10);
  EXPECT_GE(accepted, 2);
  EXPECT_EQ(status.written, accepted);
  EXPECT_EQ(status.dropped, 200 - accepted);
  EXPECT_GT(status.dropped, 150);
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

}  // namespace
}  // namespace compositing::recorder_test
