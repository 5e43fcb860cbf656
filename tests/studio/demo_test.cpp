// The demo writes what it says, and the same again.
#include "studio/demo.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/camera.h"
#include "capture/exr.h"
#include "capture/rgbe.h"
#include "render/made_park.h"
#include "studio/demo_files.h"
#include "studio/frame_maker.h"
#include "studio/set.h"
#include "studio/start.h"

namespace studio::demo_test {
namespace {

namespace fs = std::filesystem;

DemoSettings tiny(const std::string& name) {
  DemoSettings settings;
  settings.dir =
      fs::path(testing::TempDir()) / ("platelight_demo_" + name + std::to_string(getpid()));
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

TEST(WriteDemo, WritesASetThatCanBeReadWithAPlateAndAProbeOfOneLength) {
  const DemoSettings settings = tiny("whole");
  const DemoFigures figures = write_demo(settings, ignore);
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

TEST(WriteDemo, WritesTheLightThatThePlateWasFilmedIn) {
  const DemoSettings settings = tiny("truth");
  write_demo(settings, ignore);
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

TEST(WriteDemo, ReplacesNoOtherSetOrPlate) {
  DemoSettings settings = tiny("other");
  settings.studio.frames = 1;
  settings.samples = 1;
  fs::create_directories(settings.dir);
  const auto expect_refused = [&](const char* name) {
    const fs::path file = settings.dir / name;
    std::ofstream(file) << "mine";
    EXPECT_THROW(write_demo(settings, ignore), std::runtime_error) << name;
    EXPECT_EQ(bytes_of(file), "mine");
    fs::remove(file);
  };
  expect_refused("car.toml");
  expect_refused("plate.mkv");
  write_demo(settings, ignore);
  const std::string set = bytes_of(settings.dir / "car.toml");
  write_demo(settings, ignore);
  EXPECT_EQ(bytes_of(settings.dir / "car.toml"), set);
  expect_refused("car.toml");
  fs::remove_all(settings.dir);
}

TEST(WriteDemo, WritesTheSameBytesAgain) {
  const DemoSettings once = tiny("once");
  const DemoSettings again = tiny("again");
  write_demo(once, ignore);
  write_demo(again, ignore);
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

// The park under a map of a sky with a sun, made here.
DemoSettings tiny_park(const std::string& name) {
  DemoSettings settings = tiny(name);
  settings.world = DemoWorld::park;
  fs::create_directories(settings.dir);
  settings.map = settings.dir / "sky.hdr";
  const render::MadeSky sky =
      render::make_sky({.height = 128, .sun_azimuth_rad = -0.6F, .sun_elevation_rad = 0.5F});
  capture::Image map = sky.rest;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    map.pixels[i] = 0.6F * (map.pixels[i] + sky.sun.pixels[i]);
  }
  capture::write_rgbe(settings.map.string(), map);
  settings.studio.width = 192;
  settings.studio.height = 108;
  settings.studio.frames = 3;
  settings.samples = 16;
  return settings;
}

// The middle of how much brighter a picture's pixels are than another's, in green: single glints of
// the sun, which a photograph of few samples has at random, do not move it.
double median_ratio(const capture::Image& a, const capture::Image& b, const capture::Image& mask) {
  std::vector<double> ratios;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(y, x) > 0) ratios.push_back(a.at(y, x, 1) / b.at(y, x, 1));
    }
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::ranges::nth_element(ratios, middle);
  return *middle;
}

// The whole way: footage, probe, match, lights, kernel. What comes out is what a camera would have
// seen with the car there.
TEST(WriteDemo, OfTheParkIsCompositedAsItsPhotographSays) {
  start();
  const DemoSettings settings = tiny_park("park");
  const DemoFigures figures = write_demo(settings, ignore);
  EXPECT_EQ(figures.shots, 12);
  FrameMaker maker(read_set(figures.set.string()));
  const PreparedFrame first = maker.make(0).value();
  render::FrameResult result;
  render_frame(first.inputs(), first.job, *first.plate, result);
  const capture::Image composite = capture::to_float(result.rgba);
  const auto truth = [&](const char* name) {
    return capture::read_exr((settings.dir / "truth" / name).string());
  };
  const capture::Image plate = truth("plate_linear_0000.exr");
  const capture::Image photograph = truth("photograph_0000.exr");
  const capture::Image coverage = truth("coverage_0000.exr");
  capture::Image car = coverage;
  capture::Image shadow = coverage;
  int shaded = 0;
  for (std::size_t i = 0; i < coverage.pixels.size(); ++i) {
    car.pixels[i] = coverage.pixels[i] == 1 ? 1.0F : 0.0F;
    const bool dark = photograph.pixels[3 * i + 1] < 0.6F * plate.pixels[3 * i + 1];
    shadow.pixels[i] = coverage.pixels[i] == 0 && dark ? 1.0F : 0.0F;
    shaded += shadow.pixels[i] > 0;
  }
  EXPECT_GT(shaded, 100);
  EXPECT_NEAR(median_ratio(composite, photograph, car), 1, 0.05);
  EXPECT_NEAR(median_ratio(composite, photograph, shadow), 1, 0.05);
  // The camera moves, and the car stays where it stands.
  const PreparedFrame last = maker.make(2).value();
  EXPECT_FALSE(last.job.cam_from_set == first.job.cam_from_set);
  EXPECT_FALSE(maker.make(3));
  fs::remove_all(settings.dir);
}

// The lamp of the set is a point over the ground; the photograph's is a glowing disc under a shade.
TEST(WriteDemo, WithALampIsLitByItAsItsPhotographSays) {
  start();
  DemoSettings settings = tiny("lamp");
  settings.lamp = true;
  settings.studio.width = 160;
  settings.studio.height = 120;
  settings.studio.frames = 1;
  settings.samples = 16;
  const DemoFigures figures = write_demo(settings, ignore);
  const Set set = read_set(figures.set.string());
  ASSERT_EQ(set.lamps.size(), 1U);
  EXPECT_NEAR(set.lamps[0].facing.value().z, -1, 1e-6);
  const PreparedFrame frame = FrameMaker(set).make(0).value();
  render::FrameResult result;
  render_frame(frame.inputs(), frame.job, *frame.plate, result);
  const auto truth = [&](const char* name) {
    return capture::read_exr((settings.dir / "truth" / name).string());
  };
  const capture::Image plate = truth("plate_linear_0000.exr");
  const capture::Image photograph = truth("photograph_0000.exr");
  capture::Image lit = truth("coverage_0000.exr");
  int pixels = 0;
  for (std::size_t i = 0; i < lit.pixels.size(); ++i) {
    const bool brighter = photograph.pixels[3 * i] > 1.25F * plate.pixels[3 * i];
    lit.pixels[i] = lit.pixels[i] == 0 && brighter ? 1.0F : 0.0F;
    pixels += lit.pixels[i] > 0;
  }
  EXPECT_GT(pixels, 100);
  EXPECT_NEAR(median_ratio(capture::to_float(result.rgba), photograph, lit), 1, 0.06);
  fs::remove_all(settings.dir);
}

TEST(ParkSet, IsTheOneInTheProjectButForWhereItsFootageLies) {
  render::MadeStudioSettings settings = render::park_settings();
  settings.texture_size = 64;
  capture::Image map = capture::make_image(128, 256);
  std::ranges::fill(map.pixels, 1.0F);
  const render::MadeStudio park = render::make_park(map, settings);
  EXPECT_EQ(bytes_of(fs::path(PLATELIGHT_SOURCE_DIR) / "studio/sets/park_car.toml"),
            park_set(park, "../../demo/park/"));
}

// H.264 has no odd sizes.
TEST(HeightFor, IsEvenAndKeepsTheShape) {
  for (const render::MadeStudioSettings& studio :
       {render::MadeStudioSettings{}, render::park_settings()}) {
    EXPECT_EQ(height_for(studio, studio.width), studio.height);
    for (int width = 32; width <= 8192; width += 2) {
      const int height = height_for(studio, width);
      EXPECT_EQ(height % 2, 0) << width;
      EXPECT_NEAR(height, static_cast<double>(width) * studio.height / studio.width, 1) << width;
    }
  }
}

TEST(MakeDemoStudio, NamesAMapThatCannotLightThePark) {
  DemoSettings settings = tiny_park("dark");
  capture::write_rgbe(settings.map.string(), capture::make_image(16, 32));
  try {
    make_demo_studio(settings);
    FAIL() << "took a dark map";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("sky.hdr"));
  }
  fs::remove_all(settings.dir);
}

}  // namespace
}  // namespace studio::demo_test
