// The demo writes what it says, and the same again.
#include "studio/demo.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "capture/camera.h"
#include "capture/exr.h"
#include "studio/set.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

DemoSettings tiny(const std::string& name) {
  DemoSettings settings;
  settings.dir = fs::path(testing::TempDir()) / ("platelight_demo_" + name);
  fs::remove_all(settings.dir);
  settings.studio = {.width = 64,
                     .height = 48,
                     .probe_size = 64,
                     .sky_height = 128,
                     .texture_size = 64,
                     .frames = 6};
  settings.samples = 4;
  return settings;
}

void ignore(double, std::string_view) {}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(WriteCourtDemo, WritesASetThatCanBeReadWithAPlateAndAProbeOfOneLength) {
  const DemoSettings settings = tiny("whole");
  const DemoFigures figures = write_court_demo(settings, ignore);
  EXPECT_EQ(figures.frames, 6);
  EXPECT_EQ(figures.shots, 18);
  EXPECT_GT(figures.car_share, 0.25);
  EXPECT_LT(figures.car_share, 0.35);
  EXPECT_GT(figures.ground_share, 0.4);
  const Set set = read_set((settings.dir / "car.toml").string());
  const auto count = [](const std::string& uri) {
    const auto camera = capture::open_camera(uri);
    int frames = 0;
    while (const auto frame = camera->next()) {
      EXPECT_EQ(frame->status, capture::FrameStatus::good);
      ++frames;
    }
    return frames;
  };
  EXPECT_EQ(count(set.camera.source), 6);
  ASSERT_TRUE(set.probe);
  EXPECT_EQ(count(set.probe->source), 18);
  fs::remove_all(settings.dir);
}

TEST(WriteCourtDemo, WritesTheLightThatThePlateWasFilmedIn) {
  const DemoSettings settings = tiny("truth");
  write_court_demo(settings, ignore);
  const capture::Image plate =
      capture::read_exr((settings.dir / "truth/plate_linear_0000.exr").string());
  const auto camera = capture::open_camera("file:" + (settings.dir / "plate.mkv").string());
  const auto frame = camera->next();
  ASSERT_TRUE(frame && frame->image);
  double filmed = 0;
  double truth = 0;
  for (std::size_t i = 0; i < plate.pixels.size(); ++i) {
    truth += std::min(plate.pixels[i], 1.0F);
    filmed += frame->image->pixels[i];
  }
  EXPECT_NEAR(filmed / truth, 1, 0.01);
  const capture::Image environment =
      capture::read_exr((settings.dir / "truth/environment.exr").string());
  EXPECT_EQ(environment.width, 2 * environment.height);
  fs::remove_all(settings.dir);
}

TEST(WriteCourtDemo, WritesTheSameBytesAgain) {
  const DemoSettings once = tiny("once");
  const DemoSettings again = tiny("again");
  write_court_demo(once, ignore);
  write_court_demo(again, ignore);
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(once.dir)) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), once.dir);
    EXPECT_TRUE(bytes_of(entry.path()) == bytes_of(again.dir / name)) << name;
    ++files;
  }
  EXPECT_GT(files, 20);
  fs::remove_all(once.dir);
  fs::remove_all(again.dir);
}

}  // namespace
}  // namespace studio
