// platelight devices, over made devices.
#include "studio/camera_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/capture/fake_v4l2.h"

namespace studio::camera_list_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(CameraLines, TellWhatACameraCan) {
  const auto io = std::make_shared<made::FakeV4l2>();
  io->devices[0].formats.push_back({V4L2_PIX_FMT_H264, {{64, 48, {30}}}});
  const auto lines = camera_lines(capture::list_v4l2(io));
  EXPECT_THAT(lines, Contains("v4l2:/dev/video0  Made camera (made), also "
                              "v4l2:usb-0000:00:14.0-1"));
  EXPECT_THAT(lines, Contains("  YUYV 64x48 at 30, 15/s"));
  EXPECT_THAT(lines, Contains("  H264 64x48 at 30/s (not read)"));
  EXPECT_THAT(lines, Contains(HasSubstr("exposure 0.0003 to 0.2047 s")));
  EXPECT_THAT(lines, Contains("  gain 0 to 100, now 10"));
  EXPECT_THAT(lines, Contains("  exposure_time_absolute 3 to 2047, now 250 (another control is "
                              "automatic)"));
  EXPECT_EQ(io->open_nodes, 0);
}

TEST(CameraLines, SayThatThereIsNone) {
  const auto io = std::make_shared<made::FakeV4l2>();
  io->devices.clear();
  EXPECT_THAT(camera_lines(capture::list_v4l2(io)), ElementsAre(HasSubstr("no camera")));
}

TEST(CameraLines, LeaveOutNodesThatCaptureNothing) {
  const auto io = std::make_shared<made::FakeV4l2>();
  io->devices[0].capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(camera_lines(capture::list_v4l2(io)), ElementsAre(HasSubstr("no camera")));
}

TEST(CameraLines, NameNodesThatCannotBeOpened) {
  const auto io = std::make_shared<made::FakeV4l2>();
  io->devices[0].open_error = EACCES;
  EXPECT_THAT(camera_lines(capture::list_v4l2(io)),
              ElementsAre("no camera that can be opened", HasSubstr("/dev/video0: no permission")));
}

TEST(CamerasJson, HoldsTheSame) {
  const auto io = std::make_shared<made::FakeV4l2>();
  io->devices[0].card = "Made \xff camera";
  const auto json = nlohmann::json::parse(cameras_json(capture::list_v4l2(io)));
  const auto& camera = json.at("cameras").at(0);
  EXPECT_EQ(camera.at("uri"), "v4l2:/dev/video0");
  EXPECT_EQ(camera.at("bus"), "usb-0000:00:14.0-1");
  EXPECT_EQ(camera.at("modes").size(), 3U);
  EXPECT_EQ(camera.at("modes").at(0).at("max_size"), nlohmann::json({64, 48}));
  EXPECT_EQ(camera.at("modes").at(0).at("rates"), nlohmann::json({30.0, 15.0}));
  EXPECT_DOUBLE_EQ(camera.at("exposure_s").at(1), 0.2047);
  EXPECT_EQ(camera.at("controls").at(0).at("name"), "gain");
  EXPECT_TRUE(json.at("closed").empty());
}

capture::AravisListing one_network_camera() {
  capture::AravisListing listing;
  listing.cameras.push_back({{"Made-M1-7", "Made", "M1", "7", "10.0.0.7", "GigEVision"},
                             {{"Mono8", "Coord3D_A8"}, {{4, 4}}, {{64, 48}}, 1, 60, {{1e-5, 2}}},
                             ""});
  return listing;
}

TEST(CameraLines, TellWhatANetworkCameraCan) {
  auto network = one_network_camera();
  EXPECT_THAT(camera_lines({}, network),
              ElementsAre("aravis:Made-M1-7  Made M1 (GigEVision), serial 7, also aravis:10.0.0.7",
                          "  Mono8, Coord3D_A8 (not read)", "  4x4 to 64x48", "  1 to 60/s",
                          "  exposure 1e-05 to 2 s"));
  network.cameras[0].fault = "another program controls the camera";
  EXPECT_THAT(camera_lines({}, network),
              ElementsAre(HasSubstr("M1"), HasSubstr("another program")));
}

TEST(CamerasJson, HoldsNetworkCameras) {
  const auto json = nlohmann::json::parse(cameras_json({}, one_network_camera()));
  const auto& camera = json.at("cameras").at(0);
  EXPECT_EQ(camera.at("uri"), "aravis:Made-M1-7");
  EXPECT_EQ(camera.at("max_size"), nlohmann::json({64, 48}));
  EXPECT_EQ(camera.at("rates"), nlohmann::json({1.0, 60.0}));
  EXPECT_EQ(camera.at("formats").at(1).at("read"), false);
}

}  // namespace
}  // namespace studio::camera_list_test
