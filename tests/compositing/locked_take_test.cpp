// Takes of fill and key: locked to each other whatever happens.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "compositing/recorder.h"
#include "take.h"

namespace compositing::locked_take_test {
namespace {

// Which of both files is the larger one.
enum class Larger { fill, key };

class LockedTakeTest : public TakeTest {
 protected:
  RecorderSettings pair(int width, int height, const std::string& codec = "lossless") const {
    RecorderSettings settings = small_take("");
    settings.fill_file = path("fill.mkv");
    settings.key_file = path("key.mkv");
    settings.display = display_;
    settings.width = width;
    settings.height = height;
    settings.codec = codec;
    return settings;
  }

  // A plate whose codes move with the number, covered by noise or in its shadow.
  RecordedFrame frame(const RecorderSettings& settings, std::int64_t number, Larger larger) const {
    const int width = settings.width, height = settings.height;
    RecordedFrame made = half_picture(number, width, height);
    capture::HalfImage rgba = *made.rgba, matte = *made.matte;
    capture::HalfImage plate{height, width, {}, 3};
    plate.pixels.resize(matte.pixels.size() * 3);
    std::minstd_rand random(static_cast<unsigned>(number + 7));
    for (std::size_t i = 0; i < matte.pixels.size(); ++i) {
      const float noise = static_cast<float>(random() % 1000) / 1000;
      const bool shadow = larger == Larger::key;
      for (std::size_t c = 0; c < 3; ++c) {
        const float under = 0.1F + static_cast<float>(number % 30) / 60;
        plate.pixels[i * 3 + c] = capture::half_from_float(under);
        rgba.pixels[i * 4 + c] = capture::half_from_float(shadow ? (1 - noise) * under : noise);
      }
      rgba.pixels[i * 4 + 3] = capture::half_from_float(shadow ? 0 : 1);
      matte.pixels[i] = capture::half_from_float(shadow ? noise : 1);
    }
    auto codes = std::make_shared<Rgb>(matte.pixels.size() * 3);
    // On this thread: there may be no others in a forked child.
    display_->to_rgb8(std::span<const capture::Half>(rgba.pixels), *codes);
    made.display_rgb8 = std::move(codes);
    made.rgba = std::make_shared<capture::HalfImage>(std::move(rgba));
    made.matte = std::make_shared<capture::HalfImage>(std::move(matte));
    made.plate = std::make_shared<capture::HalfImage>(std::move(plate));
    made.time = capture::time_of_frame(number, settings.rate);
    return made;
  }

  std::string bytes_of(const std::string& file, const std::string& format) const {
    return output_of("ffmpeg -v error -xerror -i " + file +
                     " -fps_mode passthrough -f rawvideo -pix_fmt " + format + " -");
  }

  // The pictures' times, which are the same in both.
  std::vector<double> locked_times_s() const {
    const std::vector<double> times = picture_times_s(path("fill.mkv"));
    EXPECT_EQ(picture_times_s(path("key.mkv")), times);
    return times;
  }

  std::shared_ptr<const Display> display_ = std::make_shared<const Display>();
};

TEST_F(LockedTakeTest, MixesToTheProgrammeBitForBit) {
  for (const Larger larger : {Larger::fill, Larger::key}) {
    RecorderSettings settings = pair(33, 17);
    settings.file = path("programme.mkv");
    std::vector<RecordedFrame> frames;
    for (int n = 0; n < 8; ++n) frames.push_back(frame(settings, n, larger));
    const auto plate = frames[5].plate;
    const RecorderStatus status = record(settings, std::move(frames));
    EXPECT_EQ(status.error, "");
    EXPECT_EQ(status.written, 8);
    capture::HalfImage over{17, 33, std::vector<capture::Half>(33 * 17 * 4), 4};
    for (std::size_t i = 0; i < over.pixels.size(); ++i) {
      over.pixels[i] = plate->pixels[i / 4 * 3 + std::min<std::size_t>(i % 4, 2)];
    }
    Rgb under(33 * 17 * 3);
    display_->to_rgb8(over, under);
    const std::string fill = bytes_of(settings.fill_file, "rgb24");
    const std::string key = bytes_of(settings.key_file, "gray");
    const std::string programme = bytes_of(settings.file, "rgb24");
    ASSERT_EQ(fill.size(), programme.size());
    ASSERT_EQ(key.size() * 3, programme.size());
    const auto code = [](const std::string& bytes, std::size_t i) {
      return static_cast<std::uint8_t>(bytes[i]);
    };
    for (std::size_t i = 0; i < under.size(); ++i) {
      const std::size_t at = 5 * under.size() + i;
      const double through = (255 - code(key, at / 3)) * under[i] / 255.0;
      ASSERT_EQ(code(fill, at) + std::lround(through), code(programme, at)) << i;
    }
  }
}

TEST_F(LockedTakeTest, TellsOtherProgramsWhatItIs) {
  for (const char* codec : {"lossless", "h264"}) {
    RecorderSettings settings = pair(64, 48, codec);
    settings.rate = {30000, 1001};
    settings.start = Timecode{1, 0, 59, 28, true};
    settings.sound_channels = 2;
    settings.sound_rate = 8000;
    std::vector<RecordedFrame> frames;
    for (int n = 0; n < 40; ++n) {
      frames.push_back(frame(settings, n, Larger::fill));
      frames.back().sound = capture::Sound{frames.back().time, 2, 8000, std::vector<float>(534)};
    }
    EXPECT_EQ(record(settings, std::move(frames)).written, 40);
    EXPECT_EQ(locked_times_s().size(), 40U);
    for (const std::string& file : {settings.fill_file, settings.key_file}) {
      EXPECT_EQ(probe(file, "stream=r_frame_rate,avg_frame_rate"), "30000/1001\n30000/1001");
      EXPECT_EQ(probe(file, "stream_tags=timecode"), "01:00:59;28");
      EXPECT_NE(probe(file, "format_tags=comment", "").find("display codes"), std::string::npos);
    }
    EXPECT_EQ(probe(settings.key_file, "stream=color_range"), "pc");
    EXPECT_EQ(probe(settings.fill_file, "stream=codec_name", "-select_streams a"), "pcm_s24le");
    EXPECT_EQ(probe(settings.key_file, "stream=codec_name", "-select_streams a"), "");
  }
}

TEST_F(LockedTakeTest, LeavesTheSameGapsWhereFramesAreLeftOut) {
  const RecorderSettings settings = pair(64, 48);
  std::vector<RecordedFrame> frames;
  for (const int n : {100, 101, 105, 140, 141}) {
    frames.push_back(frame(settings, n, Larger::fill));
  }
  record(settings, std::move(frames));
  const std::vector<double> times = locked_times_s();
  ASSERT_EQ(times.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(times[i], (std::array{0, 1, 5, 40, 41}[i]) / 25.0, 0.0006);
  }
}

TEST_F(LockedTakeTest, DropsTheSameFramesWhenTheDiskIsSlow) {
  RecorderSettings settings = pair(640, 480);
  settings.queue_frames = 1;
  RecordedFrame next = frame(settings, 0, Larger::fill);
  RecorderStatus status;
  {
    Recorder recorder(settings);
    for (next.number = 0; next.number < 60; ++next.number) {
      recorder.push(next);
      std::this_thread::sleep_for(std::chrono::milliseconds(next.number % 7));
    }
    recorder.close();
    status = recorder.status();
  }
  EXPECT_GT(status.dropped, 0);
  EXPECT_GT(status.written, 1);
  EXPECT_EQ(locked_times_s().size(), static_cast<std::size_t>(status.written));
}

TEST_F(LockedTakeTest, KeepsBothWholeAndOfOneLengthWhenTheDiskIsFull) {
  for (const Larger larger : {Larger::fill, Larger::key}) {
    for (const char* codec : {"h264", "lossless"}) {
      RecorderSettings settings = pair(160, 120, codec);
      settings.sound_channels = 1;
      settings.sound_rate = 8000;
      RecorderStatus status;
      std::string made;
      {
        const FileSizeLimit limit(1'200'000);
        Recorder recorder(settings);
        int n = 0;
        for (; n < 2000 && recorder.status().error.empty(); ++n) {
          recorder.wait_for_room();
          RecordedFrame next = frame(settings, n, larger);
          next.sound = capture::Sound{next.time, 1, 8000, std::vector<float>(320, 0.1F)};
          recorder.push(std::move(next));
        }
        recorder.close();
        status = recorder.status();
        EXPECT_EQ(status.written + status.dropped, n);
      }

      const std::string& full = larger == Larger::fill ? settings.fill_file : settings.key_file;
      EXPECT_NE(status.error.find(full), std::string::npos) << status.error;
      const std::vector<double> times = locked_times_s();
      EXPECT_GE(times.size(), 13U);
      EXPECT_LE(static_cast<std::int64_t>(times.size()), status.written + 1);
      EXPECT_GE(static_cast<std::int64_t>(times.size()), status.written);
      for (std::size_t i = 0; i < times.size(); ++i) {
        ASSERT_NEAR(times[i], static_cast<double>(i) / 25, 0.001) << codec;
      }
      for (const std::string& file : {settings.fill_file, settings.key_file}) {
        EXPECT_LE(fs::file_size(file), 1'200'000U);
        EXPECT_EQ(bytes_of(file, "gray").size(), times.size() * 160 * 120) << file;
        EXPECT_NEAR(std::stod(probe(file, "format=duration", "")),
                    static_cast<double>(times.size()) / 25, 0.002)
            << file;
      }
    }
  }
}

// All pictures are written when it is a file's index that has no room.
TEST_F(LockedTakeTest, KeepsEveryPictureWhenTheDiskIsFullAtTheEnd) {
  for (const Larger larger : {Larger::fill, Larger::key}) {
    const RecorderSettings settings = pair(64, 48);
    const auto take = [&] {
      Recorder recorder(settings);
      for (int n = 0; n < 30; ++n) {
        recorder.wait_for_room();
        recorder.push(frame(settings, n, larger));
      }
      recorder.close();
      return recorder.status();
    };
    EXPECT_EQ(take().error, "");
    const std::string& full = larger == Larger::fill ? settings.fill_file : settings.key_file;
    const std::string& other = larger == Larger::fill ? settings.key_file : settings.fill_file;
    const std::uintmax_t whole = fs::file_size(full);
    ASSERT_LT(fs::file_size(other) + 100, whole);
    for (const std::uintmax_t lacking : {1U, 10U, 30U}) {
      RecorderStatus status;
      {
        const FileSizeLimit limit(whole - lacking);
        status = take();
      }
      EXPECT_NE(status.error.find(full), std::string::npos) << status.error;
      EXPECT_EQ(status.written, 30) << lacking;
      EXPECT_EQ(locked_times_s().size(), 30U) << lacking;
      EXPECT_NE(probe(other, "format=duration", ""), "N/A") << lacking;
    }
  }
}

TEST_F(LockedTakeTest, GoesOnInBothWithEveryFrameWhenItIsTheExrFramesThatFail) {
  RecorderSettings settings = pair(64, 48);
  settings.exr_dir = path("take");
  Recorder recorder(settings);
  for (int n = 0; n < 5; ++n) EXPECT_TRUE(recorder.push(frame(settings, n, Larger::key)));
  while (recorder.status().outputs.back().written < 5) std::this_thread::yield();
  fs::remove_all(settings.exr_dir);
  for (int n = 5; n < 8; ++n) EXPECT_TRUE(recorder.push(frame(settings, n, Larger::key)));
  recorder.close();
  const RecorderStatus status = recorder.status();
  EXPECT_EQ(status.error, "");
  EXPECT_NE(status.outputs.at(1).error.find("frame.000005.exr"), std::string::npos);
  EXPECT_EQ(locked_times_s().size(), 8U);
}

TEST_F(LockedTakeTest, IsAtMostHalfASecondApartWhenKilled) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the thread sanitizer lets no forked child start threads";
#endif
  const RecorderSettings settings = pair(160, 120);
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe(pipe.data()), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    Recorder recorder(settings);
    for (std::int64_t n = 0; recorder.status().error.empty(); ++n) {
      recorder.wait_for_room();
      recorder.push(frame(settings, n, Larger::fill));
      if (recorder.status().written >= 60 && ::write(pipe[1], "x", 1) != 1) break;
    }
    ::_exit(1);
  }
  ::close(pipe[1]);
  char ready = 0;
  EXPECT_EQ(::read(pipe[0], &ready, 1), 1);
  ::close(pipe[0]);
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  std::array<std::vector<double>, 2> times{picture_times_s(settings.fill_file),
                                           picture_times_s(settings.key_file)};
  if (times[0].size() < times[1].size()) std::swap(times[0], times[1]);
  EXPECT_GE(times[1].size(), 60U - 2 * 13);
  EXPECT_LE(times[0].size() - times[1].size(), 13U);
  EXPECT_TRUE(std::ranges::equal(times[1], std::span(times[0]).first(times[1].size())));
}

TEST_F(LockedTakeTest, RefusesHalfAPairAndOneFileTwiceByName) {
  const auto reason = [&](auto change) -> std::string {
    RecorderSettings settings = pair(64, 48);
    change(settings);
    try {
      const Recorder recorder(settings);
    } catch (const std::invalid_argument& error) {
      EXPECT_FALSE(fs::exists(path("fill.mkv")));
      return error.what();
    }
    return "";
  };
  const auto expect_words = [&](const std::string& words, auto change) {
    const std::string why = reason(change);
    EXPECT_NE(why.find(words), std::string::npos) << why;
  };
  expect_words(path("fill.mkv"), [](RecorderSettings& s) { s.key_file = ""; });
  expect_words(path("key.mkv"), [](RecorderSettings& s) { s.fill_file = ""; });
  expect_words("one file", [](RecorderSettings& s) { s.key_file = s.fill_file; });
  expect_words("one file", [this](RecorderSettings& s) { s.key_file = path("./fill.mkv"); });
  expect_words("programme", [](RecorderSettings& s) { s.file = s.key_file; });
  expect_words("key.mov", [this](RecorderSettings& s) { s.key_file = path("key.mov"); });
  expect_words("fill.avi", [this](RecorderSettings& s) { s.fill_file = path("fill.avi"); });
  expect_words("display", [](RecorderSettings& s) { s.display = nullptr; });
  const fs::path here = fs::current_path();
  fs::current_path(dir_);
  expect_words("one file", [](RecorderSettings& s) {
    s.fill_file = "fill.mkv";
    s.key_file = "./fill.mkv";
  });
  fs::current_path(here);
  fs::create_directory_symlink(dir_, path("link"));
  expect_words("one file", [this](RecorderSettings& s) { s.key_file = path("link/fill.mkv"); });
}

TEST_F(LockedTakeTest, RefusesFramesWithoutAPlate) {
  const RecorderSettings settings = pair(64, 48);
  Recorder recorder(settings);
  RecordedFrame whole = frame(settings, 0, Larger::fill);
  RecordedFrame lacking = whole;
  lacking.plate = nullptr;
  EXPECT_THROW(recorder.push(lacking), std::invalid_argument);
  lacking = whole;
  lacking.matte = nullptr;
  EXPECT_THROW(recorder.push(lacking), std::invalid_argument);
  lacking = whole;
  lacking.plate = frame(pair(64, 50), 0, Larger::fill).plate;
  EXPECT_THROW(recorder.push(lacking), std::invalid_argument);
  EXPECT_TRUE(recorder.push(whole));
}

}  // namespace
}  // namespace compositing::locked_take_test
