// The live set: its cameras, their packets, their exposures, and the light that comes of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "render/made_studio.h"
#include "studio/set.h"
#include "studio/show.h"
#include "studio/start.h"
#include "tests/made_files.h"

namespace studio::live_car_test {
namespace {

const std::string live_car = std::string(PLATELIGHT_SOURCE_DIR) + "/studio/sets/live_car.toml";

// How far apart two lenses see a pixel, in radians.
double apart_rad(const calibrate::Lens& a, const calibrate::Lens& b, double x, double y) {
  const auto one = calibrate::unproject(a, {x, y});
  const auto other = calibrate::unproject(b, {x, y});
  if (!one || !other) return one.has_value() == other.has_value() ? 0 : 1;
  return calibrate::length(calibrate::normalize(*one) - calibrate::normalize(*other));
}

TEST(LiveCar, SeesAsItsMadeCamerasDo) {
  start();
  const Set set = read_set(live_car);
  const render::MadeStudio studio = render::make_studio(
      {.width = 480, .height = 360, .probe_size = 256, .sky_height = 128, .texture_size = 64});
  for (double y = 0; y < 360; y += 40) {
    for (double x = 0; x < 480; x += 40) {
      EXPECT_LT(apart_rad(set.camera.lens, studio.plate.lens, x, y), 1e-5);
    }
  }
  for (double y = 0; y < 256; y += 16) {
    for (double x = 0; x < 256; x += 16) {
      EXPECT_LT(apart_rad(*set.probe->lens, studio.probe.lens, x, y), 1e-4);
    }
  }
  const calibrate::Vec3 p{0.3, 0.7, 0.2};
  EXPECT_LT(calibrate::length(set.camera.pose.cam_from_set * p - studio.plate.cam_from_set * p),
            1e-6);
  EXPECT_LT(calibrate::length(set.probe->probe_from_set * p - studio.probe.cam_from_set * p), 1e-6);
}

// The same set with pictures that are made faster, and the probe's packets lossy.
Set quick_set(const std::filesystem::path& dir,
              const std::string& loss,
              const std::string& exposures = "") {
  std::ifstream file(live_car);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!exposures.empty()) {
    const std::string list = "[0.008, 0.0003, 0.00001]";
    text.replace(text.find(list), list.size(), exposures);
  }
  for (std::size_t at = 0; (at = text.find("samples=8", at)) != std::string::npos;) {
    text.replace(at, 9, "samples=2&loss=" + loss);
  }
  const std::filesystem::path path = dir / "live.toml";
  std::ofstream(path) << text;
  return read_set(path);
}

class LiveCarTest : public testing::Test {
 protected:
  void SetUp() override {
    start();
    dir_ = made::make_temporary_directory();
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }
  std::filesystem::path dir_;
};

TEST_F(LiveCarTest, IsLitAsItsPlateShows) {
  ShowOptions options;
  options.frames = 60;
  Show show(quick_set(dir_, "0"), options);
  show.run();
  const ShowStatus status = *show.status();
  EXPECT_EQ(status.frames, 60);
  EXPECT_EQ(status.display_nan, 0);
  EXPECT_EQ(status.probe.shots, 3U);
  EXPECT_GT(status.probe.frames, 100);
  // One unit of radiance fills the plate's well 1 time and the probe's 10 times.
  for (const float gain : status.match.gain) EXPECT_NEAR(gain, 0.1, 0.004);
}

// From a picture's arrival to ours. Those that a busy machine holds up are few, the first one among
// them, which is rendered with nothing kept.
TEST_F(LiveCarTest, ShowsItsPlateWithinTwoFrames) {
  if (!PLATELIGHT_FULL_TESTS) GTEST_SKIP() << "needs a machine of its own: tests/run.sh --full";
  ShowOptions options;
  options.frames = 60;
  Show show(quick_set(dir_, "0"), options);
  const capture::Time most = 2 * capture::time_of_frame(1, {25, 1});
  int late = 0;
  show.run([&](const ShownFrame& shown) {
    late += std::chrono::steady_clock::now() - shown.prepared.arrived > most;
  });
  EXPECT_LE(late, 3) << "of 60";
  EXPECT_GT(show.status()->delay_frames, 0);
  EXPECT_LE(show.status()->delay_frames, 2);
}

TEST_F(LiveCarTest, ChoosesItsProbesExposures) {
  ShowOptions options;
  options.frames = 60;
  Show show(quick_set(dir_, "0", "\"auto\""), options);
  show.run();
  const ShowStatus status = *show.status();
  EXPECT_EQ(status.frames, 60);
  const std::vector<double>& exposures_s = status.probe.exposures_s;
  ASSERT_FALSE(exposures_s.empty());
  EXPECT_LE(exposures_s.size(), 4U);
  EXPECT_GE(exposures_s.front(), 1e-6);
  EXPECT_LE(exposures_s.back(), 1.0 / 60);
  EXPECT_GE(status.probe.shots, exposures_s.size());
  EXPECT_FALSE(status.probe.too_bright) << "1 us is short enough for its sun";
  // While exposures change on a busy machine the light may be some frames old, as where packets are
  // lost.
  for (const float gain : status.match.gain) EXPECT_NEAR(gain, 0.1, 0.006);
}

TEST_F(LiveCarTest, GoesOnWhilePacketsAreLost) {
  ShowOptions options;
  options.frames = 40;
  Show show(quick_set(dir_, "10"), options);
  show.run();
  const ShowStatus status = *show.status();
  EXPECT_EQ(status.frames, 40);
  for (const float gain : status.match.gain) EXPECT_NEAR(gain, 0.1, 0.006);
}

}  // namespace
}  // namespace studio::live_car_test
