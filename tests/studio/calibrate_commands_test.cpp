// The commands that measure cameras, as their users see them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/camera_model.h"
#include "calibrate/lens.h"
#include "calibrate/pose_file.h"
#include "tests/calibrate/made_markers.h"
#include "tests/studio/command_line.h"

namespace studio {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class CalibrateCommands : public CommandLine {
 protected:
  Json figures() const { return Json::parse(content_of(dir_ / "figures.json")); }
  std::string path(const std::string& name) const { return (dir_ / name).string(); }
  Outcome run_with_figures(const std::string& words) const {
    return run(words + " --json " + path("figures.json"));
  }
};

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

}  // namespace
}  // namespace studio
