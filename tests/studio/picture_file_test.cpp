// The file that has a running show's newest picture.
#include "studio/picture_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "capture/png.h"
#include "tests/made_files.h"
#include "tests/studio/command_line.h"
#include "tests/studio/made_show.h"

namespace studio::picture_file_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class PictureFileTest : public testing::Test {
 protected:
  void SetUp() override { dir_ = made::make_temporary_directory(); }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  static PictureFile::Codes grey(int code) {
    return std::make_shared<const std::vector<std::uint8_t>>(64 * 48 * 3,
                                                             static_cast<std::uint8_t>(code));
  }
  // What the file is to hold of a grey picture.
  std::string png_of(int code) const {
    const std::filesystem::path path = dir_ / "expected.png";
    capture::write_png(path, 64, 48, 3, *grey(code));
    return content_of(path);
  }
  static bool comes(const std::function<bool()>& so) {
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (!so() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(1ms);
    return so();
  }

  std::filesystem::path dir_;
};

TEST_F(PictureFileTest, HasTheNewestPictureWhileItRunsAndTheLastAtTheEnd) {
  const std::string path = (dir_ / "view.png").string();
  PictureFile file(path, 64, 48, 1ms, [](const std::string& why) { ADD_FAILURE() << why; });
  for (const int code : {20, 40, 60}) {
    const std::string expected = png_of(code);
    file.show(grey(code));
    EXPECT_TRUE(comes([&] { return content_of(path) == expected; })) << code;
  }
  file.show(grey(80));
  file.finish();
  EXPECT_EQ(content_of(path), png_of(80));
}

// Whoever looks at it, and whenever.
TEST_F(PictureFileTest, IsNeverHalfWritten) {
  const std::string path = (dir_ / "view.png").string();
  const std::string one = png_of(20), other = png_of(200);
  PictureFile file(path, 64, 48, 0ms, [](const std::string& why) { ADD_FAILURE() << why; });
  std::jthread showing([&](const std::stop_token& stop) {
    for (int n = 0; !stop.stop_requested(); ++n) file.show(grey(n % 2 == 0 ? 20 : 200));
  });
  ASSERT_TRUE(comes([&] { return std::filesystem::exists(path); }));
  for (int n = 0; n < 500; ++n) {
    const std::string content = content_of(path);
    ASSERT_TRUE(content == one || content == other) << content.size();
  }
}

TEST_F(PictureFileTest, IsNotWrittenMoreOftenThanIsAskedFor) {
  const std::string path = (dir_ / "view.png").string();
  PictureFile file(path, 64, 48, 1h, [](const std::string& why) { ADD_FAILURE() << why; });
  const std::string first = png_of(20);
  file.show(grey(20));
  ASSERT_TRUE(comes([&] { return content_of(path) == first; }));
  file.show(grey(40));
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(content_of(path), first);
  file.finish();
  EXPECT_EQ(content_of(path), png_of(40));
}

TEST_F(PictureFileTest, TellsOnceThatItCannotBeWrittenAndTriesAgain) {
  const std::string path = (dir_ / "folder" / "view.png").string();
  std::atomic<int> told = 0;
  std::string why;
  PictureFile file(path, 64, 48, 1ms, [&](const std::string& reason) {
    if (told++ == 0) why = reason;
  });
  file.show(grey(20));
  ASSERT_TRUE(comes([&] { return told > 0; }));
  EXPECT_THAT(why, HasSubstr(path));
  file.show(grey(40));
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(told, 1);
  const std::string expected = png_of(40);
  std::filesystem::create_directory(dir_ / "folder");
  EXPECT_TRUE(comes([&] { return content_of(path) == expected; }));
  std::filesystem::remove_all(dir_ / "folder");
  file.show(grey(60));
  EXPECT_THROW(file.finish(), std::runtime_error);
}

class Operators : public CommandLine {
 protected:
  std::string write_set() const {
    capture::write_png(dir_ / "plate.png", 64, 48, 3, std::vector<std::uint8_t>(64 * 48 * 3, 120));
    return write_made_set(dir_, "file:plate.png");
  }
};

TEST_F(Operators, SeeTheShowWhileItRuns) {
  const std::string set = write_set(), view = (dir_ / "view.png").string();
  const std::string script = write("three_seconds.toml", "[[at]]\nframe = 75\nquit = true\n");
  std::atomic<bool> ended = false;
  Outcome outcome;
  std::jthread running([&] {
    outcome = run("run " + set + " --live --script " + script + " --view rays --view-png " + view);
    ended = true;
  });
  int written = 0;
  fs::file_time_type last{};
  std::string content;
  while (!ended) {
    std::error_code none;
    const auto now = fs::last_write_time(view, none);
    if (!none && now != last) {
      last = now;
      ++written;
      content = content_of(view);
      EXPECT_TRUE(content.starts_with("\x89PNG")) << "whole, whenever it is looked at";
      EXPECT_NE(content.find("IEND"), content.npos);
    }
    std::this_thread::sleep_for(5ms);
  }
  running.join();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_GE(written, 2);
  EXPECT_LE(written, 7);
  const std::string still = (dir_ / "still.png").string();
  ASSERT_EQ(run("still " + set + " -o " + still).status, 0);
  EXPECT_NE(content_of(view), content_of(still));
  ASSERT_EQ(run("run " + set + " --view-png " + view).status, 0);
  EXPECT_EQ(content_of(view), content_of(still)) << "without a view, the picture";
}

}  // namespace
}  // namespace studio::picture_file_test
