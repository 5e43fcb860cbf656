// Recorded frames played again.
#include "capture/replay.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

#include "capture/png.h"
#include "tests/made_files.h"

namespace capture::replay_test {
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

// Of a camera whose clock is a little off and whose stamps come by chance; some frames are missing.
TEST_F(Replay, HasTheRateOfItsRecording) {
  write_picture("a.png", 10);
  std::string lines;
  for (int i = 0; i < 40; ++i) {
    if (i % 13 == 7) continue;
    const double time_s = i * 0.020002 + (i * 7 % 5) * 0.0005;
    lines += "a.png," + std::to_string(time_s) + ",0,good\n";
  }
  write_list(lines);
  const auto even = open();
  EXPECT_EQ(even->info().rate, (Rational{50, 1}));
  EXPECT_EQ(even->info().jitter, milliseconds(5));
  // Of no rate.
  lines.clear();
  for (int i = 0; i < 40; ++i) {
    lines += "a.png," + std::to_string(0.02 * i + 0.0011 * i * i) + ",0,good\n";
  }
  write_list(lines);
  const auto uneven = open();
  EXPECT_EQ(uneven->info().rate, (Rational{0, 1}));
  EXPECT_EQ(uneven->info().jitter, Time{0});
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

TEST_F(Replay, PlaysUpToWhereItsListWasCutOff) {
  write_picture("a.png", 10);
  const std::string good = "a.png,0,0.01,good\n";
  const std::string next = "a.png,0.04,0.01,good";
  for (std::size_t written = 0; written < next.size(); ++written) {
    write_list(good + next.substr(0, written));
    EXPECT_EQ(open()->info().frames, 1) << written;
  }
  write_list(good + next);
  EXPECT_EQ(open()->info().frames, 2) << "only its end is missing";
  write_list(next.substr(0, 10));
  EXPECT_THAT([&] { open(); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("line 2: it needs four")));
}

TEST_F(Replay, RefusesAFolderThatIsNotThereOrHasNoPictures) {
  EXPECT_THAT([] { open_camera("replay:/no/such/folder"); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("no such folder")));
  write_list("a.png,0,0,good\n");
  EXPECT_THAT([&] { open(); }, testing::ThrowsMessage<std::runtime_error>(testing::AllOf(
                                   HasSubstr("no picture can be read"), HasSubstr("a.png"))));
}

TEST_F(Replay, TakesAFolderWithoutAListInTheOrderOfNames) {
  write_picture("b.png", 20);
  write_picture("a.png", 10);
  std::ofstream(directory_ / "readme.txt") << "no picture";
  const auto camera = open();
  EXPECT_EQ(camera->info().frames, 2);
  EXPECT_EQ(camera->next()->image->at(0, 0, 0),
            static_cast<float>(decode(Transfer::rec1886, 10 / 255.0)));
  const auto second = camera->next();
  EXPECT_EQ(second->time, milliseconds(40));
  EXPECT_EQ(second->exposure_s, 0);
}

TEST_F(Replay, RefusesAFolderWithoutAnyPicture) {
  EXPECT_THAT([&] { open(); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("neither frames.csv nor")));
}

TEST_F(Replay, ReadsCodesByTheCamerasResponse) {
  // code 128 alone, so that the curve is asked at one point per channel
  write_picture("a.png", 128);
  std::ofstream(directory_ / "camera.rsp") << "2 1 0 0\n1 1 0\n3 1 0 0 0\n";
  CameraOptions options;
  options.base_dir = directory_.string();
  options.response = "camera.rsp";
  const auto frame = open(options)->next();
  const double v = 128 / 255.0;
  EXPECT_FLOAT_EQ(frame->image->at(0, 0, 0), static_cast<float>(v * v));
  EXPECT_FLOAT_EQ(frame->image->at(0, 0, 1), static_cast<float>(v));
  EXPECT_FLOAT_EQ(frame->image->at(0, 0, 2), static_cast<float>(v * v * v));
  options.response = "missing.rsp";
  EXPECT_THROW(open(options), std::runtime_error);
}

TEST(ReplayOnRealData, HasTheExposuresOfTheBracket) {
  const std::filesystem::path bracket = made::real_data() / "brackets/fisheye8mm";
  if (!std::filesystem::exists(bracket)) GTEST_SKIP() << "no real data";
  CameraOptions options;
  options.crop = {{1000, 900, 16, 16}};
  options.response = (bracket / "Response_function.rsp").string();
  const auto camera = open_camera("replay:" + bracket.string(), options);
  EXPECT_EQ(camera->info().frames, 9);
  double exposure_s = 0;
  double light = 0;
  int brighter = 0;
  while (const auto frame = camera->next()) {
    EXPECT_GT(frame->exposure_s, 0);
    if (exposure_s > 0) {
      EXPECT_NEAR(std::abs(std::log2(frame->exposure_s / exposure_s)), 2, 0.01);
      brighter += (frame->image->at(8, 8, 1) > light) == (frame->exposure_s > exposure_s) ? 1 : 0;
    }
    exposure_s = frame->exposure_s;
    light = frame->image->at(8, 8, 1);
  }
  EXPECT_GE(brighter, 7) << "longer exposures are brighter, until they clip";
}

}  // namespace
}  // namespace capture::replay_test
