// Takes that go wrong: killed, disk full, folders that vanish, settings that cannot be.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>

#include "compositing/exr_sequence.h"
#include "compositing/recorder.h"
#include "take.h"

namespace compositing::recorder_faults_test {
namespace {

using RecorderFaultsTest = TakeTest;

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

TEST_F(RecorderFaultsTest, LeavesAPlayableFileWhenKilled) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the thread sanitizer lets no forked child start threads";
#endif
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

TEST_F(RecorderFaultsTest, StopsCleanlyWhenTheDiskIsFull) {
  for (const char* codec : {"h264", "lossless"}) {
    const std::string file = path(std::string(codec) + ".mkv");
    RecorderSettings settings = small_take(file);
    settings.width = 160;
    settings.height = 120;
    settings.codec = codec;
    settings.sound_channels = 1;
    settings.sound_rate = 8000;
    RecorderStatus status;
    {
      const FileSizeLimit limit(1'500'000);
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

    EXPECT_NE(status.error.find(file), std::string::npos) << status.error;
    EXPECT_NE(status.error.find("File too large"), std::string::npos) << status.error;
    EXPECT_LE(fs::file_size(file), 1'500'000U);
    EXPECT_GT(fs::file_size(file), 700'000U);
    // No packet lies behind the hole that the lost ones left.
    std::istringstream packets(probe(file, "packet=pts_time:format=duration"));
    std::vector<double> times_s;
    for (double time_s = 0; packets >> time_s;) times_s.push_back(time_s);
    const double duration_s = times_s.back();
    times_s.pop_back();
    EXPECT_GE(times_s.size(), 20U) << codec;
    EXPECT_GE(static_cast<std::int64_t>(times_s.size()), status.written);
    EXPECT_LE(static_cast<std::int64_t>(times_s.size()), status.written + 1);
    // What was cut off counts neither there nor in the index.
    EXPECT_NEAR(duration_s, static_cast<double>(times_s.size()) / 25, 0.002) << codec;
    std::istringstream tags(probe(file, "stream_tags=DURATION", ""));
    for (std::string tag; tags >> tag;) {
      EXPECT_LE(std::stod(tag.substr(tag.rfind(':') + 1)), duration_s + 0.05) << codec;
    }
    EXPECT_EQ(picture_times_s(file).size(), times_s.size());
    const std::string last =
        output_of("ffmpeg -v error -xerror -ss 99 -i " + file + " -f rawvideo -pix_fmt gray -");
    EXPECT_EQ(last, "") << "an index that points beyond the end";
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      ASSERT_NEAR(times_s[i], static_cast<double>(i) / 25, 0.001) << codec;
    }
    const std::string raw =
        output_of("ffmpeg -v error -xerror -i " + file + " -f rawvideo -pix_fmt rgb24 -");
    const std::size_t size = 160 * 120 * 3;
    ASSERT_EQ(raw.size(), times_s.size() * size) << codec;
    if (settings.codec != "lossless") continue;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const auto number = static_cast<std::int64_t>(i);
      ASSERT_EQ(std::memcmp(raw.data() + i * size, textured(160, 120, number)->data(), size), 0)
          << i;
    }
  }
}

TEST_F(RecorderFaultsTest, KeepsOthersFromAFolderOfFrames) {
  RecorderSettings settings = small_take("");
  settings.exr_dir = path("take");
  const auto refusal = [&] {
    try {
      check(settings);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(), "");
  {
    const Recorder recorder(settings);
    EXPECT_EQ(refusal(), settings.exr_dir +
                             ": is being written by another program: name another folder, or wait "
                             "until that one has ended");
    EXPECT_THROW(Recorder{settings}, std::runtime_error);
  }
  EXPECT_EQ(refusal(), "");
}

// A frame for every kind of output, 64x48.
RecordedFrame complete_frame(std::int64_t number) {
  RecordedFrame frame = half_picture(number, 64, 48);
  frame.display_rgb8 = textured(64, 48, number);
  frame.plate = std::make_shared<capture::HalfImage>(
      capture::HalfImage{48, 64, std::vector<capture::Half>(48 * 64 * 3), 3});
  return frame;
}

TEST_F(RecorderFaultsTest, GoesOnInItsVideosWhenItIsTheExrFramesThatFail) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.exr_dir = path("take");
  settings.display = std::make_shared<const Display>(DisplaySettings{});
  settings.fill_file = path("fill.mkv");
  settings.key_file = path("key.mkv");
  Recorder recorder(settings);
  int n = 0;
  for (; n < 5; ++n) EXPECT_TRUE(recorder.push(complete_frame(n)));
  while (recorder.status().outputs.back().written < 5) std::this_thread::yield();
  fs::remove_all(settings.exr_dir);
  for (; n < 20; ++n) EXPECT_TRUE(recorder.push(complete_frame(n)));
  recorder.close();
  const RecorderStatus status = recorder.status();
  EXPECT_EQ(status.error, "");
  EXPECT_EQ(status.written, 20);
  EXPECT_EQ(status.dropped, 0);
  ASSERT_EQ(status.outputs.size(), 3U);
  const std::string pair = settings.fill_file + " and " + settings.key_file;
  for (const std::size_t whole : {0, 1}) {
    EXPECT_EQ(status.outputs[whole].name, whole == 0 ? settings.file : pair);
    EXPECT_EQ(status.outputs[whole].written, 20);
    EXPECT_EQ(status.outputs[whole].error, "");
  }
  const RecordedOutput& failed = status.outputs[2];
  EXPECT_EQ(failed.name, settings.exr_dir);
  EXPECT_EQ(failed.written, 5);
  EXPECT_NE(failed.error.find("frame.000005.exr"), std::string::npos) << failed.error;
  EXPECT_NE(failed.error.find("; the take goes on in " + settings.file + ", " + pair),
            std::string::npos)
      << failed.error;
  EXPECT_EQ(errors_of(status), std::vector{failed.error});
  for (const std::string& file : {settings.file, settings.fill_file, settings.key_file}) {
    EXPECT_EQ(picture_times_s(file).size(), 20U) << file;
  }
}

TEST_F(RecorderFaultsTest, GoesOnInFillKeyAndExrFramesWhenItIsTheProgrammeThatFails) {
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.codec = "lossless";
  settings.exr_dir = path("take");
  settings.display = std::make_shared<const Display>(DisplaySettings{});
  settings.fill_file = path("fill.mkv");
  settings.key_file = path("key.mkv");
  RecorderStatus status;
  {
    const FileSizeLimit limit(200'000);  // of each: the pair is of flat pictures, and small
    Recorder recorder(settings);
    for (int n = 0; n < 100; ++n) {
      recorder.wait_for_room();
      EXPECT_TRUE(recorder.push(complete_frame(n)));
    }
    recorder.close();
    status = recorder.status();
  }
  EXPECT_EQ(status.error, "");
  EXPECT_EQ(status.written, 100);
  ASSERT_EQ(status.outputs.size(), 3U);
  EXPECT_EQ(status.outputs[1].written, 100);
  EXPECT_EQ(status.outputs[2].written, 100);
  EXPECT_EQ(picture_times_s(settings.fill_file).size(), 100U);
  EXPECT_EQ(picture_times_s(settings.key_file).size(), 100U);
  EXPECT_EQ(ExrSequence::frames_in(settings.exr_dir), 100);
  const RecordedOutput& failed = status.outputs[0];
  EXPECT_EQ(errors_of(status), std::vector{failed.error});
  EXPECT_NE(failed.error.find("File too large"), std::string::npos) << failed.error;
  const auto pictures = static_cast<std::int64_t>(picture_times_s(settings.file).size());
  EXPECT_GE(pictures, 5);
  EXPECT_LT(pictures, 90);
  EXPECT_GE(pictures, failed.written);
  EXPECT_LE(pictures, failed.written + 1);
  output_of("ffmpeg -v error -xerror -i " + settings.file + " -f null -");
}

// Another program's input: nothing of it can be gone back to.
TEST_F(RecorderFaultsTest, WritesIntoAPipe) {
  const std::string pipe = path("pipe.mkv"), copy = path("copy.mkv");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(Recorder(small_take(pipe)), std::runtime_error) << "nobody reads it";
  const int end = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(end, 0);
  std::thread reader;
  {
    Recorder recorder(small_take(pipe));
    ::fcntl(end, F_SETFL, 0);
    reader = std::thread([&] {
      std::ofstream out(copy, std::ios::binary);
      std::array<char, 4096> bytes;
      for (ssize_t n; (n = ::read(end, bytes.data(), bytes.size())) > 0;) {
        out.write(bytes.data(), n);
      }
    });
    for (int n = 0; n < 6; ++n) {
      recorder.wait_for_room();
      EXPECT_TRUE(recorder.push(picture(n, textured(64, 48, n))));
    }
    recorder.close();
    EXPECT_EQ(recorder.status().error, "");
    EXPECT_EQ(recorder.status().written, 6);
  }
  reader.join();
  ::close(end);
  EXPECT_EQ(picture_times_s(copy).size(), 6U);
}

TEST_F(RecorderFaultsTest, TellsThatItsFileWasRemovedOrMovedMeanwhile) {
  for (const bool moved : {false, true}) {
    const std::string take = path("take.mkv"), elsewhere = path("elsewhere.mkv");
    Recorder recorder(small_take(take));
    const auto push = [&](int n) { EXPECT_TRUE(recorder.push(picture(n, textured(64, 48, n)))); };
    for (int n = 0; n < 3; ++n) push(n);
    while (recorder.status().written < 3) std::this_thread::yield();
    moved ? fs::rename(take, elsewhere) : static_cast<void>(fs::remove(take));
    push(3);
    recorder.wait_for_room();
    recorder.close();
    const RecorderStatus status = recorder.status();
    EXPECT_NE(status.error.find(take + (moved ? ": was moved" : ": was removed")),
              std::string::npos)
        << status.error;
    EXPECT_EQ(status.written, moved ? 4 : 0);
    if (moved) {
      EXPECT_EQ(picture_times_s(elsewhere).size(), 4U);
    }
  }
}

TEST_F(RecorderFaultsTest, RefusesWhatCannotBeWrittenAtOnceWithPathAndReason) {
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
  EXPECT_THROW(Recorder(small_take(path(".mkv"))), std::invalid_argument);
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

TEST_F(RecorderFaultsTest, KeepsATakeThatIsThereWhereAnotherFileCannotBeWritten) {
  const std::string take = path("take.mkv"), fill = path("fill.mkv");
  std::ofstream(take) << "a take of before";
  RecorderSettings settings = small_take(take);
  settings.display = std::make_shared<const Display>(DisplaySettings{});
  settings.fill_file = fill;
  settings.key_file = path("no/such/folder/key.mkv");
  EXPECT_THROW(check(settings), std::runtime_error);
  EXPECT_THROW(Recorder recorder(settings), std::runtime_error);
  std::ifstream in(take);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "a take of before");
  EXPECT_FALSE(fs::exists(fill)) << "nothing is begun";
}

TEST_F(RecorderFaultsTest, RefusesAFileThatAnotherRecorderWrites) {
  const std::string take = path("take.mkv");
  const RecorderSettings settings = small_take(take);
  {
    Recorder first(settings);
    for (int n = 0; n < 5; ++n) EXPECT_TRUE(first.push(picture(n, textured(64, 48, n))));
    for (const auto& second : {std::function<void()>([&] { check(settings); }),
                               std::function<void()>([&] { Recorder recorder(settings); })}) {
      try {
        second();
        ADD_FAILURE() << "two takes in one file";
      } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find(take + ": is being written by another program"),
                  std::string::npos)
            << error.what();
      }
    }
    first.close();
    EXPECT_EQ(first.status().error, "");
  }
  EXPECT_EQ(picture_times_s(take).size(), 5U);
  EXPECT_EQ(record(settings, {picture(0, textured(64, 48, 0))}).error, "");
  EXPECT_EQ(picture_times_s(take).size(), 1U) << "an earlier take is replaced";
}

TEST_F(RecorderFaultsTest, KeepsATakeThatIsThereUntilTheFirstPicture) {
  const auto content = [](const std::string& file) {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  RecorderSettings settings = small_take(path("take.mkv"));
  settings.display = std::make_shared<const Display>(DisplaySettings{});
  settings.fill_file = path("fill.mkv");
  settings.key_file = path("key.mkv");
  const std::array there{settings.file, settings.fill_file};
  for (const std::string& file : there) std::ofstream(file) << "a take of before";
  EXPECT_EQ(record(settings, {}).error, "");
  for (const std::string& file : there) EXPECT_EQ(content(file), "a take of before") << file;
  EXPECT_FALSE(fs::exists(settings.key_file)) << "nothing was begun";
  EXPECT_EQ(record(settings, {complete_frame(0)}).error, "");
  for (const std::string& file : {settings.file, settings.fill_file, settings.key_file}) {
    EXPECT_EQ(picture_times_s(file).size(), 1U) << file;
  }
}

TEST_F(RecorderFaultsTest, RefusesHostileSettings) {
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

TEST_F(RecorderFaultsTest, RefusesFramesThatLackWhatIsRecorded) {
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
}  // namespace compositing::recorder_faults_test
