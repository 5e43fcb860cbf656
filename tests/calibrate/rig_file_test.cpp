// Rigs in files.
#include "calibrate/rig_file.h"

#include <gtest/gtest.h>

#include "tests/calibrate/made_markers.h"
#include "tests/made_files.h"

namespace calibrate::rig_file_test {
namespace {

TEST(WriteRig, IsUndoneByReadRig) {
  const auto directory = made::make_temporary_directory();
  const std::string path = directory / "rig.toml";
  made::Random random(3);
  const std::vector<RigMember> cameras{
      {"plate", directory / "plate.cameramodel", Pose{}, 0, ""},
      {"the \"probe\"", directory / "lenses/probe.toml", made::random_pose(random), -0.0125,
       directory / "probe response.toml"},
      {"person", "/elsewhere/person.yml", made::random_pose(random), 0.04, ""}};
  write_rig(path, cameras, "three cameras");
  const std::vector<RigMember> read = read_rig(path);
  ASSERT_EQ(read.size(), cameras.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].name, cameras[i].name);
    EXPECT_EQ(read[i].lens, cameras[i].lens);
    EXPECT_EQ(read[i].response, cameras[i].response);
    EXPECT_EQ(read[i].time_offset_s, cameras[i].time_offset_s);
    const made::PoseError error = made::error_of(read[i].cam_from_rig, cameras[i].cam_from_rig);
    EXPECT_LT(error.turn_rad, 1e-12);
    EXPECT_LT(error.position_m, 1e-12);
  }
}

TEST(WriteRig, RefusesCamerasWithoutNameOrLens) {
  const std::string path = made::make_temporary_directory() / "rig.toml";
  const auto write = [&](std::vector<RigMember> cameras) { write_rig(path, cameras, ""); };
  EXPECT_THROW(write({{"", "a.toml", {}, 0, ""}}), std::invalid_argument);
  EXPECT_THROW(write({{"a", "", {}, 0, ""}}), std::invalid_argument);
  EXPECT_THROW(write({{"a", "a.toml", {}, 0, ""}, {"a", "b.toml", {}, 0, ""}}),
               std::invalid_argument);
  EXPECT_THROW(write_rig("rig.yml", {}, ""), std::invalid_argument);
}

TEST(ReadRig, RefusesEveryBadFileWithPlaceAndReason) {
  made::expect_refusals(
      "rig_", ".toml",
      {{"rig_empty.toml", ": has no [[camera]]"},
       {"rig_syntax.toml", ":1:"},
       {"rig_one_table.toml", ": has no [[camera]]"},
       {"rig_unknown_key.toml", ":6:1: unknown key \"offset\""},
       {"rig_no_lens.toml", ":1:1: this camera has no \"lens\""},
       {"rig_no_name.toml", ":1:1: this camera has no \"name\""},
       {"rig_name_twice.toml", ":6:1: camera \"a\" is here for the second time"},
       {"rig_mirror.toml", ":5:12: \"rotation\": "},
       {"rig_eight_numbers.toml", ":5:12: \"rotation\" must be a list of 9 numbers"},
       {"rig_nan.toml", ":4:16: \"position\" must hold numbers"},
       {"rig_offset_of_hours.toml", ":6:15: \"time_offset\" must be within 60 seconds"},
       {"rig_word_for_number.toml", ":6:15: \"time_offset\" must hold numbers"}},
      read_rig);
}

}  // namespace
}  // namespace calibrate::rig_file_test
