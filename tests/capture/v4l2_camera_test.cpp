// v4l2: cameras over made devices: what is chosen, what goes wrong, and what comes back.
#include "capture/v4l2_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "capture/coded_picture.h"
#include "tests/capture/fake_v4l2.h"

namespace capture::v4l2_camera_test {
namespace {

using namespace std::chrono_literals;
using made::FakeEvent;
using testing::AllOf;
using testing::HasSubstr;

class V4l2CameraTest : public testing::Test {
 protected:
  std::unique_ptr<Camera> open(const std::string& rest, const CameraOptions& options = {}) {
    return open_v4l2(rest, options, {options.colour, std::nullopt}, io_);
  }

  // What the camera is refused with.
  std::string refusal(const std::string& rest, const CameraOptions& options = {}) {
    try {
      open(rest, options);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("cannot open v4l2:" + rest));
      EXPECT_EQ(io_->open_nodes, 0);
      EXPECT_EQ(io_->mapped, 0);
      return error.what();
    }
    ADD_FAILURE() << rest << " was opened";
    return {};
  }

  made::FakeDevice& device() { return io_->devices.front(); }

  std::shared_ptr<made::FakeV4l2> io_ = std::make_shared<made::FakeV4l2>();
};

TEST_F(V4l2CameraTest, TakesTheLargestPictureUnasked) {
  const auto camera = open("/dev/video0?format=YUYV");
  EXPECT_EQ(camera->info().width, 64);
  EXPECT_EQ(camera->info().height, 48);
  EXPECT_EQ(camera->info().rate, (Rational{30, 1}));
  EXPECT_EQ(camera->info().frames, 0);
  EXPECT_THAT(camera->info().description,
              AllOf(HasSubstr("Made camera on usb-0000:00:14.0-1"), HasSubstr("YUYV")));
}

TEST_F(V4l2CameraTest, TellsThatItsPicturesAreInterlaced) {
  EXPECT_EQ(open("/dev/video0?format=YUYV")->info().doubt, "");
  device().field = V4L2_FIELD_INTERLACED_TB;
  auto camera = open("/dev/video0?format=YUYV");
  EXPECT_THAT(camera->info().description, HasSubstr("interlaced (taken as it is)"));
  EXPECT_THAT(camera->info().doubt, HasSubstr("interlaced pictures, which are taken as they are"));
  camera.reset();
  device().field = V4L2_FIELD_ALTERNATE;
  EXPECT_THAT(refusal("/dev/video0?format=YUYV"), HasSubstr("as single fields"));
}

TEST_F(V4l2CameraTest, SetsWhatIsAskedFor) {
  const auto camera = open("/dev/video0?size=32x24&rate=60&gain=55");
  EXPECT_EQ(camera->info().width, 32);
  EXPECT_EQ(camera->info().rate, (Rational{60, 1}));
  EXPECT_EQ(device().format.pixelformat, V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(device().controls[0].value, 55);
}

TEST_F(V4l2CameraTest, IsFoundByItsBus) {
  made::FakeDevice other;
  other.path = "/dev/video2";
  other.bus = "usb-0000:00:14.0-2";
  other.card = "Another";
  io_->devices.push_back(other);
  EXPECT_THAT(open("usb-0000:00:14.0-2?format=YUYV")->info().description, HasSubstr("Another"));
  EXPECT_THAT(refusal("usb-3"), AllOf(HasSubstr("usb-0000:00:14.0-1 (Made camera)"),
                                      HasSubstr("usb-0000:00:14.0-2 (Another)")));
}

TEST_F(V4l2CameraTest, SetsExposuresWhilePicturesCome) {
  const auto camera = open("/dev/video0?format=YUYV");
  ASSERT_TRUE(camera->exposure_range());
  EXPECT_DOUBLE_EQ(camera->exposure_range()->shortest_s, 3e-4);
  EXPECT_DOUBLE_EQ(camera->exposure_range()->longest_s, 0.2047);
  EXPECT_DOUBLE_EQ(camera->set_exposure(0.00123), 0.0012);
  EXPECT_EQ(device().controls[1].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(device().controls[2].value, 12);
  EXPECT_EQ(camera->next()->exposure_s, 0) << "which frame has it is not known";
  EXPECT_DOUBLE_EQ(camera->set_exposure(0.1), 0.1);
  EXPECT_EQ(device().controls[2].value, 1000);
}

TEST_F(V4l2CameraTest, RefusesExposuresThatItHasNot) {
  const auto camera = open("/dev/video0?format=YUYV");
  for (const double exposure_s : {0.0, -1.0, 1.0, std::nan("")}) {
    try {
      camera->set_exposure(exposure_s);
      ADD_FAILURE() << exposure_s;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("v4l2:/dev/video0"), HasSubstr("0.2047")));
    }
  }
  device().present = false;
  EXPECT_THROW(camera->set_exposure(0.01), std::runtime_error);
}

TEST_F(V4l2CameraTest, RefusesAnExposureThatIsNoneOnceItIsSet) {
  device().controls[2].step = 10;
  const auto camera = open("/dev/video0?format=YUYV");
  EXPECT_DOUBLE_EQ(camera->set_exposure(0.0012), 0.001);
  EXPECT_THROW(camera->set_exposure(3e-4), std::runtime_error);
}

TEST_F(V4l2CameraTest, ReturnsWithTheExposureThatWasAskedForLast) {
  const auto camera = open("/dev/video0?format=YUYV&auto_exposure=1&exposure_time_absolute=50");
  camera->next();
  for (const double exposure_s : {0.02, 0.03}) camera->set_exposure(exposure_s);
  device().controls[1].value = V4L2_EXPOSURE_APERTURE_PRIORITY;
  device().controls[2].value = 7;
  device().events.push_back({.wait_result = -EIO});
  std::optional<Frame> frame;
  do {
    frame = camera->next();
  } while (frame->status == FrameStatus::lost);
  EXPECT_EQ(device().controls[1].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(device().controls[2].value, 300);
  EXPECT_EQ(frame->exposure_s, 0) << "which frame has it is not known";
}

TEST_F(V4l2CameraTest, KeepsWhatCameIfAsked) {
  CameraOptions options;
  options.keep_coded = true;
  device().picture.resize(std::size_t{64} * 48 * 2, std::byte{77});
  const auto frame = open("/dev/video0?format=YUYV", options)->next();
  ASSERT_TRUE(frame->coded);
  EXPECT_EQ(frame->coded->layout.fourcc, V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(frame->coded->layout.width, 64);
  EXPECT_EQ(frame->coded->bytes, device().picture);
  EXPECT_FALSE(open("/dev/video0?format=YUYV")->next()->coded);
}

TEST_F(V4l2CameraTest, CountsAndTimesFrames) {
  const auto camera = open("/dev/video0?format=YUYV&rate=15");
  Time last{};
  for (int i = 0; i < 10; ++i) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, i);
    EXPECT_EQ(frame->status, FrameStatus::good) << frame->note;
    ASSERT_TRUE(frame->image);
    EXPECT_EQ(frame->image->width, 64);
    EXPECT_EQ(frame->exposure_s, 0) << "it is automatic";
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>((frame->time - last).count()), 1e9 / 15, 2e3);
    }
    last = frame->time;
  }
  EXPECT_EQ(camera->statistics().delivered, 10);
  EXPECT_EQ(camera->statistics().lost, 0);
}

TEST_F(V4l2CameraTest, GivesTheMiddleOfAnExposureThatItKnows) {
  for (const bool at_start : {false, true}) {
    device().stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC |
                           (at_start ? V4L2_BUF_FLAG_TSTAMP_SRC_SOE : V4L2_BUF_FLAG_TSTAMP_SRC_EOF);
    const auto camera = open("/dev/video0?format=YUYV&auto_exposure=1&exposure_time_absolute=80");
    camera->next();
    const auto frame = camera->next();
    EXPECT_DOUBLE_EQ(frame->exposure_s, 0.008);
    const Time half = at_start ? 4ms : -4ms;
    EXPECT_NEAR(static_cast<double>((frame->time - io_->clock - half).count()), 0, 2e3);
  }
}

TEST_F(V4l2CameraTest, TakesTheTimeOfArrivalForStampsThatJump) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  for (const Time shift : {Time(3h), Time(-15min)}) {
    device().events.push_back({.stamp_shift = shift});
    const auto frame = camera->next();
    EXPECT_EQ(frame->time, io_->clock);
    EXPECT_EQ(frame->status, FrameStatus::good);
    EXPECT_THAT(frame->note, HasSubstr("time stamp"));
  }
}

TEST_F(V4l2CameraTest, NeverLetsTimeStandStill) {
  const auto camera = open("/dev/video0?format=YUYV");
  Time last = camera->next()->time;
  for (int i = 0; i < 20; ++i) {
    device().events.push_back({.stamp_shift = i % 2 == 0 ? Time(-200ms) : Time(0)});
    const Time time = camera->next()->time;
    EXPECT_GT(time, last);
    last = time;
  }
}

TEST_F(V4l2CameraTest, LosesTheFramesThatItsNumbersLeaveOut) {
  const auto camera = open("/dev/video0?format=YUYV");
  const Time before = camera->next()->time;
  device().events.push_back({.sequence_step = 4});
  for (int i = 1; i <= 3; ++i) {
    const auto frame = camera->next();
    EXPECT_EQ(frame->status, FrameStatus::lost);
    EXPECT_EQ(frame->number, i);
    EXPECT_THAT(frame->note, HasSubstr("left out 3"));
    EXPECT_TRUE(frame->image);
    EXPECT_NEAR(static_cast<double>((frame->time - before).count()), i * 1e9 / 30, 1e4);
  }
  const auto after = camera->next();
  EXPECT_EQ(after->status, FrameStatus::good);
  EXPECT_EQ(after->number, 4);
  EXPECT_EQ(camera->statistics().lost, 3);
}

TEST_F(V4l2CameraTest, CountsOnOverTheEndOfItsNumbers) {
  device().first_sequence = 0xfffffffe;
  const auto camera = open("/dev/video0?format=YUYV");
  for (int i = 0; i < 4; ++i) EXPECT_EQ(camera->next()->status, FrameStatus::good);
  device().events.push_back({.sequence_step = 2});
  EXPECT_EQ(camera->next()->status, FrameStatus::lost);
}

TEST_F(V4l2CameraTest, TakesNumbersThatStandStillOrStartAgainAsTheyAre) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  for (const std::uint32_t step : {0U, 0U, 0xffffffffU}) {
    device().events.push_back({.sequence_step = step});
    if (step > 1) io_->clock -= 1s;  // the made clock goes on with the numbers
    device().interval = {0, 30};
    EXPECT_EQ(camera->next()->status, FrameStatus::good);
  }
}

TEST_F(V4l2CameraTest, SaysThatAPictureIsFaulty) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  device().events.push_back({.flags = V4L2_BUF_FLAG_ERROR});
  const auto frame = camera->next();
  EXPECT_EQ(frame->status, FrameStatus::damaged);
  EXPECT_THAT(frame->note, HasSubstr("faulty"));
  EXPECT_EQ(camera->next()->status, FrameStatus::good);
  EXPECT_EQ(camera->statistics().damaged, 1);
}

TEST_F(V4l2CameraTest, LosesAPictureThatIsCutShort) {
  const auto camera = open("/dev/video0?format=YUYV");
  const auto whole = camera->next();
  device().events.push_back({.bytes_short = 100});
  const auto frame = camera->next();
  EXPECT_EQ(frame->status, FrameStatus::lost);
  EXPECT_THAT(frame->note, HasSubstr("cut short: 6044 of 6144 bytes"));
  EXPECT_EQ(frame->image, whole->image);
}

TEST_F(V4l2CameraTest, LosesFramesThatDoNotComeInTime) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  device().events.assign(2, {.wait_result = 0});
  for (int i = 0; i < 2; ++i) {
    const auto frame = camera->next();
    EXPECT_EQ(frame->status, FrameStatus::lost);
    EXPECT_THAT(frame->note, HasSubstr("within 500 ms"));
  }
  EXPECT_EQ(camera->next()->status, FrameStatus::good);
}

TEST_F(V4l2CameraTest, CountsFramesOnceThatWereWaitedForInVain) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  device().events.assign(2, {.wait_result = 0});
  device().events.push_back({.sequence_step = 4});
  device().events.push_back({.sequence_step = 2});
  std::vector<std::string> lost;
  for (std::int64_t number = 1; number <= 6; ++number) {
    const auto frame = camera->next();
    EXPECT_EQ(frame->number, number);
    if (frame->status == FrameStatus::lost) lost.push_back(frame->note);
  }
  EXPECT_THAT(lost, testing::ElementsAre(HasSubstr("within 500 ms"), HasSubstr("within 500 ms"),
                                         HasSubstr("left out 3"), HasSubstr("left out 1")));
  EXPECT_EQ(camera->next()->status, FrameStatus::good);

  device().events.assign(2, {.wait_result = 0});
  device().events.push_back({.sequence_step = 2});
  for (int i = 0; i < 2; ++i) EXPECT_EQ(camera->next()->status, FrameStatus::lost);
  EXPECT_EQ(camera->next()->status, FrameStatus::good) << "fewer than were given up";
}

TEST_F(V4l2CameraTest, StartsAStreamAnewThatIsSilent) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  device().events.assign(4, {.wait_result = 0});
  for (int i = 0; i < 4; ++i) camera->next();
  EXPECT_EQ(io_->open_nodes, 0) << "the camera was let go";
  EXPECT_EQ(camera->next()->status, FrameStatus::good);
}

TEST_F(V4l2CameraTest, StartsAStreamAnewThatEndsWithEmptyBuffers) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  const FakeEvent empty{.sequence_step = 0, .flags = V4L2_BUF_FLAG_ERROR, .bytes_short = 6144};
  device().events.assign(4, empty);
  for (int i = 0; i < 4; ++i) EXPECT_THAT(camera->next()->note, HasSubstr("0 of 6144"));
  EXPECT_EQ(camera->next()->status, FrameStatus::good) << "it may go on";
  device().events.assign(2, empty);
  device().events.push_back({.wait_result = 0});
  for (int i = 0; i < 2; ++i) camera->next();
  EXPECT_THAT(camera->next()->note, HasSubstr("the stream ended"));
  EXPECT_EQ(io_->open_nodes, 0) << "the camera was let go";
  EXPECT_EQ(camera->next()->status, FrameStatus::good);
}

TEST_F(V4l2CameraTest, WaitsBetweenStartsThatEndAtOnce) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  device().events.assign(1000, {.wait_result = -EIO});
  const Time start = io_->clock;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(camera->next()->status, FrameStatus::lost);
  EXPECT_GT(io_->clock - start, 2s) << "frames are lost at about the camera's rate";
}

TEST_F(V4l2CameraTest, ComesBackAfterErrorsOfTheDriver) {
  for (const FakeEvent fault : {FakeEvent{.wait_result = -EIO}, FakeEvent{.dequeue_result = -EIO},
                                FakeEvent{.dequeue_result = -EINVAL}}) {
    const auto camera = open("/dev/video0?format=YUYV&gain=33");
    camera->next();
    device().controls[0].value = 0;
    device().events.push_back(fault);
    const auto frame = camera->next();
    EXPECT_EQ(frame->status, FrameStatus::lost);
    EXPECT_THAT(frame->note, HasSubstr("the stream ended"));
    EXPECT_EQ(camera->next()->status, FrameStatus::good);
    EXPECT_EQ(device().controls[0].value, 33) << "its settings are restored";
  }
}

TEST_F(V4l2CameraTest, ReturnsUnderAnotherNumberAfterItWasUnplugged) {
  made::FakeDevice other;
  other.path = "/dev/video1";
  other.bus = "usb-0000:00:14.0-7";
  io_->devices.push_back(other);
  const auto camera = open("/dev/video0?format=YUYV&gain=33");
  camera->next();
  device().present = false;
  const Time gone = io_->clock;
  int sleeps = 0;
  io_->on_sleep = [&] {
    if (++sleeps != 30) return;
    device().present = true;
    device().path = "/dev/video4";
    device().controls[0].value = 0;
    device().events.clear();
  };
  int lost = 0;
  std::optional<Frame> frame = camera->next();
  Time last{};
  for (; frame->status == FrameStatus::lost && lost < 1000; frame = camera->next()) {
    EXPECT_THAT(frame->note, HasSubstr("gone"));
    EXPECT_TRUE(frame->image);
    EXPECT_GT(frame->time, last);
    last = frame->time;
    ++lost;
  }
  EXPECT_EQ(frame->status, FrameStatus::good);
  EXPECT_GE(lost, 30);
  EXPECT_LE(lost, 30 + 60) << "back within 2 s";
  EXPECT_EQ(frame->number, lost + 1);
  EXPECT_EQ(device().controls[0].value, 33);
  EXPECT_GT(io_->clock - gone, 1s) << "frames are lost at the camera's rate";
  EXPECT_LT(io_->clock - gone, 3s);
}

// As HDMI grabbers do, which follow their signal.
TEST_F(V4l2CameraTest, ReturnsThoughItHasARateThatItDoesNotList) {
  device().interval = {1, 50};
  device().sets_interval = false;
  const auto camera = open("/dev/video0?format=YUYV");
  EXPECT_EQ(camera->info().rate, (Rational{50, 1}));
  camera->next();
  device().present = false;
  camera->next();
  device().present = true;
  device().events.clear();
  std::optional<Frame> frame = camera->next();
  for (int i = 0; i < 300 && frame->status == FrameStatus::lost; ++i) frame = camera->next();
  EXPECT_EQ(frame->status, FrameStatus::good) << frame->note;
}

TEST_F(V4l2CameraTest, WaitsForADeviceThatCameBackAsSomethingElse) {
  const auto camera = open("/dev/video0?format=YUYV");
  camera->next();
  device().present = false;
  camera->next();
  device().present = true;
  device().formats.front().sizes.erase(device().formats.front().sizes.begin());
  std::optional<Frame> frame;
  for (int i = 0; i < 30; ++i) frame = camera->next();
  EXPECT_EQ(frame->status, FrameStatus::lost);
  EXPECT_THAT(frame->note, AllOf(HasSubstr("opened again"), HasSubstr("64x48")));
}

TEST_F(V4l2CameraTest, LetsTheDeviceGo) {
  open("/dev/video0?format=YUYV")->next();
  EXPECT_EQ(io_->open_nodes, 0);
  EXPECT_EQ(io_->mapped, 0);
  EXPECT_FALSE(device().streaming);
}

TEST_F(V4l2CameraTest, CutsOutAPart) {
  CameraOptions options;
  options.crop = {8, 4, 16, 10};
  {
    const auto camera = open("/dev/video0?format=YUYV", options);
    EXPECT_EQ(camera->info().width, 16);
    EXPECT_EQ(camera->next()->image->height, 10);
  }
  options.crop = {60, 0, 16, 10};
  EXPECT_THAT(refusal("/dev/video0?format=YUYV", options), HasSubstr("64"));
}

TEST_F(V4l2CameraTest, ReadsRawCodesAsLight) {
  device().formats = {{V4L2_PIX_FMT_Y10, {{8, 4, {30}}}}};
  device().picture.resize(8 * 4 * 2);
  const std::uint16_t code = 341;  // of 1023
  for (std::size_t i = 0; i < device().picture.size(); i += 2) {
    std::memcpy(&device().picture[i], &code, 2);
  }
  const auto frame = open("/dev/video0")->next();
  for (const float light : frame->image->pixels) EXPECT_FLOAT_EQ(light, 341.0F / 1023);
}

TEST_F(V4l2CameraTest, ReadsVideoByItsColour) {
  device().picture.assign(64 * 48 * 2, std::byte{128});  // Y' 128, no chroma
  const auto frame = open("/dev/video0?format=YUYV")->next();
  const double light = decode(Transfer::rec1886, (128 - 16) / 219.0);
  for (const float value : frame->image->pixels) EXPECT_NEAR(value, light, 1e-4);
}

TEST_F(V4l2CameraTest, RefusesWhatTheDeviceHasNot) {
  EXPECT_THAT(refusal("/dev/video0?format=NV12"),
              AllOf(HasSubstr("NV12 was asked for"), HasSubstr("YUYV, MJPG")));
  EXPECT_THAT(refusal("/dev/video0?format=H264"),
              AllOf(HasSubstr("not read"), HasSubstr("YUYV, MJPG can be")));
  EXPECT_THAT(refusal("/dev/video0?format=YUYV&size=640x480"),
              AllOf(HasSubstr("640x480 was asked for"), HasSubstr("YUYV 64x48, YUYV 32x24")));
  EXPECT_THAT(refusal("/dev/video0?format=YUYV&size=64x48&rate=50"),
              AllOf(HasSubstr("rate 50 was asked for"), HasSubstr("YUYV 64x48 at 30, 15/s")));
  EXPECT_THAT(refusal("/dev/video0?gain=101"),
              AllOf(HasSubstr("gain=101 was asked for"), HasSubstr("0 to 100")));
  EXPECT_THAT(refusal("/dev/video0?zoom=1"),
              AllOf(HasSubstr("zoom=1"), HasSubstr("gain, auto_exposure, exposure_time_absolute")));
  EXPECT_THAT(refusal("/dev/video0?exposure_time_absolute=80"), HasSubstr("auto_exposure=1"));
}

TEST_F(V4l2CameraTest, RefusesWhatItCannotReadInTheUri) {
  for (const char* rest : {"", "/dev/video0?format=", "/dev/video0?size=64", "/dev/video0?size=0x4",
                           "/dev/video0?rate=0", "/dev/video0?rate=nan", "/dev/video0?gain=high",
                           "/dev/video0?gain", "/dev/video0?=3", "/dev/video0?size=64x48x2"}) {
    EXPECT_THAT(refusal(rest), HasSubstr("write v4l2:/dev/video0?format=YUYV")) << rest;
  }
}

TEST_F(V4l2CameraTest, SaysWhyADeviceDoesNotOpen) {
  EXPECT_THAT(refusal("/dev/video9"), HasSubstr("no such device"));
  device().open_error = EACCES;
  EXPECT_THAT(refusal("/dev/video0"), AllOf(HasSubstr("no permission"), HasSubstr("group video")));
  device().open_error = 0;
  for (const unsigned long call : {VIDIOC_S_FMT, VIDIOC_REQBUFS, VIDIOC_STREAMON}) {
    device().call_errors = {{call, EBUSY}};
    EXPECT_THAT(refusal("/dev/video0"), HasSubstr("another program uses it"));
  }
  device().call_errors = {{VIDIOC_QUERYCAP, ENOTTY}};
  EXPECT_THAT(refusal("/dev/video0"), HasSubstr("no V4L2 device"));
  device().call_errors.clear();
  device().capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal("/dev/video0"), HasSubstr("captures no video"));
  device().capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal("/dev/video0"), HasSubstr("several planes"));
}

TEST_F(V4l2CameraTest, RefusesADeviceThatSetsSomethingElse) {
  device().changes_size = true;
  EXPECT_THAT(refusal("/dev/video0?format=YUYV"),
              AllOf(HasSubstr("YUYV 64x48 was asked for"), HasSubstr("sets YUYV 32x48 instead")));
}

TEST_F(V4l2CameraTest, RefusesADeviceThatGivesNoPicture) {
  device().events.assign(100, {.wait_result = 0});
  EXPECT_THAT(refusal("/dev/video0?format=YUYV"),
              AllOf(HasSubstr("no picture came"), HasSubstr("500 ms")));
  device().events.assign(1000, {.bytes_short = 1});
  EXPECT_THAT(refusal("/dev/video0?format=YUYV"), HasSubstr("cut short"));
}

TEST_F(V4l2CameraTest, HasNoFrameToStartAt) {
  CameraOptions options;
  options.frame = 5;
  EXPECT_THAT(refusal("/dev/video0", options), HasSubstr("frame 0"));
}

TEST(OpenCamera, KnowsV4l2) {
  try {
    open_camera("v4l2:/dev/no_such_video");
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("v4l2:/dev/no_such_video"), HasSubstr("no such")));
  }
}

}  // namespace
}  // namespace capture::v4l2_camera_test
