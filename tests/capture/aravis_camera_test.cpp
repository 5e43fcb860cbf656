// aravis: cameras over real packets from made ones: what is chosen, what goes wrong, what returns.
#include "capture/aravis_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>
#include <thread>

#include "capture/aravis_device.h"
#include "capture/coded_picture.h"
#include "capture/live_reader.h"
#include "capture/made_gige.h"
#include "tests/capture/telling_shot.h"

namespace capture::aravis_camera_test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

constexpr int width = 64;
constexpr int height = 48;
constexpr auto patience = 120s;  // far beyond what any machine needs

MadeShot telling_shot(const MadeGigeShot& shot) { return made::telling_shot(shot, width, height); }

MadeGigeSettings small() {
  MadeGigeSettings settings;
  settings.width = width;
  settings.height = height;
  settings.rate = 50;
  settings.exposures = {1e-5, 0.04};
  settings.formats = {"Mono12", "Mono8", "Mono12Packed", "Mono12p", "Mono10Packed", "Mono16"};
  return settings;
}

int code(const Frame& frame, int x, int y = 0, int last = 4095) {
  return static_cast<int>(std::lround(frame.image->at(y, x, 1) * static_cast<float>(last)));
}

class AravisCameraTest : public testing::Test {
 protected:
  std::unique_ptr<Camera> open(const std::string& settings = "", CameraOptions options = {}) {
    return open_aravis(made_->address() + settings, options, {options.colour, std::nullopt});
  }

  void make(const MadeGigeSettings& settings) {
    made_ = std::make_unique<MadeGigeCamera>(settings, telling_shot);
  }

  // What the camera is refused with.
  std::string refusal(const std::string& settings, const CameraOptions& options = {}) {
    try {
      open(settings, options);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("cannot open aravis:" + made_->address() + settings));
      return error.what();
    }
    ADD_FAILURE() << settings << " was opened";
    return {};
  }

  // The next frame that is not lost.
  static Frame next_good(Camera& camera) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < end) {
      const auto frame = camera.next();
      if (frame && frame->status == FrameStatus::good) return *frame;
    }
    ADD_FAILURE() << "no good frame came";
    return {};
  }

  std::unique_ptr<MadeGigeCamera> made_ = std::make_unique<MadeGigeCamera>(small(), telling_shot);
};

TEST_F(AravisCameraTest, DeliversEveryCode) {
  for (const char* format : {"Mono12", "Mono12Packed", "Mono12p"}) {
    const auto camera = open(std::string("?format=") + format);
    EXPECT_EQ(camera->info().width, width);
    EXPECT_EQ(camera->info().height, height);
    EXPECT_EQ(camera->info().rate, (Rational{50, 1}));
    for (int i = 0; i < 5; ++i) {
      const Frame frame = next_good(*camera);
      ASSERT_EQ(frame.image->width, width);
      const MadeShot truth = telling_shot({code(frame, 0), 0.005, 1});
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          ASSERT_EQ(code(frame, x, y), truth.codes[static_cast<std::size_t>(y * width + x)])
              << format << " " << x << "," << y;
        }
      }
    }
  }
}

TEST_F(AravisCameraTest, TakesTheBestFormatUnasked) {
  EXPECT_THAT(open()->info().description,
              AllOf(HasSubstr("Platelight MadeGigE"), HasSubstr(made_->serial()),
                    HasSubstr("Mono16: grey codes of 16 bits, linear")));
}

TEST_F(AravisCameraTest, TakesGreyOf8BitsForLight) {
  const Frame frame = next_good(*open("?format=Mono8"));
  for (int x = 0; x < width; ++x) {
    // The pattern at that pixel, whose number the upper 8 bits do not tell.
    const int steps = static_cast<int>(std::lround(frame.image->at(20, x, 1) * 255)) -
                      static_cast<int>(std::lround(frame.image->at(20, 0, 1) * 255));
    EXPECT_NEAR(std::remainder(steps - x * 37 / 16.0, 256), 0, 1.01) << "codes are light";
  }
}

TEST_F(AravisCameraTest, KeepsTheBytesThatCame) {
  CameraOptions options;
  options.keep_coded = true;
  const auto camera = open("?format=Mono12Packed", options);
  const Frame frame = next_good(*camera);
  ASSERT_TRUE(frame.coded);
  ASSERT_EQ(frame.coded->bytes.size(), 2U * width * height) << "unpacked to words";
  CodedPictureReader reader(frame.coded->layout, {options.colour, std::nullopt});
  Image image;
  reader.read(frame.coded->bytes, {0, 0, width, height}, image);
  EXPECT_EQ(image.pixels, frame.image->pixels);
}

TEST_F(AravisCameraTest, SetsWhatIsAskedFor) {
  const auto camera = open("?format=Mono12&region=8,4,32,16&rate=40&exposure=0.002&Gain=6.0206");
  EXPECT_EQ(camera->info().width, 32);
  EXPECT_EQ(camera->info().height, 16);
  EXPECT_EQ(camera->info().rate, (Rational{40, 1}));
  const Frame frame = next_good(*camera);
  EXPECT_DOUBLE_EQ(frame.exposure_s, 0.002);
  const int number = (code(frame, 0) + 4096 * 100 - (4 * width + 8) * 37) % 4096;
  const MadeShot truth = telling_shot({number, 0.002, 2});
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 32; ++x) {
      EXPECT_EQ(code(frame, x, y), truth.codes[static_cast<std::size_t>((y + 4) * width + x + 8)]);
    }
  }
}

TEST_F(AravisCameraTest, SetsGainAndPacketSize) {
  const auto camera = open("?format=Mono12&gain=6.0206&packet_size=1000&socket_buffer=1000000");
  const Frame frame = next_good(*camera);
  EXPECT_EQ(code(frame, 2), 200);
}

TEST_F(AravisCameraTest, CountsAndTimesFrames) {
  const auto camera = open("?format=Mono12&rate=25");
  Time last{};
  int first_number = 0;
  for (int i = 0; i < 20; ++i) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, i);
    const Time now = monotonic_now();
    EXPECT_LE(frame->time, now);
    EXPECT_GT(frame->time, now - patience);
    if (i == 0) first_number = code(*frame, 0);
    if (frame->status == FrameStatus::good) {
      EXPECT_GE(code(*frame, 0), first_number);
    }
    EXPECT_GT(frame->time, last);
    last = frame->time;
  }
  EXPECT_EQ(camera->statistics().delivered, 20);
}

TEST_F(AravisCameraTest, FollowsExposuresAfterTheCamerasLag) {
  MadeGigeSettings settings = small();
  settings.exposure_lag = 3;
  make(settings);
  const auto camera = open("?format=Mono12&exposure=0.001");
  EXPECT_NEAR(camera->exposure_range()->shortest_s, 1e-5, 1e-12);
  EXPECT_NEAR(camera->exposure_range()->longest_s, 0.04, 1e-12);
  EXPECT_DOUBLE_EQ(next_good(*camera).exposure_s, 0.001);
  for (const double exposure_s : {0.002, 0.003, 0.001}) {
    EXPECT_NEAR(camera->set_exposure(exposure_s + 3e-7), exposure_s, 1e-12) << "in its steps";
    const int before = code(next_good(*camera), 0);
    Frame frame;
    for (int i = 0;
         i < 1000 && code(frame = next_good(*camera), 1) != std::lround(exposure_s * 1e5); ++i) {
      EXPECT_EQ(frame.exposure_s, 0) << "the camera does not tell it";
    }
    EXPECT_EQ(code(frame, 1), std::lround(exposure_s * 1e5));
    EXPECT_GE(code(frame, 0), before + settings.exposure_lag - 1);
  }
}

TEST_F(AravisCameraTest, RefusesAnExposureThatIsReadBackAsNone) {
  make(small());
  const auto camera = open("?format=Mono12&exposure=0.001");
  made_->hide_exposures(true);
  EXPECT_THROW(camera->set_exposure(0.002), std::runtime_error);
  made_->hide_exposures(false);
  EXPECT_NEAR(camera->set_exposure(0.003), 0.003, 1e-12);
}

TEST_F(AravisCameraTest, TellsTheExposureOfEachFrameThatTheCameraTells) {
  MadeGigeSettings settings = small();
  settings.has_chunks = true;
  make(settings);
  auto camera = open("?format=Mono12");
  EXPECT_THAT(camera->info().description, HasSubstr("exposures told"));
  std::map<int, int> seen;
  for (int i = 0; i < 40; ++i) {
    camera->set_exposure(i % 2 == 0 ? 0.001 : 0.002);
    const Frame frame = next_good(*camera);
    EXPECT_NEAR(frame.exposure_s * 1e5, code(frame, 1), 1e-6);
    ++seen[code(frame, 1)];
  }
  EXPECT_GT(seen[100], 5);
  EXPECT_GT(seen[200], 5);
  camera.reset();
  EXPECT_EQ(open("?chunks=0")->info().description.find("exposures told"), std::string::npos);
}

TEST_F(AravisCameraTest, CountsOnOverTheEndOfItsNumbers) {
  MadeGigeSettings settings = small();
  settings.first_block = 65520;
  settings.rate = 100;
  settings.exposure_s = 1e-3;
  make(settings);
  const auto camera = open("?format=Mono12");
  EXPECT_TRUE(camera->info().live);
  int last = code(*camera->next(), 0);
  for (int i = 1; i < 100; ++i) {
    const auto frame = camera->next();
    EXPECT_EQ(frame->number, i);
    if (frame->status != FrameStatus::good) continue;
    // What a busy machine lets pass is counted as lost.
    last = code(*frame, 0);
  }
  // Read wrongly, the step from 65535 to 1 would leave only losses to count.
  EXPECT_GT(last, 30);
  EXPECT_LT(last, 150);
}

TEST_F(AravisCameraTest, LosesTheFramesThatItsNumbersLeaveOut) {
  MadeGigeSettings settings = small();
  settings.rate = 5;  // slow: only what is dropped is lost
  make(settings);
  const auto camera = open("?format=Mono12");
  const Frame before = next_good(*camera);
  made_->drop_next(2);
  std::vector<Frame> lost;
  Frame frame = *camera->next();
  for (; frame.status == FrameStatus::lost || code(frame, 0) <= code(before, 0) + 1;
       frame = *camera->next()) {
    if (frame.status == FrameStatus::lost) lost.push_back(frame);
  }
  ASSERT_EQ(lost.size(), 2U);
  for (const Frame& one : lost) {
    EXPECT_THAT(one.note, AnyOf(HasSubstr("left out 2 frames"), HasSubstr("no picture came")));
    EXPECT_TRUE(one.image);
  }
  EXPECT_EQ(frame.number - before.number, code(frame, 0) - code(before, 0)) << "all are counted";
  const double between = static_cast<double>((frame.time - lost[0].time).count());
  const double half = static_cast<double>((lost[1].time - lost[0].time).count());
  EXPECT_NEAR(half / between, 0.5, 0.2) << "evenly in time";
  EXPECT_EQ(camera->statistics().lost, 2);
}

TEST_F(AravisCameraTest, SaysThatPacketsAreMissing) {
  MadeGigeSettings settings = small();
  settings.resends = false;
  settings.packet_loss = 0.05;
  make(settings);
  const auto camera = open("?format=Mono12&packet_size=576&resend=0");
  int damaged = 0;
  for (int i = 0; i < 100; ++i) {
    const auto frame = camera->next();
    if (frame->status != FrameStatus::damaged) continue;
    EXPECT_THAT(frame->note, HasSubstr("packets of the picture are missing"));
    ++damaged;
  }
  EXPECT_GT(damaged, 5);
  EXPECT_EQ(camera->statistics().damaged, damaged);
}

TEST_F(AravisCameraTest, RepairsPicturesByPacketsThatAreSentAgain) {
  MadeGigeSettings settings = small();
  settings.packet_loss = 0.05;
  make(settings);
  const auto camera = open("?format=Mono12&packet_size=576");
  int good = 0;
  for (int i = 0; i < 100; ++i) good += camera->next()->status == FrameStatus::good ? 1 : 0;
  EXPECT_GT(good, 40);
  EXPECT_GT(made_->counts().resent_packets, 10);
}

TEST_F(AravisCameraTest, ReturnsWithItsSettingsAfterItWasUnplugged) {
  const auto camera = open("?format=Mono12&region=8,4,32,16&rate=30&exposure=0.001&Gain=6.0206");
  camera->set_exposure(0.003);
  next_good(*camera);
  made_->unplug();
  Time last{};
  int lost = 0;
  const Time gone = monotonic_now();
  while (lost < 60) {
    const auto frame = camera->next();
    if (frame->status == FrameStatus::good) continue;
    EXPECT_THAT(frame->note, AnyOf(HasSubstr("no picture came"), HasSubstr("away")));
    EXPECT_TRUE(frame->image);
    EXPECT_GT(frame->time, last);
    last = frame->time;
    ++lost;
  }
  EXPECT_GT(monotonic_now() - gone, 1s) << "frames are lost at the camera's rate";
  EXPECT_THROW(camera->set_exposure(0.002), std::runtime_error);
  made_->plug_in();
  const std::int64_t number_at_return = camera->statistics().delivered;
  const Frame frame = next_good(*camera);
  EXPECT_EQ(frame.image->width, 32);
  // The pattern tells nothing of exposure here: the whole sensor's first pixels are outside.
  EXPECT_EQ(camera->statistics().delivered - 1, frame.number);
  const auto frames_to_return = static_cast<int>(frame.number - number_at_return);
  RecordProperty("frames_to_return", frames_to_return);
  EXPECT_LE(frames_to_return, 60) << "2 s";
  EXPECT_NEAR(camera->set_exposure(0.001), 0.001, 1e-9);
}

// An exposure far longer than a frame slows the camera: its frames come later, and none is lost.
TEST_F(AravisCameraTest, WaitsForTheSlowestFrames) {
  MadeGigeSettings settings = small();
  settings.exposures = {1e-5, 2};
  make(settings);
  const auto camera = open("?format=Mono12&rate=30&exposure=0.5");
  next_good(*camera);
  for (int i = 0; i < 3; ++i) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->status, FrameStatus::good) << frame->note;
  }
  EXPECT_EQ(camera->statistics().lost, 0);
}

// What an exposure is need not be said in the URI.
TEST_F(AravisCameraTest, WaitsForSlowFramesWhoseExposureTheCameraTells) {
  MadeGigeSettings settings = small();
  settings.exposures = {1e-5, 2};
  for (const bool set_before : {false, true}) {
    settings.exposure_s = set_before ? 0.6 : 0.005;
    make(settings);
    const auto camera =
        open(set_before ? "?format=Mono12&rate=30" : "?format=Mono12&rate=30&ExposureTime=600000");
    for (int i = 0; i < 3; ++i) {
      const auto frame = camera->next();
      EXPECT_EQ(frame->status, FrameStatus::good) << frame->note;
      EXPECT_NEAR(frame->exposure_s, 0.6, 1e-9);
    }
    EXPECT_EQ(camera->statistics().lost, 0);
  }
}

// An exposure that was set long ago, or by the camera itself, may go on.
TEST_F(AravisCameraTest, WaitsForSlowFramesThatTellTheirExposure) {
  MadeGigeSettings settings = small();
  settings.exposures = {1e-5, 2};
  settings.has_chunks = true;
  settings.exposure_lag = 4;
  make(settings);
  const auto camera = open("?format=Mono12&rate=30&exposure=0.4");
  next_good(*camera);
  camera->set_exposure(0.001);
  int slow = 0;
  for (Frame frame = *camera->next(); frame.exposure_s > 0.3; frame = *camera->next()) {
    EXPECT_EQ(frame.status, FrameStatus::good) << frame.note;
    ++slow;
  }
  EXPECT_GE(slow, 3);
  EXPECT_EQ(camera->statistics().lost, 0);
}

// Its first picture takes an exposure and a transfer, which together are longer than a frame.
TEST_F(AravisCameraTest, ReturnsThoughItsFirstPictureTakesLongerThanAFrame) {
  MadeGigeSettings settings = small();
  settings.link_bits_per_s = 3e6;  // 17 ms for a picture
  make(settings);
  const auto camera = open("?format=Mono12&rate=30&exposure=0.022&packet_size=576&resend=0");
  next_good(*camera);
  made_->unplug();
  while (camera->next()->note.find("away") == std::string::npos) {
  }
  made_->plug_in();
  const std::int64_t number_at_return = camera->statistics().delivered;
  const Frame frame = next_good(*camera);
  EXPECT_LE(frame.number - number_at_return, 60) << "2 s";
  EXPECT_EQ(camera->statistics().delivered - 1, frame.number);
}

TEST_F(AravisCameraTest, ReturnsWithItsExposure) {
  const auto camera = open("?format=Mono12&rate=30");
  camera->set_exposure(0.003);
  next_good(*camera);
  made_->unplug();
  while (camera->next()->status == FrameStatus::good) {
  }
  made_->plug_in();
  Frame frame;
  do {
    frame = next_good(*camera);
  } while (code(frame, 0) > 1000);
  EXPECT_EQ(code(frame, 1), 300);
}

TEST_F(AravisCameraTest, IsOneProgramsAtATime) {
  const auto camera = open();
  EXPECT_THAT(refusal(""), HasSubstr("another program controls the camera"));
}

TEST_F(AravisCameraTest, CutsOutAPart) {
  CameraOptions options;
  options.crop = {8, 4, 16, 10};
  EXPECT_EQ(next_good(*open("", options)).image->height, 10);
  options.crop = {60, 0, 16, 10};
  EXPECT_THAT(refusal("", options), HasSubstr("64"));
}

TEST_F(AravisCameraTest, RefusesWhatTheCameraHasNot) {
  EXPECT_THAT(refusal("?format=RGB8"),
              AllOf(HasSubstr("RGB8 was asked for"), HasSubstr("Mono12, Mono8, Mono12Packed")));
  EXPECT_THAT(refusal("?exposure=1"),
              AllOf(HasSubstr("exposure of 1 s was asked for"), HasSubstr("1e-05 s to 0.04 s")));
  EXPECT_THAT(refusal("?rate=5000"), AllOf(HasSubstr("rate"), HasSubstr("1000")));
  EXPECT_THAT(refusal("?size=640x480"), AllOf(HasSubstr("640x480"), HasSubstr("64x48")));
  EXPECT_THAT(refusal("?region=60,0,16,16"), HasSubstr("16x16 at 60,0"));
  EXPECT_THAT(refusal("?gain=99"), AllOf(HasSubstr("gain 99"), HasSubstr("24")));
  EXPECT_THAT(refusal("?Zoom=1"), AllOf(HasSubstr("Zoom=1"), HasSubstr("ExposureTime")));
  EXPECT_THAT(refusal("?Width=9999"), AllOf(HasSubstr("Width=9999"), HasSubstr("4 to 64")));
  EXPECT_THAT(refusal("?AcquisitionMode=Sometimes"),
              AllOf(HasSubstr("AcquisitionMode=Sometimes"), HasSubstr("Continuous")));
  EXPECT_THAT(refusal("?packet_size=20000"), HasSubstr("packet_size=20000"));
}

TEST_F(AravisCameraTest, RefusesExposuresWhileItRuns) {
  const auto camera = open();
  try {
    camera->set_exposure(2);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(made_->address()), HasSubstr("2 s was asked for"),
                                    HasSubstr("0.04 s")));
  }
  EXPECT_EQ(next_good(*camera).exposure_s, 0.005) << "nothing was changed";
}

TEST_F(AravisCameraTest, RefusesWhatItCannotReadInTheUri) {
  for (const char* settings :
       {"?format=", "?size=64", "?rate=0", "?rate=nan", "?exposure=fast", "?exposure=0", "?zoom=1",
        "?region=1,2,3", "?region=1,2,3,4,5", "?region=-1,0,8,8", "?size=8x8&region=0,0,8,8",
        "?packet_size=8", "?packet_socket=2", "?=3", "?Gain"}) {
    EXPECT_THAT(refusal(settings), HasSubstr("write aravis:NAME?format=Mono12")) << settings;
  }
}

TEST_F(AravisCameraTest, HasNoFrameToStartAt) {
  CameraOptions options;
  options.frame = 5;
  EXPECT_THAT(refusal("", options), HasSubstr("frame 0"));
}

TEST_F(AravisCameraTest, IsFoundByItsNames) {
  MadeGigeSettings settings = small();
  settings.serial = "A" + made_->serial();
  const MadeGigeCamera other(settings, telling_shot);
  const std::vector<AravisDevice> devices = find_aravis();
  const auto found = std::ranges::find(devices, made_->serial(), &AravisDevice::serial);
  ASSERT_NE(found, devices.end());
  EXPECT_EQ(found->id, "Platelight-MadeGigE-" + made_->serial());
  EXPECT_EQ(found->address, made_->address());
  EXPECT_EQ(found->protocol, "GigEVision");
  EXPECT_EQ(resolve_aravis(made_->serial()).address, made_->address());
  EXPECT_EQ(resolve_aravis("GigE-" + made_->serial()).address, made_->address());
  for (const char* name : {"", "MadeGigE", "no such camera"}) {
    try {
      resolve_aravis(name);
      ADD_FAILURE() << name;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr(made_->serial() + " at " + made_->address()),
                                      HasSubstr(other.serial())));
    }
  }
}

TEST_F(AravisCameraTest, IsListedWithWhatItCan) {
  const AravisListing listing = list_aravis();
  const auto found = std::ranges::find(listing.cameras, made_->serial(),
                                       [](const auto& entry) { return entry.device.serial; });
  ASSERT_NE(found, listing.cameras.end());
  EXPECT_EQ(found->fault, "");
  EXPECT_THAT(found->abilities.formats, testing::Contains("Mono12Packed"));
  EXPECT_EQ(found->abilities.largest, (PictureSize{width, height}));
  EXPECT_EQ(found->abilities.highest_rate, 1000);
  EXPECT_NEAR(found->abilities.exposures->longest_s, 0.04, 1e-12);
}

TEST(OpenAravis, SaysThatNothingAnswers) {
  try {
    open_camera("aravis:127.0.0.9");
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("aravis:127.0.0.9"), HasSubstr("reached")));
  }
}

TEST(OpenAravis, ReadsTwoCamerasAtOnce) {
  MadeGigeCamera one(small(), telling_shot);
  MadeGigeCamera other(small(), telling_shot);
  const auto a = open_camera(one.uri() + "?format=Mono12");
  const auto b = open_camera(other.uri() + "?format=Mono12");
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(a->next()->image);
    EXPECT_TRUE(b->next()->image);
  }
}

std::int64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t all = 0;
  std::int64_t resident = 0;
  statm >> all >> resident;
  return resident * 4096;
}

// Issue: nothing may leak, and nothing stall, whatever the network loses.
TEST(AravisCameraSoak, NeitherLeaksNorStallsWhilePacketsAreLost) {
  const int frames = PLATELIGHT_FULL_TESTS ? 10000 : 500;
  MadeGigeSettings settings = small();
  settings.rate = 100;
  settings.exposure_s = 1e-3;
  settings.packet_loss = 0.01;
  settings.drop_share = 0.002;
  const MadeGigeCamera made(settings, telling_shot);
  const auto camera = open_camera(made.uri() + "?format=Mono12&packet_size=576");
  std::int64_t before = 0;
  for (int i = 0; i < frames; ++i) {
    const Time asked = monotonic_now();
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, i);
    ASSERT_LT(monotonic_now() - asked, Time(patience)) << "it stalls";
    if (i == frames / 5) before = resident_bytes();
  }
  const CameraStatistics counts = camera->statistics();
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // Sanitizers keep what was freed, and tell what leaks themselves.
  EXPECT_LT(resident_bytes() - before, 4 << 20) << "memory grows";
#else
  (void)before;
#endif
  EXPECT_GT(made.counts().lost_packets, frames / 20);
  EXPECT_GT(counts.delivered - counts.lost - counts.damaged, frames / 2);
  RecordProperty("lost", static_cast<int>(counts.lost));
  RecordProperty("damaged", static_cast<int>(counts.damaged));
}

}  // namespace
}  // namespace capture::aravis_camera_test
