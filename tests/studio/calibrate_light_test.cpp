// The command that measures the light's gain, as its users see it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
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

namespace studio::calibrate_light_test {
namespace {

using testing::HasSubstr;

// A set whose plate is `gain` times the probe's light, by colour, but for a clipped lamp, and a
// level card of albedo 0.4 in its corner.
class CalibrateLight : public CalibrateCommands {
 protected:
  const std::array<float, 3> gain_{0.9F, 0.5F, 1.4F};

  void SetUp() override {
    CalibrateCommands::SetUp();
    const made::LampWorld world{{{calibrate::normalize(calibrate::Vec3{0.1, 1, 0.3}), 0.05, 8}}};
    const calibrate::Pose plate_pose = calibrate::look_at({0, 0, 1}, {0, 1, 1.4}, 0.1);
    const calibrate::Pose probe_pose = calibrate::pose_from_axis({}, {0, 0, 1}, 0.3);
    made::Random random(5);
    capture::Image plate =
        made::photograph(world, made::scene_lens(), plate_pose.R, 1e9, 0.02, random);
    const double card = 0.4 / std::numbers::pi * irradiance(world);
    for (int y = 0; y < plate.height; ++y) {
      for (int x = 0; x < plate.width; ++x) {
        for (int c = 0; c < 3; ++c) {
          float& value = plate.at(y, x, c);
          if (x < 30 && y < 20) value = static_cast<float>(card);
          value = std::min(value * gain_[static_cast<std::size_t>(c)], 1.0F);
        }
      }
    }
    capture::write_exr(path("plate.exr"), plate);
    capture::write_exr(path("light.exr"), made::photograph(world, made::probe_lens(), probe_pose.R,
                                                           1e4, 0.02, random));
    calibrate::write_lens(path("plate.toml"), made::scene_lens());
    calibrate::write_lens(path("light.toml"), made::probe_lens());
    calibrate::write_pose(path("plate_pose.toml"), plate_pose, made::scene_lens(), "made");
    const auto line = content_of(path("plate_pose.toml"));
    write("set.toml",
          "[show]\nwidth = 320\nheight = 240\n[camera]\nsource = \"plate.exr\"\n"
          "colour = \"linear\"\nlens = \"plate.toml\"\n" +
              line +
              "[probe]\nsource = \"light.exr\"\nlens = \"light.toml\"\n"
              "pose = { axis = [0, 0, 1], roll = " +
              fmt::format("{}", 0.3 / made::degree) + " }\n");
  }

  static double irradiance(const made::LampWorld& world) {
    constexpr int directions = 40'000;
    double sum = 0;
    for (int i = 0; i < directions; ++i) {
      const double z = (i + 0.5) / directions;
      const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
      const double r = std::sqrt(1 - z * z);
      sum += z * world.light({r * std::cos(turn), r * std::sin(turn), z});
    }
    return sum * 2 * std::numbers::pi / directions;
  }

  void expect_gain() const {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(double{figures()["gain"][c]} / static_cast<double>(gain_[c]), 1, 0.02);
    }
  }
};

TEST_F(CalibrateLight, FindsTheGainFromWhatBothCamerasSee) {
  const Outcome outcome = run_with_figures("calibrate light " + path("set.toml"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("match = ["));
  expect_gain();
  EXPECT_GT(figures()["pairs"], 100);
  EXPECT_LT(figures()["heldout_error"], 0.1);
  EXPECT_FALSE(figures().contains("matrix"));
}

// They are not opened: the light is measured while the person's camera is not there.
TEST_F(CalibrateLight, NeedsNoVideosAndPersons) {
  write("set.toml", content_of(path("set.toml")) +
                        "[[object]]\nname = \"tv\"\nmade = \"tv\"\n"
                        "[[video]]\nobject = \"tv/tv\"\nsource = \"plate.exr\"\n"
                        "[[billboard]]\nsource = \"v4l2:/dev/none\"\nheight = 2\n"
                        "position = [0, 5, 0]\n");
  const Outcome outcome = run_with_figures("calibrate light " + path("set.toml"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_gain();
}

TEST_F(CalibrateLight, LooksAtAllFramesOfAPlateThatLoops) {
  for (const char* name : {"plate_0.exr", "plate_1.exr"}) {
    fs::copy_file(path("plate.exr"), path(name));
  }
  std::string looping = content_of(path("set.toml"));
  const std::string still = "source = \"plate.exr\"\n";
  looping.replace(looping.find(still), still.size(), "source = \"plate_%d.exr\"\nloop = true\n");
  write("set.toml", looping);
  const std::string card = write("card.toml", "[[patch]]\npixels = [4, 3, 20, 12]\nalbedo = 0.4\n");
  const Outcome outcome =
      run_with_figures("calibrate light " + path("set.toml") + " --frames 3 --patches " + card);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(figures()["pairs"], 3);
  fs::remove(path("plate_1.exr"));
  ASSERT_EQ(run_with_figures("calibrate light " + path("set.toml") + " --patches " + card).status,
            0);
  EXPECT_EQ(figures()["pairs"], 1) << "the same picture again and again";
}

TEST_F(CalibrateLight, FindsTheGainFromAGreyCard) {
  const std::string card = write("card.toml", "[[patch]]\npixels = [4, 3, 20, 12]\nalbedo = 0.4\n");
  const Outcome outcome =
      run_with_figures("calibrate light " + path("set.toml") + " --patches " + card);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_gain();
  EXPECT_EQ(figures()["pairs"], 1);

  const std::string bad = write("bad.toml", "[[patch]]\npixels = [4, 3, 20]\nalbedo = 2\n");
  const Outcome refused = run("calibrate light " + path("set.toml") + " --patches " + bad);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("bad.toml:2:"));
  EXPECT_THAT(refused.err, HasSubstr("bad.toml:3:"));
  const std::string outside =
      write("outside.toml", "[[patch]]\npixels = [310, 3, 20, 9]\nalbedo = 0.4\n");
  const Outcome out = run("calibrate light " + path("set.toml") + " --patches " + outside);
  EXPECT_EQ(out.status, 1);
  expect_one_line(out.err);
  EXPECT_THAT(out.err, HasSubstr("outside.toml:2:"));
  EXPECT_THAT(out.err, HasSubstr("reaches beyond the picture of 320x240"));
  const std::string flat = write("flat.toml", "[[patch]]\npixels = [4, 3, 0, 12]\nalbedo = 0.4\n");
  EXPECT_THAT(run("calibrate light " + path("set.toml") + " --patches " + flat).err,
              HasSubstr("flat.toml:2:"));
}

// What is around stands in the plate's camera in other light than the card.
TEST_F(CalibrateLight, TellsWhatBothCamerasSeeOfACardsGain) {
  constexpr float around = 0.7F;
  capture::Image plate = capture::read_exr(path("plate.exr"));
  for (int y = 0; y < plate.height; ++y) {
    for (int x = y < 20 ? 30 : 0; x < plate.width; ++x) {
      for (int c = 0; c < 3; ++c) plate.at(y, x, c) *= around;
    }
  }
  capture::write_exr(path("plate.exr"), plate);
  const std::string card = write("card.toml", "[[patch]]\npixels = [4, 3, 20, 12]\nalbedo = 0.4\n");
  const Outcome outcome =
      run_with_figures("calibrate light " + path("set.toml") + " --patches " + card);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_gain();
  const double overlap = figures()["overlap"];
  EXPECT_NEAR(overlap, around, 0.01);
  EXPECT_THAT(outcome.out, HasSubstr("with follow = true, say overlap = 0."));
  EXPECT_THAT(outcome.err, testing::Not(HasSubstr("looks elsewhere")));
  const std::string set = content_of(path("set.toml"));
  const auto exposure_with = [&](const std::string& more) {
    write("follow.toml", set + "match = { gain = [0.9, 0.5, 1.4], follow = true" + more + " }\n" +
                             "[[object]]\nname = \"ball\"\nmade = \"glass_sphere\"\npose = { "
                             "position = [0, 5, 1] }\n");
    const Outcome shown = run_with_figures("run " + path("follow.toml") + " --frames 1");
    EXPECT_EQ(shown.status, 0) << shown.err;
    return figures()["match_exposure"].get<double>();
  };
  EXPECT_NEAR(exposure_with(""), around, 0.02);
  EXPECT_NEAR(exposure_with(fmt::format(", overlap = {}", overlap)), 1, 0.02);

  const std::string wrong =
      write("wrong.toml", "[[patch]]\npixels = [4, 3, 20, 12]\nalbedo = 0.2\n");
  const Outcome doubtful = run("calibrate light " + path("set.toml") + " --patches " + wrong);
  EXPECT_EQ(doubtful.status, 0);
  EXPECT_THAT(doubtful.err, HasSubstr("tell 0.35 of the patches' gain: the probe or the plate's "
                                      "camera looks elsewhere than is said"));
  write("follow.toml", set + "match = { gain = [1, 1, 1], overlap = 0.7 }\n");
  const Outcome fixed = run("check " + path("follow.toml"));
  EXPECT_THAT(fixed.err, HasSubstr("overlap"));
  EXPECT_THAT(fixed.err, HasSubstr("is of use only with follow = true"));
}

TEST_F(CalibrateLight, NamesPatchesThatTellNothing) {
  capture::Image plate = capture::read_exr(path("plate.exr"));
  for (int y = 0; y < 20; ++y) {
    for (int x = 40; x < 60; ++x) {
      for (int c = 0; c < 3; ++c) plate.at(y, x, c) = 1;
    }
  }
  capture::write_exr(path("plate.exr"), plate);
  const std::string clipped = "[[patch]]\npixels = [42, 3, 10, 10]\nalbedo = 0.4\n";
  const std::string both =
      write("both.toml", clipped + "[[patch]]\npixels = [4, 3, 20, 12]\nalbedo = 0.4\n");
  const Outcome outcome =
      run_with_figures("calibrate light " + path("set.toml") + " --patches " + both);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("both.toml:2: this patch is left out"));
  EXPECT_THAT(outcome.err, testing::Not(HasSubstr("both.toml:5:")));
  EXPECT_EQ(figures()["pairs"], 1);
  expect_gain();

  const Outcome none =
      run("calibrate light " + path("set.toml") + " --patches " + write("clipped.toml", clipped));
  EXPECT_EQ(none.status, 1);
  expect_one_line(none.err);
  EXPECT_THAT(none.err, HasSubstr("clipped.toml:2: none of 1 patches tells anything"));
}

}  // namespace
}  // namespace studio::calibrate_light_test
