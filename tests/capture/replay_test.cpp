// Recorded frames played again.
#include "capture/replay.h"

#include <gmock/gmock.h>

#include <fstream>
#include <stdexcept>

#include "capture/png.h"
#include "tests/made_files.h"

namespace capture {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class Replay : public testing::Test {
 protected:
  void write_picture(const std::string& name, int code) {
    write_png(directory_ / name, 2, 2, 3,
              std::vector<std::uint8_t>(12, static_cast<std::uint8_t>(code)));
  }
  void write_list(const std::string& lines,
                  const std::string& header = "file,time_s,exposure_s,status\n") {
    std::ofstream(directory_ / "frames.csv") << header << lines;
  }
  std::unique_ptr<Camera> open(const CameraOptions& options = {}) {
    return open_camera("replay:" + directory_.string(), options);
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
};

TEST_F(Replay, GivesTheRecordedTimesExposuresAndStates) {
  write_picture("a.png", 10);
  write_picture("b.png", 20);
  write_list(
      "a.png,100.5,0.004,good\n"
      ",100.540000000,0.001,lost\n"
      "b.png,100.583333333,0,damaged\n");
  const auto camera = open();
  EXPECT_EQ(camera->info().frames, 3);
  EXPECT_EQ(camera->info().rate, (Rational{0, 1}));
  const auto first = camera->next();
  const auto second = camera->next();
  const auto third = camera->next();
  EXPECT_FALSE(camera->next());
  EXPECT_EQ(first->time, Time{0});
  EXPECT_EQ(first->exposure_s, 0.004);
  EXPECT_EQ(first->status, FrameStatus::good);
  EXPECT_EQ(second->time, milliseconds(40));
  EXPECT_EQ(second->exposure_s, 0.001);
  EXPECT_EQ(second->status, FrameStatus::lost);
  EXPECT_EQ(second->image, first->image);
  EXPECT_EQ(third->time.count(), 83333333);
  EXPECT_EQ(third->status, FrameStatus::damaged);
  EXPECT_EQ(third->image->at(0, 0, 0), static_cast<float>(decode(Transfer::rec1886, 20 / 255.0)));
  EXPECT_EQ(camera->statistics().lost, 1);
  EXPECT_EQ(camera->statistics().damaged, 1);
}

TEST_F(Replay, HasNoPictureBeforeTheFirstGoodOne) {
  write_picture("a.png", 10);
  write_list(",0,0,lost\na.png,0.04,0,good\n");
  const auto camera = open();
  EXPECT_EQ(camera->next()->image, nullptr);
  EXPECT_NE(camera->next()->image, nullptr);
}

TEST_F(Replay, StartsAtTheFrameThatIsAskedFor) {
  write_picture("a.png", 10);
  write_picture("b.png", 20);
  write_list("a.png,0,0,good\nb.png,0.04,0.5,good\n");
  CameraOptions options;
  options.frame = 1;
  const auto frame = open(options)->next();
  EXPECT_EQ(frame->number, 1);
  EXPECT_EQ(frame->exposure_s, 0.5);
  options.frame = 2;
  EXPECT_THAT([&] { open(options); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("it has 2 frames")));
}

TEST_F(Replay, NamesTheLineThatItRefuses) {
  write_picture("a.png", 10);
  const std::string good = "a.png,0,0.01,good\n";
  for (const auto& [lines, words] :
       {std::pair{good + "a.png,0.04,0.01\n", "line 3: it needs four fields"},
        std::pair{good + "a.png,soon,0.01,good\n", "line 3: time_s is no number: \"soon\""},
        std::pair{good + "a.png,0.04s,0.01,good\n", "line 3: time_s is no number"},
        std::pair{good + "a.png,nan,0.01,good\n", "line 3: time_s is no number"},
        std::pair{good + "a.png,1e300,0.01,good\n", "line 3: time_s is too large"},
        std::pair{good + "a.png,0,0.01,good\n", "line 3: time_s does not rise"},
        std::pair{good + "a.png,0.04,-1,good\n", "line 3: exposure_s is below 0"},
        std::pair{good + "a.png,0.04,0.01,fine\n", "line 3: status is none of"},
        std::pair{good + ",0.04,0.01,good\n", "line 3: file must name a picture"},
        std::pair{good + "/etc/passwd,0.04,0.01,good\n", "line 3: file must name a picture in"},
        std::pair{good + "../a.png,0.04,0.01,good\n", "line 3: file must name a picture in"},
        std::pair{std::string(), "it lists no frames"}}) {
    write_list(lines);
    EXPECT_THAT([&] { open(); }, testing::ThrowsMessage<std::runtime_error>(
                                     testing::AllOf(HasSubstr("frames.csv"), HasSubstr(words))))
        << lines;
  }
  write_list(good, "name,time\n");
  EXPECT_THAT([&] { open(); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("line 1: the first line")));
}

TEST_F(Replay, RefusesAFolderThatIsNotThereOrHasNoPictures) {
  EXPECT_THAT([] { open_camera("replay:/no/such/folder"); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("no such folder")));
  write_list("a.png,0,0,good\n");
  EXPECT_THAT([&] { open(); }, testing::ThrowsMessage<std::runtime_error>(testing::AllOf(
                                   HasSubstr("no picture can be read"), HasSubstr("a.png"))));
}

}  // namespace
}  // namespace capture
