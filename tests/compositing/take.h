// What tests of takes share: a folder of their own, made pictures, and other programs' readings.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "compositing/recorder.h"

namespace compositing {

namespace fs = std::filesystem;
using Rgb = std::vector<std::uint8_t>;

// A folder that this test alone uses, removed afterwards.
class TakeTest : public testing::Test {
 protected:
  TakeTest() {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = fs::path(testing::TempDir()) /
           ("platelight_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    fs::remove_all(dir_);
    fs::create_directories(dir_);
  }
  ~TakeTest() override { fs::remove_all(dir_); }
  std::string path(const std::string& name) const { return (dir_ / name).string(); }

  fs::path dir_;
};

// Files of this process can be no larger while it lives. Stands for a full disk: write() fails in
// the same way.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::uintmax_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit limited { bytes, before_.rlim_max };
    ::setrlimit(RLIMIT_FSIZE, &limited);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  struct rlimit before_ {};
  void (*handler_)(int) = nullptr;
};

// What a command writes to its standard output; fails the test if it reports an error.
inline std::string output_of(const std::string& command) {
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

inline std::string probe(const std::string& file,
                         const std::string& entries,
                         const std::string& more = "-select_streams v:0") {
  std::string text = output_of("ffprobe -v error " + more + " -show_entries " + entries +
                               " -of default=noprint_wrappers=1:nokey=1 " + file);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

inline std::vector<double> picture_times_s(const std::string& file) {
  std::istringstream text(probe(file, "frame=best_effort_timestamp_time"));
  std::vector<double> times;
  for (double time = 0; text >> time;) times.push_back(time);
  return times;
}

// A textured picture that moves with n.
inline std::shared_ptr<const Rgb> textured(int width, int height, std::int64_t n) {
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

inline std::shared_ptr<const Rgb> flat(int width, int height, int grey) {
  return std::make_shared<Rgb>(static_cast<std::size_t>(width * height * 3),
                               static_cast<std::uint8_t>(grey));
}

inline RecordedFrame picture(std::int64_t number, std::shared_ptr<const Rgb> rgb) {
  RecordedFrame frame;
  frame.number = number;
  frame.display_rgb8 = std::move(rgb);
  return frame;
}

// Black, with an empty matte: for EXR frames.
inline RecordedFrame half_picture(std::int64_t number, int width, int height) {
  RecordedFrame frame;
  frame.number = number;
  const auto pixels = static_cast<std::size_t>(width * height);
  frame.rgba = std::make_shared<capture::HalfImage>(
      capture::HalfImage{height, width, std::vector<capture::Half>(pixels * 4), 4});
  frame.matte = std::make_shared<capture::HalfImage>(
      capture::HalfImage{height, width, std::vector<capture::Half>(pixels), 1});
  return frame;
}

inline RecorderSettings small_take(const std::string& file) {
  RecorderSettings settings;
  settings.file = file;
  settings.rate = {25, 1};
  settings.width = 64;
  settings.height = 48;
  return settings;
}

inline RecorderStatus record(const RecorderSettings& settings, std::vector<RecordedFrame> frames) {
  Recorder recorder(settings);
  for (RecordedFrame& frame : frames) {
    recorder.wait_for_room();
    recorder.push(std::move(frame));
  }
  recorder.close();
  return recorder.status();
}

}  // namespace compositing
