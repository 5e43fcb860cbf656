// v4l2: cameras over the kernel's own vivid driver. Runs in the guest of boot.sh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>

#include <linux/videodev2.h>

#include "capture/camera.h"
#include "capture/v4l2_device.h"
#include "capture/v4l2_io.h"

namespace capture::v4l2_guest_test {
namespace {

using testing::HasSubstr;

constexpr const char* small = "v4l2:/dev/video0?format=YUYV&size=320x180&rate=30";

// Sets a control by the driver's own name for it; buttons too.
void press(const std::string& path, const std::string& name, int value = 1) {
  const V4l2Node node(system_v4l2_io(), path);
  v4l2_query_ext_ctrl its{};
  its.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (node.call(VIDIOC_QUERY_EXT_CTRL, &its) >= 0) {
    if (name == its.name) {
      v4l2_ext_control one{};
      one.id = its.id;
      one.value = value;
      v4l2_ext_controls all{};
      all.count = 1;
      all.controls = &one;
      ASSERT_GE(node.call(VIDIOC_S_EXT_CTRLS, &all), 0) << name;
      return;
    }
    its.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  FAIL() << path << " has no control " << name;
}

void write(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  ASSERT_TRUE(file.good()) << path;
}

// The first frame of this status among the next `most`.
std::optional<Frame> wait_for(Camera& camera, FrameStatus status, int most = 200) {
  for (int i = 0; i < most; ++i) {
    auto frame = camera.next();
    if (frame && frame->status == status) return frame;
  }
  return std::nullopt;
}

TEST(GuestDevices, AreListed) {
  const V4l2Listing listing = list_v4l2(system_v4l2_io());
  ASSERT_EQ(listing.devices.size(), 2U);
  EXPECT_EQ(listing.devices[0].bus, "platform:vivid-000");
  EXPECT_EQ(listing.devices[1].bus, "platform:vivid-001");
  EXPECT_GT(listing.devices[0].modes.size(), 10U);
  EXPECT_GT(listing.devices[0].controls.size(), 10U);
}

TEST(GuestCamera, NumbersFramesByTheirTime) {
  const auto camera = open_camera(small);
  const Frame first = *camera->next();
  Frame last = first;
  for (int i = 0; i < 60; ++i) {
    const Frame frame = *camera->next();
    EXPECT_GT(frame.time, last.time);
    EXPECT_EQ(frame.number, last.number + 1);
    last = frame;
  }
  const double frames = std::chrono::duration<double>(last.time - first.time).count() * 30;
  EXPECT_NEAR(frames, static_cast<double>(last.number - first.number), 1.5);
}

TEST(GuestCamera, IsFoundByItsBus) {
  const auto camera = open_camera("v4l2:platform:vivid-001?format=YUYV&size=320x180");
  EXPECT_THAT(camera->info().description, HasSubstr("platform:vivid-001"));
}

TEST(GuestCamera, SeesTheSamePictureInEveryFormat) {
  const auto bars = [](const std::string& format) {
    const auto frame = open_camera("v4l2:/dev/video0?format=" + format +
                                   "&size=320x180&rate=30&osd_text_mode=2&test_pattern=0")
                           ->next();
    std::array<std::array<double, 3>, 8> light{};
    for (int bar = 0; bar < 8; ++bar) {
      for (int c = 0; c < 3; ++c) {
        light[static_cast<std::size_t>(bar)][static_cast<std::size_t>(c)] =
            static_cast<double>(frame->image->at(90, 20 + 40 * bar, c));
      }
    }
    return light;
  };
  const auto expected = bars("RGB3");
  EXPECT_GT(expected[0][0], expected[7][0] + 0.3) << "white to black";
  for (const char* format : {"BGR3", "YUYV", "UYVY", "NV12", "YU12"}) {
    const auto light = bars(format);
    for (std::size_t bar = 0; bar < 8; ++bar) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(light[bar][c], expected[bar][c], 0.02) << format << " " << bar << " " << c;
      }
    }
  }
  // Raw codes are taken as light; the made sensor's are not, but follow the same curve.
  for (const char* format : {"RGGB", "BA81", "RG10", "RG12", "RG16"}) {
    const auto light = bars(format);
    for (std::size_t bar = 0; bar < 8; ++bar) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(decode(Transfer::rec1886, light[bar][c]), expected[bar][c], 0.02)
            << format << " " << bar << " " << c;
      }
    }
  }
}

TEST(GuestCamera, LosesDroppedFrames) {
  const auto camera = open_camera(small);
  press("/dev/video0", "Percentage of Dropped Buffers", 30);
  const auto lost = wait_for(*camera, FrameStatus::lost);
  press("/dev/video0", "Percentage of Dropped Buffers", 0);
  ASSERT_TRUE(lost);
  EXPECT_THAT(lost->note, HasSubstr("left out"));
  EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
}

TEST(GuestCamera, SaysThatABufferIsFaulty) {
  const auto camera = open_camera(small);
  press("/dev/video0", "Inject V4L2_BUF_FLAG_ERROR");
  EXPECT_TRUE(wait_for(*camera, FrameStatus::damaged, 20));
  EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
}

TEST(GuestCamera, ComesBackAfterAFatalError) {
  const auto camera = open_camera(small);
  press("/dev/video0", "Inject Fatal Streaming Error");
  EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(camera->next());
}

TEST(GuestCamera, SaysThatAnotherProgramUsesIt) {
  const auto camera = open_camera(small);
  try {
    open_camera("v4l2:/dev/video0?format=RGB3&size=640x360");
    ADD_FAILURE() << "two at one time";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("another program uses it"));
  }
}

TEST(GuestCamera, SaysThatItDoesNotStart) {
  press("/dev/video0", "Inject VIDIOC_STREAMON Error");
  try {
    open_camera(small);
    ADD_FAILURE() << "it was opened";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("does not start to stream"));
  }
}

TEST(GuestCamera, ReturnsAfterItWasUnplugged) {
  const auto camera = open_camera(small);
  camera->next();
  press("/dev/video0", "Disconnect");
  const auto gone = wait_for(*camera, FrameStatus::lost);
  ASSERT_TRUE(gone);
  EXPECT_TRUE(gone->image);
  const std::string driver = "/sys/bus/platform/drivers/vivid/";
  write(driver + "unbind", "vivid.0");
  EXPECT_EQ(camera->next()->status, FrameStatus::lost);
  write(driver + "bind", "vivid.0");
  const auto back = wait_for(*camera, FrameStatus::good, 600);
  ASSERT_TRUE(back);
  EXPECT_GT(back->time, gone->time);
}

}  // namespace
}  // namespace capture::v4l2_guest_test
