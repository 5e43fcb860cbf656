// Sets whose cameras are of a rig: the same as with its values written out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "calibrate/rig_file.h"
#include "studio/set.h"
#include "tests/calibrate/made_markers.h"
#include "tests/made_files.h"

namespace studio::set_rig_test {
namespace {

namespace fs = std::filesystem;
using calibrate::Pose;
using testing::HasSubstr;

constexpr const char* linear_response = "1 1 0\n1 1 0\n1 1 0\n";

const calibrate::Lens plate_lens{"pinhole", 64, 48, {60, 60, 31.5, 23.5}};
const calibrate::Lens probe_lens{"equisolid", 40, 40, {14, 19.5, 19.5}, 1.6};

std::string rotation_of(const Pose& pose) {
  std::string text;
  for (const double v : pose.R.m) text += fmt::format("{}{:.17g}", text.empty() ? "" : ", ", v);
  return "[" + text + "]";
}

std::string pose_of(const Pose& pose) {
  const calibrate::Vec3 p = position_of(pose);
  return fmt::format("{{ position = [{:.17g}, {:.17g}, {:.17g}], rotation = {} }}", p.x, p.y, p.z,
                     rotation_of(pose));
}

class SetRig : public testing::Test {
 protected:
  void SetUp() override {
    dir_ = made::make_temporary_directory();
    fs::create_directories(dir_ / "rig");
    calibrate::write_lens(path("rig/plate.toml"), plate_lens);
    calibrate::write_lens(path("rig/probe.toml"), probe_lens);
    for (const char* name : {"rig/plate.rsp", "rig/probe.rsp"}) write(name, linear_response);
    write("map.exr", "x");
    calibrate::write_rig(
        path("rig/rig.toml"),
        std::vector<calibrate::RigMember>{
            {"left", path("rig/plate.toml"), Pose{}, 0.25, path("rig/plate.rsp")},
            {"up", path("rig/probe.toml"), up_from_rig_, 0.375, path("rig/probe.rsp")}},
        "made");
  }
  void TearDown() override { fs::remove_all(dir_); }

  std::string path(const std::string& name) const { return (dir_ / name).string(); }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(dir_ / name) << content;
    return path(name);
  }

  std::string set_of(const std::string& rig,
                     const std::string& camera,
                     const std::string& probe) const {
    return write("set.toml", "[show]\nwidth = 64\nheight = 48\n" + rig +
                                 "[camera]\nsource = \"map.exr\"\n" + camera +
                                 "[probe]\nsource = \"map.exr\"\n" + probe +
                                 "[[stand_in]]\nsize = [4, 4]\n");
  }

  static std::string rig(const std::string& pose) {
    return "[rig]\nfile = \"rig/rig.toml\"\n" + (pose.empty() ? "" : "pose = " + pose + "\n");
  }

  // Every line of what is said against the set.
  std::string faults_of(const std::string& set) const {
    try {
      read_set(set);
    } catch (const SetError& error) {
      return error.what();
    }
    ADD_FAILURE() << "was accepted";
    return "";
  }

  const Pose up_from_rig_ =
      calibrate::pose_from_axis({0.3, -0.4, 0.5}, {0.1, -1, 0.2}, 0.4);  // rig: y down
  const Pose rig_from_set_ = calibrate::look_at({0, -6, 1.6}, {0.5, 0, 0.4}, 0.1);
  fs::path dir_;
};

TEST_F(SetRig, GivesWhatTheSameValuesWrittenOutWould) {
  const Set of_rig = read_set(set_of(rig(pose_of(rig_from_set_)), "rig_camera = \"left\"\n",
                                     "rig_camera = \"up\"\nmatch = [1, 1, 1]\n"));
  const Set written =
      read_set(set_of("",
                      "lens = \"rig/plate.toml\"\nresponse = \"rig/plate.rsp\"\npose = " +
                          pose_of(rig_from_set_) + "\n",
                      "lens = \"rig/probe.toml\"\nresponse = \"rig/probe.rsp\"\noffset_s = 0.125\n"
                      "match = [1, 1, 1]\npose = " +
                          pose_of(up_from_rig_ * rig_from_set_) + "\n"));
  EXPECT_EQ(of_rig.camera.lens, written.camera.lens);
  EXPECT_EQ(of_rig.camera.response, written.camera.response);
  EXPECT_EQ(of_rig.camera.response, path("rig/plate.rsp"));
  const made::PoseError camera =
      made::error_of(of_rig.camera.pose.cam_from_set, written.camera.pose.cam_from_set);
  EXPECT_LT(camera.turn_rad, 1e-7);
  EXPECT_LT(camera.position_m, 1e-12);
  ASSERT_TRUE(of_rig.probe->lens);
  EXPECT_EQ(*of_rig.probe->lens, *written.probe->lens);
  EXPECT_EQ(of_rig.probe->response, written.probe->response);
  EXPECT_DOUBLE_EQ(of_rig.probe->offset_s, written.probe->offset_s);
  const made::PoseError probe =
      made::error_of(of_rig.probe->probe_from_set, written.probe->probe_from_set);
  EXPECT_LT(probe.turn_rad, 1e-7);
  EXPECT_LT(probe.position_m, 1e-12);
}

TEST_F(SetRig, GivesPersonsTheirCamerasToo) {
  const std::string person = "[[billboard]]\nsource = \"map.exr\"\nposition = [0, 0, 0]\n";
  const std::string further = "[[billboard.camera]]\nsource = \"map.exr\"\n";
  const std::string probe = "rig_camera = \"up\"\n";
  const std::string of_left =
      "lens = \"rig/plate.toml\"\nresponse = \"rig/plate.rsp\"\npose = " + pose_of(rig_from_set_) +
      "\n";
  const Set of_rig = read_set(set_of(rig(pose_of(rig_from_set_)), "rig_camera = \"left\"\n",
                                     probe + person + "rig_camera = \"left\"\n" + further + probe));
  const Set written =
      read_set(set_of(rig(pose_of(rig_from_set_)), "rig_camera = \"left\"\n",
                      probe + person + of_left + "offset_s = 0\n" + further +
                          "lens = \"rig/probe.toml\"\nresponse = \"rig/probe.rsp\"\n"
                          "offset_s = 0.125\npose = " +
                          pose_of(up_from_rig_ * rig_from_set_) + "\n"));
  ASSERT_EQ(of_rig.persons.at(0).cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const PersonCamera &a = of_rig.persons[0].cameras[i], &b = written.persons.at(0).cameras.at(i);
    EXPECT_EQ(a.lens, b.lens) << i;
    EXPECT_EQ(a.response, b.response) << i;
    EXPECT_FALSE(a.response.empty()) << i;
    EXPECT_DOUBLE_EQ(a.offset_s, b.offset_s) << i;
    EXPECT_LT(made::error_of(a.cam_from_set, b.cam_from_set).position_m, 1e-12) << i;
    EXPECT_LT(made::error_of(a.cam_from_set, b.cam_from_set).turn_rad, 1e-7) << i;
  }
  EXPECT_THAT(faults_of(set_of(rig(""), "rig_camera = \"left\"\n",
                               probe + person + "rig_camera = \"left\"\noffset_s = 1\n")),
              HasSubstr("is the rig's already"));
}

TEST_F(SetRig, StandsAtTheOriginIfNothingIsSaid) {
  const Set set = read_set(set_of(rig(""), "rig_camera = \"left\"\n", "rig_camera = \"up\"\n"));
  EXPECT_EQ(set.camera.pose.cam_from_set, Pose{});
  EXPECT_LT(made::error_of(set.probe->probe_from_set, up_from_rig_).position_m, 1e-12);
}

TEST_F(SetRig, LeavesTheClockOfAProbeToTheSetIfThePlateIsOfNoRig) {
  const std::string camera =
      "lens = \"rig/plate.toml\"\npose = { position = [0, -6, 1], look_at = [0, 0, 0] }\n";
  const Set set = read_set(set_of(rig(""), camera, "rig_camera = \"up\"\noffset_s = 0.5\n"));
  EXPECT_EQ(set.probe->offset_s, 0.5);
  EXPECT_EQ(read_set(set_of(rig(""), camera, "rig_camera = \"up\"\n")).probe->offset_s, 0);
}

TEST_F(SetRig, CropsTheLensOfTheRig) {
  calibrate::write_lens(path("rig/plate.toml"), {"pinhole", 100, 80, {60, 60, 49.5, 39.5}});
  const std::string crop = "rig_camera = \"left\"\ncrop = [10, 20, 64, 48]\n";
  const Set set = read_set(set_of(rig(""), crop, "rig_camera = \"up\"\n"));
  EXPECT_EQ(set.camera.lens.parameters, (std::vector<double>{60, 60, 39.5, 19.5}));
  EXPECT_THAT(faults_of(set_of(rig(""), "rig_camera = \"left\"\n", "rig_camera = \"up\"\n")),
              HasSubstr("set.toml:8:14: camera.rig_camera gives a picture of 100x80"));
}

TEST_F(SetRig, RefusesWhatIsSaidTwiceAndNamesThatTheRigDoesNotHave) {
  const std::string faults = faults_of(set_of(
      rig(""), "rig_camera = \"left\"\nlens = \"rig/plate.toml\"\nresponse = \"rig/plate.rsp\"\n",
      "rig_camera = \"up\"\npose = { axis = [0, 0, 1] }\noffset_s = 0.1\n"));
  EXPECT_THAT(faults, HasSubstr("set.toml:9:8: camera.lens is the rig's already"));
  EXPECT_THAT(faults, HasSubstr("set.toml:10:12: camera.response is the rig's already"));
  EXPECT_THAT(faults, HasSubstr("set.toml:14:8: probe.pose is the rig's already"));
  EXPECT_THAT(faults, HasSubstr("set.toml:15:12: probe.offset_s is the rig's already"));
  EXPECT_EQ(std::ranges::count(faults, '\n'), 3) << faults;

  const std::string unknown =
      faults_of(set_of(rig(""), "rig_camera = \"lft\"\n", "rig_camera = \"down\"\n"));
  EXPECT_THAT(unknown, HasSubstr("set.toml:8:14: camera.rig_camera is \"lft\", but the rig's "
                                 "cameras are \"left\", \"up\""));
  EXPECT_THAT(unknown, HasSubstr("set.toml:11:14: probe.rig_camera is \"down\""));
  EXPECT_EQ(std::ranges::count(unknown, '\n'), 1) << unknown;
}

TEST_F(SetRig, RefusesARigThatIsNotThereOrBad) {
  const std::string both_camera = "rig_camera = \"left\"\n";
  const std::string both_probe = "rig_camera = \"up\"\n";
  EXPECT_THAT(faults_of(set_of("", both_camera, both_probe)),
              HasSubstr("camera.rig_camera needs [rig]"));
  EXPECT_THAT(faults_of(set_of("[rig]\n", both_camera, both_probe)),
              HasSubstr("set.toml:4:1: rig.file is missing"));
  EXPECT_THAT(faults_of(set_of("[rig]\nfile = \"none.toml\"\n", both_camera, both_probe)),
              HasSubstr("set.toml:5:8: rig.file"));
  EXPECT_THAT(faults_of(set_of(rig("{ position = [0, 0, 1], track = \"a.csv\" }"), both_camera,
                               both_probe)),
              HasSubstr("set.toml:6:8: rig.pose must have either look_at"));
  write("rig/bad.toml", "[[camera]]\nname = \"left\"\nlens = 3\n");
  const std::string bad =
      faults_of(set_of("[rig]\nfile = \"rig/bad.toml\"\nturned = 3\n", both_camera, both_probe));
  EXPECT_THAT(bad, HasSubstr("set.toml:5:8: rig.file cannot be used: " + path("rig/bad.toml:3:8")));
  EXPECT_THAT(bad, HasSubstr("rig.turned"));
  EXPECT_EQ(std::ranges::count(bad, '\n'), 1) << bad;
}

TEST_F(SetRig, RefusesFilesOfTheRigThatCannotBeUsed) {
  fs::remove(dir_ / "rig/plate.rsp");
  write("rig/probe.toml", "model = \"none\"\n");
  const std::string faults =
      faults_of(set_of(rig(""), "rig_camera = \"left\"\n", "rig_camera = \"up\"\n"));
  EXPECT_THAT(faults, HasSubstr("set.toml:8:14: camera.rig_camera has the response " +
                                path("rig/plate.rsp")));
  EXPECT_THAT(faults, HasSubstr("set.toml:11:14: probe.rig_camera has a lens in the rig's file "
                                "that cannot be used: " +
                                path("rig/probe.toml")));
}

TEST_F(SetRig, NamesTheKeyWhoseResponseCannotBeUsed) {
  write("rig/plate.rsp", "1 1 0\n1 1 0\n");
  write("rig/probe.rsp", "x");
  const std::string faults =
      faults_of(set_of(rig(""), "rig_camera = \"left\"\n", "rig_camera = \"up\"\n"));
  EXPECT_THAT(faults, HasSubstr("set.toml:8:14: camera.rig_camera has a response in the rig's file "
                                "that cannot be used: " +
                                path("rig/plate.rsp")));
  EXPECT_THAT(faults, HasSubstr("set.toml:11:14: probe.rig_camera has a response"));
  EXPECT_EQ(std::ranges::count(faults, '\n'), 1) << faults;
}

TEST_F(SetRig, RefusesTheLensThatTheRigHas) {
  const std::string faults =
      faults_of(set_of(rig(""), "rig_camera = \"left\"\n", "rig_camera = \"up\"\nfocal_px = 14\n"));
  EXPECT_THAT(faults, HasSubstr("set.toml:12:12: probe.focal_px is the rig's already"));
  EXPECT_EQ(std::ranges::count(faults, '\n'), 0) << faults;
}

}  // namespace
}  // namespace studio::set_rig_test
