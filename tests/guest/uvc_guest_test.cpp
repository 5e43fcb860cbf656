// v4l2: cameras over the kernel's own uvcvideo driver and a made USB camera. Runs in the guest of
// boot.sh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "capture/camera.h"
#include "capture/v4l2_device.h"
#include "capture/v4l2_io.h"
#include "tests/guest/uvc_camera.h"
#include "tests/guest/uvc_picture.h"

namespace capture::uvc_guest_test {
namespace {

using namespace std::chrono_literals;
using made::UvcFault;
using testing::HasSubstr;

const std::string bus = "usb-vhci_hcd.0-1";

// Holds that the numbers seen in pictures go on as the frames' numbers do, lost ones among them.
class Numbers {
 public:
  void see(const Frame& frame) {
    // The camera's count is not known where it fell silent or started anew.
    if (frame.status == FrameStatus::lost && !frame.note.starts_with("the camera left out") &&
        frame.note.find("cut short") == std::string::npos) {
      ahead_.reset();
    }
    if (frame.status != FrameStatus::good) return;
    const auto ahead = static_cast<std::uint16_t>(made::seen_number(*frame.image) - frame.number);
    EXPECT_EQ(ahead, ahead_.value_or(ahead)) << "frame " << frame.number;
    ahead_ = ahead;
  }

 private:
  std::optional<std::uint16_t> ahead_;
};

class UvcCameraTest : public testing::Test {
 protected:
  // The driver leaves out pictures that it knows to be faulty, or marks them. It asks when a device
  // is plugged in.
  void plug(bool marks_faulty = true) {
    wait_until_gone();
    std::ofstream("/sys/module/uvcvideo/parameters/nodrop") << (marks_faulty ? 1 : 0) << std::flush;
    webcam_.plug();
    for (int tries = 0; tries < 1200 && !path(); ++tries) std::this_thread::sleep_for(50ms);
    ASSERT_TRUE(path()) << "the driver did not take it";
  }

  static std::optional<std::string> path() { return find_v4l2(system_v4l2_io(), {bus, {}, 0}); }

  // The driver takes a while to see that a device was unplugged.
  static void wait_until_gone() {
    for (int tries = 0; tries < 1200 && path(); ++tries) std::this_thread::sleep_for(50ms);
    ASSERT_FALSE(path());
  }

  static std::unique_ptr<Camera> open(const std::string& settings) {
    return open_camera("v4l2:" + bus + "?" + settings);
  }

  // The first frame of this status, with this in its note, among the next 300.
  std::optional<Frame> wait_for(Camera& camera, FrameStatus status, const std::string& note = "") {
    for (int i = 0; i < 300; ++i) {
      auto frame = camera.next();
      if (!frame) return std::nullopt;
      numbers_.see(*frame);
      if (frame->status == status && frame->note.find(note) != std::string::npos) return frame;
    }
    return std::nullopt;
  }

  // Has pictures come with a fault until one comes out as this; good ones come again after it. A
  // machine that is too slow loses some of them on its own.
  std::optional<Frame> meet(Camera& camera,
                            UvcFault fault,
                            FrameStatus status,
                            const std::string& note) {
    for (int i = 0; i < 300; ++i) {
      if (i % 30 == 0) webcam_.fault(fault);
      Frame frame = *camera.next();
      numbers_.see(frame);
      if (frame.status != status || frame.note.find(note) == std::string::npos) continue;
      EXPECT_TRUE(wait_for(camera, FrameStatus::good));
      return frame;
    }
    ADD_FAILURE() << "none came with " << note;
    return std::nullopt;
  }

  // Plugs it in and reads until the camera is back. Returns how many frames were lost from when its
  // node was there.
  int losses_till_return(Camera& camera) {
    wait_until_gone();
    webcam_.plug();
    int lost = 0;
    bool is_there = false;
    for (int i = 0; i < 1500; ++i) {
      const Frame frame = *camera.next();
      if (frame.status == FrameStatus::good) return lost;
      EXPECT_TRUE(frame.image);
      lost += is_there ? 1 : 0;
      is_there = is_there || path();
    }
    ADD_FAILURE() << "it did not come back";
    return lost;
  }

  made::UvcCamera webcam_{0};
  Numbers numbers_;
};

TEST_F(UvcCameraTest, IsListed) {
  plug();
  const V4l2Listing listing = list_v4l2(system_v4l2_io());
  const auto found = std::ranges::find(listing.devices, bus, &V4l2Device::bus);
  ASSERT_NE(found, listing.devices.end());
  EXPECT_EQ(found->driver, "uvcvideo");
  EXPECT_THAT(found->card, HasSubstr("Made webcam"));
  EXPECT_EQ(std::ranges::count(listing.devices, bus, &V4l2Device::bus), 1)
      << "its node of metadata is no camera";
  ASSERT_EQ(found->modes.size(), 6U) << "three formats of two sizes";
  for (const V4l2Mode& mode : found->modes) {
    ASSERT_EQ(mode.rates.size(), 2U);
    EXPECT_NEAR(mode.rates[0].value(), 30, 1e-3);
    EXPECT_NEAR(mode.rates[1].value(), 15, 1e-3);
  }
  EXPECT_TRUE(std::ranges::count(found->controls, "auto_exposure", &V4l2Control::name));
  const auto range = exposure_range(*found);
  ASSERT_TRUE(range);
  EXPECT_DOUBLE_EQ(range->shortest_s, 3e-4);
  EXPECT_DOUBLE_EQ(range->longest_s, 0.2047);
}

TEST_F(UvcCameraTest, GivesThePicturesThatWereTaken) {
  plug();
  for (const std::string format : {"YUYV", "MJPG", "GREY"}) {
    for (const std::string size : {"160x120", "320x240"}) {
      SCOPED_TRACE(format + " " + size);
      const auto camera = open("format=" + format + "&size=" + size +
                               "&rate=30&auto_exposure=1&exposure_time_absolute=60");
      EXPECT_EQ(std::to_string(camera->info().width) + "x" + std::to_string(camera->info().height),
                size);
      const auto patches = made::uvc_patches(format == "GREY");
      Numbers numbers;
      Time last{};
      for (int i = 0; i < 8; ++i) {
        const Frame frame = *camera->next();
        numbers.see(frame);
        EXPECT_GT(frame.time, last);
        last = frame.time;
        if (frame.status == FrameStatus::lost) continue;  // on machines that are too slow
        EXPECT_EQ(frame.status, FrameStatus::good) << frame.note;
        EXPECT_DOUBLE_EQ(frame.exposure_s, 0.006);
        EXPECT_NEAR(made::seen_exposure(*frame.image), 60, 3);
        const auto seen = made::seen_patches(*frame.image);
        for (std::size_t patch = 0; patch < patches.size(); ++patch) {
          for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(seen[patch][c], patches[patch][c], 0.02) << patch << " " << c;
          }
        }
      }
      EXPECT_LT(camera->statistics().lost, 8);
    }
  }
}

TEST_F(UvcCameraTest, SetsTheRate) {
  plug();
  EXPECT_NEAR(open("format=YUYV&size=160x120&rate=15")->info().rate.value(), 15, 1e-3);
  EXPECT_EQ(webcam_.interval(), 666666U);
  EXPECT_NEAR(open("format=YUYV&size=160x120")->info().rate.value(), 30, 1e-3);
  EXPECT_EQ(webcam_.interval(), 333333U);
}

TEST_F(UvcCameraTest, SetsExposuresFromFrameToFrame) {
  plug();
  const auto camera = open("format=YUYV&size=160x120");
  EXPECT_EQ(camera->next()->exposure_s, 0) << "it is automatic";
  ASSERT_FALSE(webcam_.is_manual());
  for (const int exposure : {25, 100, 400, 25, 400}) {
    EXPECT_DOUBLE_EQ(camera->set_exposure(exposure * 1e-4), exposure * 1e-4);
    EXPECT_TRUE(webcam_.is_manual());
    EXPECT_EQ(webcam_.exposure(), exposure);
    bool has_come = false;
    for (int i = 0; i < 100 && !has_come; ++i) {
      const Frame frame = *camera->next();
      numbers_.see(frame);
      if (frame.status != FrameStatus::good) continue;
      EXPECT_EQ(frame.exposure_s, 0) << "which frame has it is not known";
      const double seen = made::seen_exposure(*frame.image);
      const int taken = webcam_.exposure_of(made::seen_number(*frame.image)).value_or(0);
      EXPECT_NEAR(seen, taken, 0.05 * taken);
      has_come = taken == exposure;
    }
    EXPECT_TRUE(has_come) << exposure;
  }
}

TEST_F(UvcCameraTest, SaysWhichPicturesAreFaulty) {
  plug();
  const auto camera = open("format=YUYV&size=160x120");
  meet(*camera, UvcFault::error_bit, FrameStatus::damaged, "faulty");
  meet(*camera, UvcFault::cut, FrameStatus::lost, "cut short: 19200 of 38400 bytes");
  meet(*camera, UvcFault::too_long, FrameStatus::damaged, "faulty");
}

TEST_F(UvcCameraTest, LosesFaultyPicturesThatTheDriverLeavesOut) {
  plug(false);
  const auto camera = open("format=YUYV&size=160x120");
  for (const UvcFault fault : {UvcFault::error_bit, UvcFault::cut, UvcFault::too_long}) {
    meet(*camera, fault, FrameStatus::lost, "left out");
  }
  EXPECT_EQ(camera->statistics().damaged, 0);
}

TEST_F(UvcCameraTest, SaysThatAJpegIsCut) {
  plug();
  const auto camera = open("format=MJPG&size=160x120");
  meet(*camera, UvcFault::cut, FrameStatus::damaged, "decoded with errors");
}

TEST_F(UvcCameraTest, GoesOnAfterASilence) {
  plug();
  const auto camera = open("format=YUYV&size=160x120");
  // For a moment, and so long that the stream is started anew.
  for (const auto silence : {800ms, 2800ms}) {
    EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
    webcam_.stall(silence);
    const auto lost = wait_for(*camera, FrameStatus::lost, "no picture came within 500 ms");
    ASSERT_TRUE(lost);
    EXPECT_TRUE(lost->image);
    const auto back = wait_for(*camera, FrameStatus::good);
    ASSERT_TRUE(back);
    EXPECT_GT(back->time, lost->time);
  }
}

TEST_F(UvcCameraTest, GoesOnAfterTheDeviceHalted) {
  plug();
  const auto camera = open("format=YUYV&size=160x120&auto_exposure=1&exposure_time_absolute=60");
  EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
  webcam_.fault(UvcFault::halt);
  EXPECT_TRUE(wait_for(*camera, FrameStatus::lost, "the stream ended"));
  const auto back = wait_for(*camera, FrameStatus::good);
  ASSERT_TRUE(back);
  EXPECT_NEAR(made::seen_exposure(*back->image), 60, 3);
}

TEST_F(UvcCameraTest, ReturnsUnderAnotherNumberAfterItWasUnplugged) {
  plug();
  const auto camera = open(
      "format=YUYV&size=160x120&rate=15&auto_exposure=1&"
      "exposure_time_absolute=60");
  EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
  const auto before = path();
  webcam_.unplug();
  const auto gone = wait_for(*camera, FrameStatus::lost, "gone");
  ASSERT_TRUE(gone);
  EXPECT_TRUE(gone->image);
  made::UvcCamera other(1, "Other webcam");
  other.plug();
  for (int i = 0; i < 600 && !find_v4l2(system_v4l2_io(), {"usb-vhci_hcd.0-2", {}, 0}); ++i) {
    const Frame frame = *camera->next();
    EXPECT_EQ(frame.status, FrameStatus::lost);
    EXPECT_THAT(frame.note, HasSubstr("gone"));
  }
  try {
    camera->set_exposure(0.02);
    ADD_FAILURE() << "it is away";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr(bus));
  }
  const int lost = losses_till_return(*camera);
  EXPECT_LE(lost, 30) << "2 s";
  std::cout << lost << " frames of 1/15 s were lost after " << before.value_or("") << " was "
            << path().value_or("") << '\n';
  EXPECT_NE(path(), before);
  EXPECT_EQ(webcam_.interval(), 666666U);
  const auto back = wait_for(*camera, FrameStatus::good);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->image->width, 160);
  EXPECT_NEAR(made::seen_exposure(*back->image), 60, 3);
  EXPECT_GT(back->time, gone->time);
}

TEST_F(UvcCameraTest, ReturnsWithTheExposureThatWasAskedForLast) {
  plug();
  const auto camera = open("format=YUYV&size=160x120");
  camera->set_exposure(0.03);
  EXPECT_TRUE(wait_for(*camera, FrameStatus::good));
  webcam_.unplug();
  ASSERT_TRUE(wait_for(*camera, FrameStatus::lost, "gone"));
  losses_till_return(*camera);
  EXPECT_TRUE(webcam_.is_manual());
  EXPECT_EQ(webcam_.exposure(), 300);
}

}  // namespace
}  // namespace capture::uvc_guest_test
