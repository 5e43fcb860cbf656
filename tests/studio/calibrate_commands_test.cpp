// The commands that measure cameras, as their users see them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/camera_model.h"
#include "calibrate/lens.h"
#include "calibrate/pose_file.h"
#include "calibrate/rig_file.h"
#include "capture/exr.h"
#include "capture/png.h"
#include "tests/calibrate/made_board_picture.h"
#include "tests/calibrate/made_lamps.h"
#include "tests/calibrate/made_markers.h"
#include "tests/studio/calibrate_commands.h"

namespace studio::calibrate_commands_test {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

// [[marker]] tables of points that a camera sees.
std::string markers_text(const calibrate::Lens& lens,
                         const calibrate::Pose& cam_from_set,
                         std::size_t count,
                         const std::string& picture) {
  made::Random random(3);
  std::string text;
  for (std::size_t i = 0; i < count;) {
    const calibrate::Vec3 p{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(0, 3)};
    const auto q = project(lens, cam_from_set * p);
    if (!q || q->x < 0 || q->y < 0 || q->x >= lens.width || q->y >= lens.height) continue;
    text += fmt::format(
        "[[marker]]\nname = \"m{}\"\nposition = [{}, {}, {}]\npixel = [{}, {}]\npicture = "
        "\"{}\"\n",
        i++, p.x, p.y, p.z, q->x + 0.2 * random.normal(), q->y + 0.2 * random.normal(), picture);
  }
  return text;
}

TEST_F(CalibrateCommands, RigComesFromPicturesOfTheSameNames) {
  const calibrate::Board board{calibrate::Board::Kind::chessboard, 8, 5, 0.04, 0, ""};
  const calibrate::Lens lens{"pinhole", 480, 360, {400, 400, 239.5, 179.5}};
  const calibrate::Pose right_from_left = calibrate::look_at({0.25, 0, 0}, {0.1, 0.8, 0}, 0.05) *
                                          inverse(calibrate::look_at({0, 0, 0}, {0.1, 0.8, 0}, 0));
  calibrate::write_lens(path("left.toml"), lens);
  calibrate::write_lens(path("right.yml"), lens);
  std::mt19937 random(3);
  for (const char* name : {"left", "right"}) fs::create_directories(dir_ / name);
  for (int i = 0; i < 5; ++i) {
    const calibrate::Pose left_from_board = made::make_board_pose(
        board, {0.02 * i - 0.04, 0.01 * i - 0.02, 1}, 0.7 + 0.05 * i, 0.5, 0.3, random);
    const auto save = [&](const std::string& camera, const calibrate::Pose& cam_from_board) {
      const calibrate::GreyPicture picture = made::render_board(board, cam_from_board, lens);
      capture::write_png(dir_ / camera / (std::to_string(i) + ".png"), picture.width,
                         picture.height, 1, picture.pixels);
    };
    save("left", left_from_board);
    if (i != 2) save("right", right_from_left * left_from_board);
  }
  const std::string sources = "left=" + path("left") + " right=" + path("right");
  const std::string command = "calibrate rig " + sources + " --lens left=" + path("left.toml") +
                              " --lens right=" + path("right.yml") +
                              " --offset right=-0.0125 --response left=" + write("left.rsp", "x") +
                              " --board 8x5 --square 0.04 -o " + path("rig.toml");
  const Outcome outcome = run_with_figures(command);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("2 cameras"));
  const std::vector<calibrate::RigMember> rig = calibrate::read_rig(path("rig.toml"));
  ASSERT_EQ(rig.size(), 2U);
  EXPECT_EQ(rig[1].name, "right");
  EXPECT_EQ(rig[1].lens, path("right.yml"));
  EXPECT_EQ(rig[0].time_offset_s, 0);
  EXPECT_EQ(rig[1].time_offset_s, -0.0125);
  EXPECT_EQ(rig[0].response, path("left.rsp"));
  EXPECT_EQ(rig[1].response, "");
  const made::PoseError error = made::error_of(rig[1].cam_from_rig, right_from_left);
  EXPECT_LT(error.turn_rad / made::degree, 0.1);
  EXPECT_LT(error.position_m, 0.002);
  const Json found = figures();
  EXPECT_EQ(found["cameras"][1]["views"], 4);
  EXPECT_LT(found["cameras"][1]["sigma_mm"], 2);

  EXPECT_EQ(run("calibrate rig " + sources + " --lens left=" + path("left.toml") +
                " --board 8x5 -o " + path("rig.toml"))
                .status,
            2);
  for (const char* wrong : {"--offset middle=1", "--offset right=soon",
                            "--offset left=1 --offset "
                            "left=2"}) {
    EXPECT_EQ(run(command + " " + wrong).status, 2) << wrong;
  }
  const Outcome no_response = run(command + " --response right=" + path("none.rsp"));
  EXPECT_EQ(no_response.status, 1);
  expect_one_line(no_response.err);
}

TEST_F(CalibrateCommands, RigPairsFramesByTheirOffsetAndRefusesTwoRates) {
  const calibrate::Board board{calibrate::Board::Kind::chessboard, 8, 5, 0.04, 0, ""};
  const calibrate::Lens lens{"pinhole", 480, 360, {400, 400, 239.5, 179.5}};
  const calibrate::Pose right_from_left = calibrate::look_at({0.25, 0, 0}, {0.1, 0.8, 0}, 0.05) *
                                          inverse(calibrate::look_at({0, 0, 0}, {0.1, 0.8, 0}, 0));
  calibrate::write_lens(path("lens.toml"), lens);
  // A recording of 25 frames a second that begins so many frames early.
  constexpr int instants = 9;  // a recording of fewer tells no rate
  const auto record = [&](const std::string& name, const calibrate::Pose& cam_from_left, int early,
                          double rate) {
    fs::create_directories(dir_ / name);
    std::ofstream list(dir_ / name / "frames.csv");
    list << "file,time_s,exposure_s,status\n";
    for (int i = 0; i < instants + early; ++i) {
      const int instant = std::max(0, i - early);
      std::mt19937 of_instant(static_cast<unsigned>(instant));
      const calibrate::Pose left_from_board =
          made::make_board_pose(board, {0.01 * instant - 0.04, 0.005 * instant - 0.02, 1},
                                0.7 + 0.03 * instant, 0.5, 0.3, of_instant);
      const calibrate::GreyPicture picture =
          made::render_board(board, cam_from_left * left_from_board, lens);
      const std::string file = std::to_string(i) + ".png";
      capture::write_png(dir_ / name / file, picture.width, picture.height, 1, picture.pixels);
      list << fmt::format("{},{:.9f},0.01,good\n", file, i / rate);
    }
  };
  record("left", {}, 0, 25);
  record("right", right_from_left, 2, 25);
  record("faster", right_from_left, 0, 50);
  const auto command = [&](const std::string& right, const std::string& more) {
    return "calibrate rig left=replay:" + path("left") + " right=replay:" + path(right) +
           " --lens left=" + path("lens.toml") + " --lens right=" + path("lens.toml") +
           " --board 8x5 --square 0.04 --every 1 -o " + path("rig.toml") + more;
  };
  const Outcome paired = run_with_figures(command("right", " --offset right=0.085"));
  ASSERT_EQ(paired.status, 0) << paired.err;
  const made::PoseError error =
      made::error_of(calibrate::read_rig(path("rig.toml"))[1].cam_from_rig, right_from_left);
  EXPECT_LT(error.turn_rad / made::degree, 0.1);
  EXPECT_LT(error.position_m, 0.002);
  EXPECT_EQ(figures()["cameras"][1]["views"], instants);
  EXPECT_LT(figures()["chi_squared"], 2);

  const Outcome unpaired = run(command("right", ""));
  EXPECT_TRUE(unpaired.status == 1 || unpaired.err.find("do not agree") != std::string::npos)
      << unpaired.err;
  const Outcome rates = run(command("faster", ""));
  EXPECT_EQ(rates.status, 1);
  expect_one_line(rates.err);
  EXPECT_THAT(rates.err, HasSubstr("25 frames a second"));
  EXPECT_THAT(rates.err, HasSubstr("50"));
}

TEST_F(CalibrateCommands, LensOfTheDeskComesFromItsLinesWithoutBoards) {
  const std::string lines = PLATELIGHT_SOURCE_DIR "/tests/data/desk_lines.toml";
  const Outcome outcome = run_with_figures("calibrate lines " + lines + " -o " + path("lens.toml"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("vertical: 8 lines agree to 0."));
  EXPECT_THAT(outcome.out, HasSubstr("the camera is rolled by -2."));
  const Json found = figures();
  EXPECT_LT(found["parallels"][0]["rms_deg"], 0.5);
  EXPECT_NEAR(found["rectangles"][0]["aspect"], 2.77, 0.03);
  EXPECT_NEAR(found["roll_deg"], -2.6, 0.5);
  const calibrate::Lens lens = calibrate::read_lens(path("lens.toml"));
  EXPECT_EQ(lens.model, "equisolid");
  EXPECT_EQ(lens.parameters[0], found["focal_px"]);
  EXPECT_NEAR(lens.max_angle_rad / made::degree, 90.5, 1e-9);

  EXPECT_EQ(run("calibrate lines " + lines + " -o " + path("lens.cameramodel")).status, 2);
  const Outcome wrong = run("calibrate lines " + lines + " --model fish -o " + path("lens.toml"));
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.err, HasSubstr("equisolid or equidistant"));
}

TEST_F(CalibrateCommands, LinesOfAnotherSizeAndGroupAreWarnedOf) {
  const std::string lines = content_of(PLATELIGHT_SOURCE_DIR "/tests/data/desk_lines.toml");
  const std::string command = "calibrate lines " + path("lines.toml") + " -o " + path("lens.toml");
  write("lines.toml", lines);
  EXPECT_EQ(run_with_figures(command).err, "");
  EXPECT_TRUE(figures()["warnings"].empty());
  // Marks that noise alone cannot explain.
  EXPECT_THAT(run_with_figures(command + " --noise 0.02").err,
              HasSubstr("far above the noise to be expected"));
  EXPECT_EQ(figures()["warnings"].size(), 1U);
}

TEST_F(CalibrateCommands, VignettingSaysThatAShotIsSaturatedOrBlack) {
  calibrate::write_lens(path("lens.toml"), made::scene_lens());
  for (const float value : {0.0F, 1.0F}) {
    capture::Image field = capture::make_image(240, 320);
    std::ranges::fill(field.pixels, value);
    capture::write_exr(path("field.exr"), field);
    const Outcome outcome =
        run("calibrate vignetting " + path("field.exr") + " --lens " + path("lens.toml"));
    EXPECT_EQ(outcome.status, 1);
    EXPECT_THAT(outcome.err, HasSubstr(value > 0 ? "100 % of it is saturated; take a shorter"
                                                 : "100 % of it is black; take a longer"));
  }
}

TEST_F(CalibrateCommands, PoseOfAFishEyeComesOutAsALineForASet) {
  const calibrate::Pose truth = calibrate::look_at({0.4, -0.3, 1.2}, {2, 1, 0}, 0.1);
  calibrate::write_lens(path("lens.toml"), made::fish_eye());
  const std::string markers = write("markers.toml", markers_text(made::fish_eye(), truth, 9, "a"));
  const std::string command = "calibrate pose --lens " + path("lens.toml") + " --markers " +
                              markers + " -o " + path("pose.toml");
  const Outcome outcome = run_with_figures(command);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("looks along ["));
  EXPECT_THAT(outcome.out, HasSubstr("m8"));
  const Json found = figures();
  EXPECT_EQ(found["markers"].size(), 9U);
  EXPECT_EQ(found["ambiguous"], false);
  EXPECT_LT(found["rms_px"], 0.5);
  EXPECT_NEAR(found["roll_deg"], 0.1 / made::degree, 0.2);
  const made::PoseError error = made::error_of(calibrate::read_pose(path("pose.toml")), truth);
  EXPECT_LT(error.turn_rad / made::degree, 3 * double{found["sigma_deg"]});
  EXPECT_LT(1000 * error.position_m, 3 * double{found["sigma_mm"]});

  EXPECT_EQ(run(command + " --picture a").status, 0);
  const Outcome other = run(command + " --picture b");
  EXPECT_EQ(other.status, 1);
  expect_one_line(other.err);
  EXPECT_THAT(other.err, HasSubstr("no marker is of picture \"b\""));
  EXPECT_EQ(run(command + ".txt").status, 2);
  const Outcome no_model = run("calibrate pose --lens " + path("lens.toml") + " --markers " +
                               markers + " -o " + path("pose.cameramodel"));
  EXPECT_EQ(no_model.status, 1);
  EXPECT_THAT(no_model.err, HasSubstr("a .toml file takes the pose of any lens"));
}

TEST_F(CalibrateCommands, PoseWarnsWhereItCannotBeThatOfASet) {
  const calibrate::Lens lens{"LENSMODEL_PINHOLE", 1280, 720, {900, 900, 640, 360}};
  const calibrate::Pose truth = calibrate::look_at({1, -7, 1.6}, {0, 0, 0}, 0);
  calibrate::write_lens(path("lens.cameramodel"), lens);
  // On the ground, with one axis of the other sign, or scaled.
  const auto warnings = [&](calibrate::Vec3 written) {
    std::string text;
    for (int i = 0; i < 9; ++i) {
      const calibrate::Vec3 p{1.2 * (i % 3) - 1.1, 1.3 * (i / 3) - 1.0, 0};
      const auto q = project(lens, truth * p);
      text += fmt::format("[[marker]]\nname = \"m{}\"\nposition = [{}, {}, 0]\npixel = [{}, {}]\n",
                          i, written.x * p.x, written.y * p.y, q->x, q->y);
    }
    const Outcome outcome =
        run("calibrate pose --lens " + path("lens.cameramodel") + " --markers " +
            write("markers.toml", text) + " -o " + path("pose.toml"));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(warnings({1, 1, 0}), testing::Not(HasSubstr("below all")));
  EXPECT_THAT(warnings({1, -1, 0}), testing::AllOf(HasSubstr("m below all that it is found by"),
                                                   HasSubstr("z points down in the picture")));
  EXPECT_THAT(warnings({1000, 1000, 0}), HasSubstr("are the positions in metres?"));
}

TEST_F(CalibrateCommands, PoseOfMrcalsLensesGoesIntoTheirFiles) {
  const calibrate::Lens lens{"LENSMODEL_PINHOLE", 1280, 720, {900, 900, 640, 360}};
  const calibrate::Pose truth = calibrate::look_at({0, -7, 1.6}, {0, 0, 0.6}, 0);
  calibrate::write_lens(path("lens.cameramodel"), lens);
  const std::string markers = write("markers.toml", markers_text(lens, truth, 8, "a"));
  const Outcome outcome = run("calibrate pose --lens " + path("lens.cameramodel") + " --markers " +
                              markers + " -o " + path("posed.cameramodel"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const calibrate::CameraModel model = calibrate::read_camera_model(path("posed.cameramodel"));
  EXPECT_EQ(model.lens, lens);
  EXPECT_LT(made::error_of(*model.cam_from_ref, truth).turn_rad, 0.002);
}

TEST_F(CalibrateCommands, PoseComesFromABoardThatLiesInTheSet) {
  const calibrate::Lens lens{"LENSMODEL_PINHOLE", 640, 480, {600, 600, 319.5, 239.5}};
  const calibrate::Board board{calibrate::Board::Kind::chessboard, 9, 6, 0.05, 0, ""};
  // Seen from behind the row that is farthest down in the board: the set's y runs away from there.
  const calibrate::Pose truth = calibrate::look_at({0.3, -0.8, 0.6}, {0.2, -0.12, 0}, 0.05);
  const calibrate::Pose set_from_board{{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, {}};
  const auto picture = made::render_board(board, truth * set_from_board, lens, {.noise = 1});
  capture::write_png(dir_ / "board.png", lens.width, lens.height, 1, picture.pixels);
  calibrate::write_lens(path("lens.toml"), lens);
  const std::string pose = "calibrate pose " + path("board.png") + " --lens " + path("lens.toml") +
                           " --square 0.05 -o " + path("pose.toml") + " --board ";
  const std::string command = pose + "9x6";
  const Outcome outcome = run_with_figures(command);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("54 corners"));
  EXPECT_LT(figures()["rms_px"], 0.2);
  const made::PoseError error = made::error_of(calibrate::read_pose(path("pose.toml")), truth);
  EXPECT_LT(error.turn_rad / made::degree, 0.05);
  EXPECT_LT(error.position_m, 0.001);

  // The same board a metre higher and further to the right.
  const std::string place = write("board.toml",
                                  "pose = { position = [1, 0, 1], "
                                  "rotation = [1, 0, 0, 0, -1, 0, 0, 0, -1] }\n");
  ASSERT_EQ(run(command + " --board-pose " + place).status, 0);
  const calibrate::Pose moved = calibrate::read_pose(path("pose.toml"));
  EXPECT_LT(length(position_of(moved) - position_of(truth) - calibrate::Vec3{1, 0, 1}), 0.001);

  const Outcome absent = run(pose + "10x7");
  EXPECT_EQ(absent.status, 1);
  expect_one_line(absent.err);
  EXPECT_THAT(absent.err, HasSubstr("board.png"));
  EXPECT_EQ(run(command + " --markers " + place).status, 2);
  EXPECT_EQ(run("calibrate pose --lens " + path("lens.toml") + " -o " + path("a.toml")).status, 2);
}

TEST_F(CalibrateCommands, PoseWarnsOfABoardThatLooksAlikeAfterHalfATurn) {
  const calibrate::Lens lens{"LENSMODEL_PINHOLE", 640, 480, {600, 600, 319.5, 239.5}};
  const calibrate::Board board{calibrate::Board::Kind::chessboard, 8, 6, 0.05, 0, ""};
  const calibrate::Pose truth = calibrate::look_at({0.3, -0.8, 0.6}, {0.2, -0.12, 0}, 0.05);
  const calibrate::Pose set_from_board{{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, {}};
  const auto picture = made::render_board(board, truth * set_from_board, lens, {.noise = 1});
  capture::write_png(dir_ / "board.png", lens.width, lens.height, 1, picture.pixels);
  calibrate::write_lens(path("lens.toml"), lens);
  const Outcome outcome =
      run_with_figures("calibrate pose " + path("board.png") + " --lens " + path("lens.toml") +
                       " --board 8x6 --square 0.05 -o " + path("pose.toml"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("8x6 corners looks alike after half a turn"));
  EXPECT_THAT(figures()["warnings"].dump(), HasSubstr("half a turn"));
}

TEST_F(CalibrateCommands, WhatWasReadIsNotWrittenOver) {
  calibrate::write_lens(path("lens.toml"), made::fish_eye());
  const calibrate::Pose truth = calibrate::look_at({0.4, -0.3, 1.2}, {2, 1, 0}, 0.1);
  write("markers.toml", markers_text(made::fish_eye(), truth, 9, "a"));
  const std::string of_both =
      " --lens " + path("lens.toml") + " --markers " + path("markers.toml") + " -o ";
  const std::string lenses =
      " a=none b=none --lens a=" + path("lens.toml") + " --lens b=" + path("other.toml") + " -o ";
  calibrate::write_lens(path("other.toml"), made::fish_eye());
  write("cam.rsp", "1 1 0\n1 1 0\n1 1 0\n");
  for (const std::string& words :
       {"calibrate response " + path("lens.toml") + " --compare " + path("cam.rsp") + " -o " +
            path("cam.rsp"),
        "calibrate lens " + path("shot.html") + " --board 9x6 --square 0.05 -o " +
            path("lens.toml") + " --report " + path("shot.html")}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 1) << words;
    EXPECT_THAT(outcome.err, HasSubstr("would be lost")) << words;
  }
  EXPECT_EQ(content_of(path("cam.rsp")), "1 1 0\n1 1 0\n1 1 0\n");
  const std::string set = "[show]\nwidth = 64\n";
  write("set.toml", set);
  for (const std::string& words : {"calibrate pose" + of_both + path("lens.toml"),
                                   "calibrate pose" + of_both + path("set.toml"),
                                   "calibrate probe" + of_both + path("set.toml"),
                                   "calibrate probe" + of_both + path("lens.toml"),
                                   "calibrate probe" + of_both + path("markers.toml"),
                                   "calibrate rig" + lenses + path("lens.toml"),
                                   "calibrate rig" + lenses + path("other.toml")}) {
    const std::string lens = content_of(path("lens.toml"));
    const std::string markers = content_of(path("markers.toml"));
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 1) << words;
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr("would be lost")) << words;
    EXPECT_EQ(content_of(path("lens.toml")), lens) << words;
    EXPECT_EQ(content_of(path("markers.toml")), markers) << words;
    EXPECT_EQ(content_of(path("set.toml")), set) << words;
  }
}

// With sources that are not there: what is wrong with the result is said before they are looked at.
TEST_F(CalibrateCommands, WhatCannotBeWrittenIsRefusedBeforeTheWork) {
  calibrate::write_lens(path("lens.toml"), made::fish_eye());
  const std::string nowhere = path("nowhere/pose.toml");
  const auto reason = [&](const std::string& words, int status) {
    const Outcome outcome = run("calibrate " + words);
    EXPECT_EQ(outcome.status, status) << words;
    expect_one_line(outcome.err);
    return outcome.err;
  };
  const std::string lens = " --lens " + path("lens.toml");
  for (const std::string command : {"pose", "probe"}) {
    const std::string words = command + lens + " --markers none -o ";
    EXPECT_THAT(reason(words + nowhere, 1), HasSubstr("no such directory"));
    EXPECT_THAT(reason(words + path("pose.cameramodel"), 1),
                HasSubstr("a .toml file takes the pose of any lens"));
  }
  const std::string lenses =
      " --lens a=" + path("lens.toml") + " --lens b=" + path("lens.toml") + " -o ";
  EXPECT_THAT(reason("rig a=none b=none" + lenses + nowhere, 1), HasSubstr("no such directory"));
  EXPECT_THAT(reason("offset none none --board 10x7 --charuco --dictionary NOPE", 2),
              HasSubstr("there is no dictionary of markers \"NOPE\""));
}

TEST_F(CalibrateCommands, LiveCamerasAreToBeRecordedFirst) {
  calibrate::write_lens(path("lens.toml"), made::fish_eye());
  for (const std::string& words :
       {"lens v4l2:/dev/video99 -o " + path("new.toml"),
        "rig a=v4l2:/dev/video99 b=aravis:none --lens a=" + path("lens.toml") +
            " --lens b=" + path("lens.toml") + " -o " + path("rig.toml")}) {
    const Outcome outcome = run("calibrate " + words);
    EXPECT_EQ(outcome.status, 1) << words;
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr("v4l2:/dev/video99: is a live camera")) << words;
    EXPECT_THAT(outcome.err, HasSubstr("record it first")) << words;
  }
}

TEST_F(CalibrateCommands, PoseSaysWhatIsMissing) {
  calibrate::write_lens(path("lens.toml"), made::fish_eye());
  const std::string markers = write(
      "markers.toml", markers_text(made::fish_eye(), calibrate::look_at({}, {1, 0, 0}, 0), 3, "a"));
  const Outcome outcome = run("calibrate pose --lens " + path("lens.toml") + " --markers " +
                              markers + " -o " + path("pose.toml"));
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
  EXPECT_THAT(outcome.err, HasSubstr("add a fourth"));
}

TEST_F(CalibrateCommands, ProbeIsTurnedByMarkersFromAKnownPosition) {
  const calibrate::Pose truth = calibrate::pose_from_axis({0.4, -0.3, 1.2}, {0.1, 0.2, 1}, 0.6);
  calibrate::write_lens(path("lens.toml"), made::fish_eye());
  const std::string few = write("few.toml", markers_text(made::fish_eye(), truth, 3, "probe"));
  const std::string many = write("many.toml", markers_text(made::fish_eye(), truth, 9, "probe"));
  const std::string command =
      "calibrate probe --lens " + path("lens.toml") + " -o " + path("pose.toml") + " --markers ";
  const auto error_deg = [&] {
    return made::error_of(calibrate::read_pose(path("pose.toml")), truth).turn_rad / made::degree;
  };
  ASSERT_EQ(run_with_figures(command + few + " --position 0.4,-0.3,1.2").status, 0);
  EXPECT_LT(error_deg(), 4 * double{figures()["sigma_deg"]});
  EXPECT_FALSE(figures().contains("sigma_mm"));
  ASSERT_EQ(run_with_figures(command + many).status, 0);
  EXPECT_LT(error_deg(), 4 * double{figures()["sigma_deg"]});
  EXPECT_GT(figures()["sigma_mm"], 0);

  const std::string two = write("two.toml", markers_text(made::fish_eye(), truth, 2, "probe"));
  EXPECT_THAT(run(command + two + " --position 0.4,-0.3,1.2").err,
              HasSubstr("the turn rests on two markers"));
  const Outcome too_few = run(command + few);
  EXPECT_EQ(too_few.status, 1);
  EXPECT_THAT(too_few.err, HasSubstr("--position needs only two"));
  EXPECT_EQ(run(command + few + " --position 0.4,-0.3").status, 2);
  EXPECT_EQ(run(command + few + " --position 0.4,-0.3,x").status, 2);
}

TEST_F(CalibrateCommands, ProbesTurnCountsItsLensAndDoubtsAWrongMarker) {
  const calibrate::Pose truth = calibrate::pose_from_axis({0.4, -0.3, 1.2}, {0.1, 0.2, 1}, 0.6);
  calibrate::Lens lens = made::fish_eye();
  const std::string markers = markers_text(lens, truth, 4, "probe");
  const std::string command = "calibrate probe --lens " + path("lens.toml") + " -o " +
                              path("pose.toml") + " --position 0.4,-0.3,1.2 --markers ";
  calibrate::write_lens(path("lens.toml"), lens);
  const Outcome unknown = run_with_figures(command + write("markers.toml", markers));
  ASSERT_EQ(unknown.status, 0);
  EXPECT_THAT(unknown.err, HasSubstr("does not tell its own error"));
  EXPECT_TRUE(figures()["warnings"].empty());
  const double without = figures()["sigma_deg"];
  lens.error_px = 10;
  calibrate::write_lens(path("lens.toml"), lens);
  ASSERT_EQ(run_with_figures(command + path("markers.toml")).status, 0);
  EXPECT_GT(double{figures()["sigma_deg"]}, 5 * without);
  EXPECT_EQ(run_with_figures(command + path("markers.toml")).err, "");
  // From a place that is 20 cm off.
  const std::string off = "calibrate probe --lens " + path("lens.toml") + " -o " +
                          path("pose.toml") + " --position 0.6,-0.3,1.2 --markers ";
  EXPECT_THAT(run(off + path("markers.toml")).err, HasSubstr("far above the noise"));
}

TEST_F(CalibrateCommands, LensTakesPicturesWhoseNamesAreNoUtf8) {
  const calibrate::Board board{calibrate::Board::Kind::chessboard, 6, 5, 0.05, 0, ""};
  const calibrate::Lens lens{"pinhole", 320, 240, {270, 270, 159.5, 119.5}};
  std::mt19937 random(3);
  std::string pictures;
  for (int i = 0; i < 5; ++i) {
    const calibrate::Pose cam_from_board =
        made::make_board_pose(board, {0.02 * i - 0.04, 0.01 * i - 0.02, 1}, 0.55, 0.5, 0.3, random);
    const calibrate::GreyPicture picture = made::render_board(board, cam_from_board, lens);
    const std::string name = path("caf\xe9" + std::to_string(i) + ".png");  // Latin-1
    capture::write_png(name, picture.width, picture.height, 1, picture.pixels);
    pictures += " " + name;
  }
  const Outcome outcome = run_with_figures(
      "calibrate lens" + pictures + " --board 6x5 --square 0.05 --model LENSMODEL_PINHOLE -o " +
      path("lens.yml"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(calibrate::read_lens(path("lens.yml")).model, "pinhole");
  EXPECT_THAT(std::string{figures()["views"][0]["name"]}, HasSubstr("caf\xef\xbf\xbd"));
}

TEST_F(CalibrateCommands, LensRefusesBeforeItsWorkWhatCannotBeWritten) {
  const std::string command = "calibrate lens none.png --board 9x6 --square 0.05 ";
  const Outcome form = run(command + "--model LENSMODEL_CAHVOR -o " + path("lens.yml"));
  EXPECT_EQ(form.status, 2);
  EXPECT_THAT(form.err, HasSubstr("OpenCV has no model for a lens of LENSMODEL_CAHVOR"));
  const Outcome report = run(command + "-o " + path("lens.toml") + " --report " + path("a.png"));
  EXPECT_EQ(report.status, 2);
  EXPECT_THAT(report.err, HasSubstr("--report names a .html file"));
  const Outcome place = run(command + "-o " + path("nowhere/lens.toml"));
  EXPECT_EQ(place.status, 1);
  EXPECT_THAT(place.err, HasSubstr("no such directory"));
}

TEST_F(CalibrateCommands, ProbeIsTurnedByLampsThatTheSceneCameraSeesToo) {
  const made::LampWorld world{{{calibrate::normalize(calibrate::Vec3{-0.4, 1, 0.2})},
                               {calibrate::normalize(calibrate::Vec3{0.1, 1, 0.3}), 0.03, 8},
                               {calibrate::normalize(calibrate::Vec3{0.45, 1, -0.1}), 0.015, 300}}};
  const calibrate::Pose plate_pose = calibrate::look_at({0, -4, 1}, {0, 0, 1}, 0.02);
  const calibrate::Pose truth = calibrate::pose_from_axis({}, {0.1, 0.7, 1}, 2);
  made::Random random(4);
  capture::write_exr(path("plate.exr"),
                     made::photograph(world, made::scene_lens(), plate_pose.R, 1, 0.02, random));
  capture::write_exr(path("light.exr"),
                     made::photograph(world, made::probe_lens(), truth.R, 1e4, 0.02, random));
  calibrate::write_lens(path("plate.toml"), made::scene_lens());
  calibrate::write_lens(path("light.toml"), made::probe_lens());
  calibrate::write_pose(path("plate_pose.toml"), plate_pose, made::scene_lens(), "made");
  const std::string command = "calibrate probe --lens " + path("light.toml") + " --light " +
                              path("light.exr") + " --plate " + path("plate.exr") +
                              " --plate-lens " + path("plate.toml") + " -o " + path("pose.toml");
  const Outcome outcome = run_with_figures(command + " --plate-pose " + path("plate_pose.toml") +
                                           " --position 0,0,1 --lamp-distance 1e6");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(figures()["sources"].size(), 3U);
  const made::PoseError error = made::error_of(calibrate::read_pose(path("pose.toml")), truth);
  EXPECT_LT(error.turn_rad / made::degree, 0.3);
  EXPECT_LT(error.turn_rad / made::degree, 4 * double{figures()["sigma_deg"]});
  EXPECT_LT(figures()["sigma_deg"], 0.3);
  EXPECT_EQ(run(command).status, 2);

  // Lamps of a room are seen otherwise from 30 cm beside the plate's camera.
  const Outcome near = run_with_figures(command + " --plate-pose " + path("plate_pose.toml") +
                                        " --position 0.3,-4,1");
  ASSERT_EQ(near.status, 0) << near.err;
  EXPECT_THAT(near.err, HasSubstr("0.30 m from the plate's camera"));
  EXPECT_NEAR(figures()["sigma_deg"], 3.4, 0.2);
  const Outcome unknown = run_with_figures(command + " --plate-pose " + path("plate_pose.toml"));
  EXPECT_THAT(unknown.err, HasSubstr("from one place"));
  EXPECT_TRUE(figures()["parallax_deg"].is_null());
}

}  // namespace
}  // namespace studio::calibrate_commands_test
