// The time between two recordings, of a lamp and of a board, as users of the command see it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/lens.h"
#include "calibrate/made_board.h"
#include "capture/exr.h"
#include "capture/parallel_loop.h"
#include "capture/png.h"
#include "studio/commands/watched_camera.h"
#include "tests/calibrate/made_motion.h"
#include "tests/studio/command_line.h"

namespace studio::calibrate_offset_test {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class CalibrateOffset : public CommandLine {
 protected:
  Json figures() const { return Json::parse(content_of(dir_ / "figures.json")); }
  std::string path(const std::string& name) const { return (dir_ / name).string(); }
  Outcome run_with_figures(const std::string& words) const {
    return run(words + " --json " + path("figures.json"));
  }
};

constexpr int lamp_frames = 170;

// A folder of frames that see a lamp, switched at these times of a clock that is `offset_s` behind.
void write_lamp(const fs::path& folder,
                const std::vector<double>& switched_s,
                double begin_s,
                double offset_s) {
  constexpr double exposure_s = 0.02;
  fs::create_directories(folder);
  std::ofstream list(folder / "frames.csv");
  list << "file,time_s,exposure_s,status\n";
  for (int i = 0; i < lamp_frames; ++i) {
    const double t = begin_s + 0.04 * i;
    double on_s = 0;
    for (std::size_t k = 0; k + 1 < switched_s.size(); k += 2) {
      on_s += std::max(0.0, std::min(t + exposure_s / 2, switched_s[k + 1]) -
                                std::max(t - exposure_s / 2, switched_s[k]));
    }
    capture::Image image = capture::make_image(4, 6);
    for (float& value : image.pixels) value = static_cast<float>(0.1 + on_s / exposure_s);
    const std::string name = fmt::format("{:03}.exr", i);
    capture::write_exr(folder / name, image);
    list << fmt::format("{},{:.9f},{},good\n", name, t + offset_s, exposure_s);
  }
}

TEST_F(CalibrateOffset, OfTwoRecordingsIsThatOfTheirFirstFrames) {
  made::Random random(2);
  std::vector<double> switched_s{0.1};
  while (switched_s.back() < 14) {
    switched_s.push_back(switched_s.back() + random.uniform(0.15, 0.6));
  }
  write_lamp(dir_ / "a", switched_s, 0, 0);
  write_lamp(dir_ / "b", switched_s, 0.713, 100);
  const std::string command =
      "calibrate offset replay:" + path("a") + " replay:" + path("b") + " --seconds 15";
  const Outcome outcome = run_with_figures(command);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // Recordings begin at 0: what A sees at t, B sees at t - 0.713.
  EXPECT_THAT(outcome.out, HasSubstr("offset_s = -0.71"));
  EXPECT_NEAR(figures()["offset_ms"], -713, 1);
  EXPECT_LT(figures()["sigma_ms"], 1);
  EXPECT_GT(figures()["edges"], 10);
  EXPECT_EQ(figures()["frames"], (Json{lamp_frames, lamp_frames}));

  write_lamp(dir_ / "dark", {}, 0, 0);
  const Outcome dark = run("calibrate offset replay:" + path("a") + " replay:" + path("dark"));
  EXPECT_EQ(dark.status, 1);
  expect_one_line(dark.err);
  EXPECT_THAT(dark.err, HasSubstr("nothing changes"));
  EXPECT_THAT(dark.err, HasSubstr("--board COLSxROWS"));
}

// A folder of what a camera sees of a board that moves, smeared over the exposure. Its clock is
// `offset_s` ahead.
void film_board(const fs::path& folder,
                const calibrate::Board& board,
                const std::function<calibrate::Pose(double)>& set_from_board,
                const calibrate::Pose& cam_from_set,
                double rate,
                double offset_s) {
  constexpr double exposure_s = 0.01;
  constexpr double length_s = 5;
  const calibrate::Lens lens{"pinhole", 320, 240, {300, 300, 159.5, 119.5}};
  const calibrate::DirectionTable directions = make_direction_table(lens);
  capture::Image room = capture::make_image(lens.height, lens.width, 1);
  for (float& value : room.pixels) value = 90;
  fs::create_directories(folder);
  std::ofstream list(folder / "frames.csv");
  list << "file,time_s,exposure_s,status\n";
  const int frames = static_cast<int>(length_s * rate);
  for (int i = 0; i < frames; ++i) {
    list << fmt::format("{:03}.png,{:.9f},{},good\n", i, i / rate + offset_s, exposure_s);
  }
  capture::parallel_for(0, frames, [&](int i) {
    const auto middle_at = [&](double t) {
      const calibrate::Vec3 middle{0.5 * board.square_m * (board.columns - 1),
                                   0.5 * board.square_m * (board.rows - 1), 0};
      return project(lens, cam_from_set * set_from_board(t) * middle).value();
    };
    const double t = i / rate;
    const calibrate::Vec2 from = middle_at(t - exposure_s / 2);
    const calibrate::Vec2 to = middle_at(t + exposure_s / 2);
    calibrate::MadeBoardView view{.blur_px = 0, .black = 20, .white = 235};
    view.motion_px = calibrate::hypotenuse(to.x - from.x, to.y - from.y);
    view.motion_rad = std::atan2(to.y - from.y, to.x - from.x);
    const capture::Image image =
        photograph_board(board, cam_from_set * set_from_board(t), lens, directions, room, view);
    std::mt19937 random(static_cast<unsigned>(i));
    std::normal_distribution<float> noise(0, 3);
    std::vector<std::uint8_t> codes;
    for (const float value : image.pixels) {
      codes.push_back(
          static_cast<std::uint8_t>(std::clamp(std::lround(value + noise(random)), 0L, 255L)));
    }
    capture::write_png(folder / fmt::format("{:03}.png", i), lens.width, lens.height, 1, codes);
  });
}

// Two recordings begin at 0, so that one of them has to begin later: B by 13.7 ms.
TEST_F(CalibrateOffset, ComesFromAMovingBoardAtTwoRates) {
  const calibrate::Board board{calibrate::Board::Kind::chessboard, 6, 4, 0.12, 0, ""};
  made::Random random(4);
  const auto motion = made::hand_motion(made::Path::space, random);
  constexpr double later_s = 0.0137;
  film_board(dir_ / "a", board, motion, made::camera_around(-0.5), 25, 0);
  film_board(
      dir_ / "b", board, [&](double t) { return motion(t + later_s); }, made::camera_around(0.5),
      30, 0);
  const std::string both = "calibrate offset replay:" + path("a") + " replay:" + path("b");
  const Outcome outcome = run_with_figures(both + " --board 6x4 --square 0.12");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("offset_s = -0.01"));
  EXPECT_NEAR(figures()["offset_ms"], -13.7, 1);
  EXPECT_NEAR(figures()["offset_ms"], -13.7, 3 * double{figures()["sigma_ms"]});
  EXPECT_LT(figures()["sigma_ms"], 1);
  EXPECT_EQ(figures()["frames"], (Json{125, 150}));

  const Outcome other = run(both + " --board 6x4 --charuco --seconds 1");
  EXPECT_EQ(other.status, 1);
  expect_one_line(other.err);
  EXPECT_THAT(other.err, HasSubstr("found in 0 of 25 frames"));
  EXPECT_EQ(run(both + " --square 0.04").status, 2);
}

// Live, and goes away after so many frames: from then on it loses them for ever.
class LeavingCamera : public capture::Camera {
 public:
  explicit LeavingCamera(int good) : good_(good) {}
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    capture::Frame frame;
    frame.number = number_++;
    frame.time = std::chrono::milliseconds(40 * frame.number);
    frame.image = image_;
    if (frame.number >= good_) {
      frame.status = capture::FrameStatus::lost;
      frame.note = "away";
    }
    EXPECT_LT(number_, 10'000) << "for ever";
    return number_ < 10'000 ? std::optional(frame) : std::nullopt;
  }

 private:
  int good_;
  capture::CameraInfo info_;
  std::int64_t number_ = 0;
  std::shared_ptr<const capture::Image> image_ =
      std::make_shared<capture::Image>(capture::make_image(2, 2));
};

TEST(Watch, EndsInTimeThoughTheCameraGoesAway) {
  LeavingCamera some(100);
  const Watched seen = watch(some, "cam", 20, 0.01, false);
  EXPECT_EQ(seen.brightness.size(), 100U);
  EXPECT_EQ(seen.brightness.back().exposure_s, 0.01);
  LeavingCamera few(5);
  try {
    watch(few, "v4l2:/dev/video7", 20, 0, false);
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("v4l2:/dev/video7 lost 495 of 500 frames"));
    EXPECT_THAT(error.what(), HasSubstr("away"));
  }
}

}  // namespace
}  // namespace studio::calibrate_offset_test
