// Poses in files of their own.
#include "calibrate/pose_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/calibrate/made_markers.h"
#include "tests/made_files.h"

namespace calibrate::pose_file_test {
namespace {

TEST(WritePose, IsUndoneByReadPoseInBothKindsOfFile) {
  const auto directory = made::make_temporary_directory();
  const Lens pinhole{"pinhole", 640, 480, {500, 500, 319.5, 239.5}};
  made::Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Pose pose = made::random_pose(random);
    for (const char* name : {"pose.toml", "pose.cameramodel"}) {
      const std::string path = directory / name;
      write_pose(path, pose, pinhole, "made");
      const made::PoseError error = made::error_of(read_pose(path), pose);
      EXPECT_LT(error.turn_rad, 1e-12);
      EXPECT_LT(error.position_m, 1e-12);
    }
  }
}

TEST(WritePose, RefusesFilesThatCannotHoldIt) {
  const auto directory = made::make_temporary_directory();
  EXPECT_THROW(write_pose(directory / "a.cameramodel", {}, made::fish_eye(), ""),
               std::invalid_argument);
  EXPECT_THROW(write_pose(directory / "a.txt", {}, made::fish_eye(), ""), std::invalid_argument);
  EXPECT_NO_THROW(write_pose(directory / "a.toml", {}, made::fish_eye(), ""));
}

TEST(ReadPose, RefusesEveryBadFileWithPlaceAndReason) {
  made::expect_refusals(
      "pose_", ".toml",
      {{"pose_empty.toml", ": has no pose = {"},
       {"pose_syntax.toml", ":1:"},
       {"pose_unknown_key.toml", ":1:32: unknown key \"roll\""},
       {"pose_other_section.toml", ":2:1: unknown key \"name\""},
       {"pose_no_rotation.toml", ":1:8: this pose has no \"rotation\""},
       {"pose_eight_numbers.toml", ":1:43: \"rotation\" must be a list of 9 numbers"},
       {"pose_mirror.toml", "mirror image"},
       {"pose_nan.toml", ":1:25: \"position\" must hold numbers"},
       {"pose_too_far.toml", ":1:22: \"position\" must hold numbers of at most 1e6"}},
      read_pose);
  EXPECT_THROW(read_pose("pose.txt"), std::runtime_error);
}

TEST(ReadPose, TakesNoLensForAPose) {
  const auto directory = made::make_temporary_directory();
  const Lens pinhole{"pinhole", 640, 480, {500, 500, 319.5, 239.5}};
  write_lens(directory / "lens.cameramodel", pinhole);
  try {
    read_pose(directory / "lens.cameramodel");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("its extrinsics are all zero"));
  }
  write_pose(directory / "pose.toml", Pose{}, pinhole, "at the origin");
  EXPECT_EQ(read_pose(directory / "pose.toml"), Pose{});
}

}  // namespace
}  // namespace calibrate::pose_file_test
