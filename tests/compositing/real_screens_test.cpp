// The keyer on pictures that nobody made for it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/linearise.h"
#include "capture/still.h"
#include "compositing/keyer.h"
#include "compositing/made_clip.h"
#include "compositing/made_video_camera.h"
#include "compositing/plate_footage.h"
#include "tests/made_files.h"

namespace compositing::real_screens_test {
namespace {

PlateFootage footage_of(std::span<const capture::Image> frames) {
  PlateFootage footage;
  for (const capture::Image& frame : frames) footage.add(frame);
  return footage;
}

using capture::Image;

std::string data_path(const std::string& name) {
  const std::filesystem::path path = made::real_data() / name;
  return std::filesystem::exists(path) ? path.string() : std::string();
}

std::vector<Image> frames_of(const std::string& path, int from, int to, int step) {
  const auto camera = capture::open_camera("file:" + path);
  std::vector<Image> frames;
  for (int i = 0; i < to; ++i) {
    const auto frame = camera->next();
    if (!frame || !frame->image) break;
    if (i >= from && (i - from) % step == 0) frames.push_back(*frame->image);
  }
  return frames;
}

// What a key leaves of the screen's colour in the edges of what it found, over grey, how much of
// the inside is not whole, and how much of the screen is not clear.
struct EdgeAndCore {
  double excess = 0;  // mean over pixels within 3 of the outline
  double holes = 0;   // share of alpha below .98 at 5 pixels and more from it
  double haze = 0;    // share of alpha above .05 of what is not inside
};

EdgeAndCore measure(const Image& keyed, ScreenColour colour) {
  const int h = keyed.height, w = keyed.width;
  const auto inside = [&](int y, int x) { return keyed.at(y, x, 3) > 0.5F; };
  const auto order = channels_of(colour);
  double sum = 0, band = 0, holes = 0, core = 0, haze = 0, outside = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      bool edge = false, whole = inside(y, x);
      for (int dy = -5; dy <= 5; ++dy) {
        for (int dx = -5; dx <= 5; ++dx) {
          if (dx * dx + dy * dy > 25) continue;
          const int yy = y + dy, xx = x + dx;
          if (yy < 0 || xx < 0 || yy >= h || xx >= w) continue;
          if (!inside(yy, xx)) whole = false;
          if (dx * dx + dy * dy <= 9 && inside(yy, xx) != inside(y, x)) edge = true;
        }
      }
      if (edge) {
        const auto over_grey = [&](std::size_t i) {
          return keyed.at(y, x, order[i]) + 0.18F * (1 - keyed.at(y, x, 3));
        };
        // Skin has some of a yellow wall's colour itself: signed, green against the two others.
        const float excess = screen_excess<false>(over_grey(0), over_grey(1), over_grey(2));
        sum += has_two_primaries(colour) ? excess : std::max(0.0F, excess);
        band += 1;
      }
      if (!inside(y, x)) haze += keyed.at(y, x, 3) > 0.05F ? 1 : 0, outside += 1;
      if (whole) holes += keyed.at(y, x, 3) < 0.98F ? 1 : 0, core += 1;
    }
  }
  return {sum / std::max(band, 1.0), holes / std::max(core, 1.0), haze / std::max(outside, 1.0)};
}

EdgeAndCore measure_clip(const std::vector<Image>& frames,
                         const CleanPlate& plate,
                         const KeySettings& settings) {
  Keyer keyer(plate, settings);
  capture::HalfImage half;
  EdgeAndCore mean;
  for (const Image& frame : frames) {
    keyer.restart();
    keyer.key(frame, half);
    const EdgeAndCore one = measure(to_float(half), plate.colour);
    mean.excess += one.excess / static_cast<double>(frames.size());
    mean.holes += one.holes / static_cast<double>(frames.size());
    mean.haze += one.haze / static_cast<double>(frames.size());
  }
  return mean;
}

// Mean squared error of alpha of the lemur before an unevenly lit made screen.
double error_of_lemur(const std::string& path, bool halved_chroma) {
  capture::LightCurves srgb;
  srgb.colour.transfer = capture::Transfer::srgb;
  capture::LightCurves linear;
  linear.colour.transfer = capture::Transfer::linear;
  const Image foreground = capture::read_still(path, srgb).image;
  const Image alpha = capture::read_still(data_path("alpha_gt/lemur_alpha.png"), linear).image;
  MadeScene scene = made_scene("uneven");
  scene.uneven = 0.4F;
  scene.noise_gain = 3e-4F;
  scene.halved_chroma = halved_chroma;
  const MadeClip clip(scene, 4, foreground.height, foreground.width);
  std::vector<Image> shots;
  for (int i = 0; i < 8; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  const CleanPlate plate = average_plate(shots);
  Keyer keyer(plate, {});
  capture::HalfImage half;
  for (int frame = 0; frame < 4; ++frame) {
    Image light = plate.light;
    for (std::size_t i = 0; i < light.pixels.size(); ++i) {
      const float a = alpha.pixels[i - i % 3];
      light.pixels[i] = a * foreground.pixels[i] + (1 - a) * plate.light.pixels[i];
    }
    const MadeSensor sensor{scene.noise_gain, scene.noise_floor, halved_chroma};
    const MadePicture seen{light.height, light.width,
                           photograph_light(light, sensor, 77 + static_cast<std::uint64_t>(frame))};
    keyer.key(light_of(seen), half);
  }
  const Image keyed = to_float(half);
  double sum = 0;
  for (std::size_t i = 0; i < alpha.pixels.size(); i += 3) {
    const double off = keyed.pixels[i / 3 * 4 + 3] - alpha.pixels[i];
    sum += off * off;
  }
  return sum * 3 / static_cast<double>(alpha.pixels.size());
}

TEST(RealScreens, FurOfTheLemurIsKeyedFromAMadeScreen) {
  const std::string path = data_path("alpha_gt/lemur_foreground.png");
  if (path.empty()) GTEST_SKIP() << "needs PLATELIGHT_DATA/alpha_gt";
  EXPECT_LE(error_of_lemur(path, false), 0.7e-3);
  EXPECT_LE(error_of_lemur(path, true), 0.7e-3);  // through 4:2:0
}

TEST(RealScreens, TheDancersEdgesAreCleanAndHisBodyWhole) {
  const std::string path = data_path("greenscreen/aframe_dancer_360x640.mp4");
  if (path.empty()) GTEST_SKIP() << "needs PLATELIGHT_DATA/greenscreen";
  const std::vector<Image> frames = frames_of(path, 0, 139, 6);
  KeySettings settings;
  settings.core = 0.7F;  // his flag is a pale yellow
  settings.despill = 2;
  const EdgeAndCore found = measure_clip(frames, footage_of(frames).screen(), settings);
  RecordProperty("excess", std::to_string(found.excess));
  RecordProperty("holes", std::to_string(found.holes));
  EXPECT_LE(found.excess, 0.01) << found.holes;
  EXPECT_LE(found.holes, 0.001);
}

TEST(RealScreens, AYellowWallsEdgesAreCleanAndThePersonWhole) {
  const std::string path = data_path("greenscreen/mdn_man_yellowgreen_320x192.mp4");
  if (path.empty()) GTEST_SKIP() << "needs PLATELIGHT_DATA/greenscreen";
  const std::vector<Image> all = frames_of(path, 1183, 1465, 3);
  std::vector<Image> bare, frames;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t number = 1183 + 3 * i;
    if (number <= 1206 || (number >= 1296 && number <= 1310)) bare.push_back(all[i]);
    if (number >= 1350) frames.push_back(all[i]);
  }
  const CleanPlate plate = footage_of(bare).screen(ScreenColour::yellow);
  KeySettings settings;
  settings.core = 0.64F;
  settings.screen = 0.1F;  // the wall shows the blocks of a low rate
  const EdgeAndCore found = measure_clip(frames, plate, settings);
  RecordProperty("excess", std::to_string(found.excess));
  RecordProperty("holes", std::to_string(found.holes));
  EXPECT_LE(std::abs(found.excess), 0.01) << found.holes;
  EXPECT_LE(found.holes, 0.001);
}

// A single picture is its own footage.
EdgeAndCore measure_picture(const std::string& path, const KeySettings& settings) {
  const std::vector<Image> frames = frames_of(path, 0, 1, 1);
  const EdgeAndCore found = measure_clip(frames, footage_of(frames).screen(), settings);
  testing::Test::RecordProperty("excess", std::to_string(found.excess));
  testing::Test::RecordProperty("holes", std::to_string(found.holes));
  testing::Test::RecordProperty("haze", std::to_string(found.haze));
  return found;
}

TEST(RealScreens, EdgesOfTwoPersonsInOnePictureAreCleanAndTheyAreWhole) {
  const std::string path = data_path("greenscreen/skimage_two_persons_500x375.jpg");
  if (path.empty()) GTEST_SKIP() << "needs PLATELIGHT_DATA/greenscreen";
  KeySettings settings;
  settings.core = 0.7F;    // a grey cardigan in the screen's light
  settings.screen = 0.1F;  // coarse noise of a JPEG file
  const EdgeAndCore found = measure_picture(path, settings);
  EXPECT_LE(found.excess, 0.01) << found.holes;
  EXPECT_LE(found.holes, 0.001);
  EXPECT_LE(found.haze, 0.03);
}

// Corners of the wall, paler than its middle, keep a haze with these two: see keying_measured.md.
TEST(RealScreens, EdgesOfAChairBeforeAPaleWallAreCleanAndItIsWhole) {
  const std::string path = data_path("greenscreen/chair_3264x1840.jpg");
  if (path.empty()) GTEST_SKIP() << "needs PLATELIGHT_DATA/greenscreen";
  KeySettings settings;
  settings.core = 0.7F;
  settings.despill = 2;
  const EdgeAndCore found = measure_picture(path, settings);
  EXPECT_LE(found.excess, 0.01) << found.holes;
  EXPECT_LE(found.holes, 0.001);
}

}  // namespace
}  // namespace compositing::real_screens_test
