// Cameras that were pushed since their plate was taken.
#include "compositing/plate_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "compositing/keyer.h"
#include "compositing/made_clip.h"
#include "compositing/made_video_camera.h"

namespace compositing::plate_watch_test {
namespace {

using capture::Image;

constexpr int height = 270, width = 480;

// A cloth with folds in a room of boxes, as bright at a place of it.
std::array<float, 3> room_at(float u, float v) {
  if (u >= 70 && u < 410 && v >= 20 && v < 255) {
    const float fold = 1 + 0.05F * std::sin(0.07F * u + 0.02F * v);
    return {0.04F * fold, 0.4F * fold, 0.06F * fold};
  }
  const float box =
      0.3F + 0.25F * std::sin(std::floor(u / 37) * 5) * std::cos(std::floor(v / 29) * 3);
  return {box, box, box};
}

// Of a camera that was pushed, turned clockwise and zoomed, about the middle of its picture.
struct Pushed {
  float right = 0, down = 0, roll_deg = 0, scale = 1;
};

// Through a camera that is pushed so that the picture moves to the right and down.
Image room(const Pushed& pushed, float light = 1) {
  const float roll = pushed.roll_deg * std::numbers::pi_v<float> / 180;
  const float along = std::cos(roll) / pushed.scale, aside = std::sin(roll) / pushed.scale;
  constexpr int finer = 4;  // samples of a pixel along each side
  Image image;
  image.height = height, image.width = width, image.channels = 3;
  image.pixels.resize(std::size_t{3} * height * width);
  for (int y = 0; y < finer * height; ++y) {
    for (int x = 0; x < finer * width; ++x) {
      const auto place = [](int at) { return (static_cast<float>(at) + 0.5F) / finer; };
      const float u = place(x) - 0.5F * width - pushed.right;
      const float v = place(y) - 0.5F * height - pushed.down;
      const auto colour =
          room_at(0.5F * width + along * u + aside * v, 0.5F * height + along * v - aside * u);
      for (int c = 0; c < 3; ++c) {
        image.at(y / finer, x / finer, c) +=
            light / (finer * finer) * colour[static_cast<std::size_t>(c)];
      }
    }
  }
  return image;
}

Image room(float right, float down, float light = 1) {
  return room(Pushed{right, down, 0, 1}, light);
}

Image filmed(const Image& light, std::uint64_t seed) {
  const MadeSensor sensor{1e-4F, 1e-6F, false};
  return light_of({light.height, light.width, photograph_light(light, sensor, seed)});
}

const CleanPlate& plate_of_room() {
  static const CleanPlate plate = [] {
    std::vector<Image> shots;
    for (std::uint64_t i = 0; i < 4; ++i) shots.push_back(filmed(room(0, 0), i));
    return average_plate(shots);
  }();
  return plate;
}

void put_person(Image& image, float x0) {
  for (int y = 60; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (std::abs(static_cast<float>(x) - x0) > 55) continue;
      for (int c = 0; c < 3; ++c)
        image.at(y, x, c) = 0.2F + 0.1F * std::sin(0.3F * static_cast<float>(x + y * c));
    }
  }
}

PlateShift look(PlateWatch& watch, const Image& frame) {
  return watch.look(LightRows(frame, channels_of(ScreenColour::green)));
}

TEST(PlateWatch, MeasuresPushesToAQuarterOfAPixelBehindAPersonAndUnderOtherLight) {
  PlateWatch watch(plate_of_room());
  std::uint64_t seed = 100;
  for (const float light : {1.0F, 0.7F, 1.2F}) {
    for (const auto& [right, down] : std::vector<std::pair<float, float>>{{0, 0},
                                                                          {0.5F, 0},
                                                                          {-1.25F, 0.75F},
                                                                          {2, -3},
                                                                          {-4, 4},
                                                                          {5, 1},
                                                                          {5, 5},
                                                                          {-5, -5},
                                                                          {-5, 0},
                                                                          {0, -5}}) {
      Image light_there = room(right, down, light);
      put_person(light_there, 200 + 40 * light);
      const PlateShift shift = look(watch, filmed(light_there, ++seed));
      ASSERT_TRUE(shift.known) << right << ' ' << down << ": " << shift.seen << " of "
                               << shift.patches;
      EXPECT_NEAR(shift.right_px, right, 0.25) << down << " under " << light;
      EXPECT_NEAR(shift.down_px, down, 0.25) << right << " under " << light;
    }
  }
}

// Who knocks a tripod over does not do so by five pixels.
TEST(PlateWatch, MeasuresPushesOfUpToAFifthOfThePicture) {
  PlateWatch watch(plate_of_room());
  std::uint64_t seed = 900;
  for (const auto& [right, down] : std::vector<std::pair<float, float>>{{7, 7},
                                                                        {-7, -7},
                                                                        {8.5F, -8},
                                                                        {-14, 10},
                                                                        {20, 20},
                                                                        {-33.5F, 12},
                                                                        {60, -30},
                                                                        {-90, 5},
                                                                        {0, 0}}) {
    Image light_there = room(right, down, 0.8F);
    put_person(light_there, 250);
    const PlateShift shift = look(watch, filmed(light_there, ++seed));
    ASSERT_TRUE(shift.known) << right << ' ' << down << ": " << shift.seen << " of "
                             << shift.patches;
    EXPECT_NEAR(shift.right_px, right, 0.3) << down;
    EXPECT_NEAR(shift.down_px, down, 0.3) << right;
  }
}

// A tripod's leg that gives way turns the picture too, and a ring that is touched zooms.
TEST(PlateWatch, MeasuresTurnsAndZoomsToo) {
  std::uint64_t seed = 1500;
  for (const Pushed& pushed : std::vector<Pushed>{{8, 3, 0.5F, 1},
                                                  {3, 0, -1, 1},
                                                  {0, 0, 2, 1},
                                                  {0, 0, -4, 1},
                                                  {20, 10, 3, 1},
                                                  {0, 0, 0, 1.02F},
                                                  {0, 0, 0, 0.97F},
                                                  {4, -3, 1, 1.06F},
                                                  {0, 0, 0, 1.1F},
                                                  {0, 0, 0, 0.9F}}) {
    PlateWatch watch(plate_of_room());
    Image light = room(pushed, 0.9F);
    put_person(light, 250);
    const PlateShift shift = look(watch, filmed(light, ++seed));
    ASSERT_TRUE(shift.known) << pushed.right << ' ' << pushed.roll_deg << ' ' << pushed.scale
                             << ": " << shift.agree << ", " << shift.seen << " of "
                             << shift.patches;
    EXPECT_NEAR(shift.right_px, pushed.right, 0.4) << pushed.roll_deg << ' ' << pushed.scale;
    EXPECT_NEAR(shift.down_px, pushed.down, 0.4) << pushed.roll_deg << ' ' << pushed.scale;
    EXPECT_NEAR(shift.roll_rad * 180 / std::numbers::pi, pushed.roll_deg, 0.1) << pushed.scale;
    EXPECT_NEAR(shift.scale, pushed.scale, 0.002) << pushed.roll_deg;
    EXPECT_GT(shift.farthest_px, 2);
  }
}

// A camera that has turned by itself shows in the corners.
TEST(PlateWatch, MakesTheKeySayThatTheCameraWasTurnedOrZoomed) {
  for (const Pushed& pushed : std::vector<Pushed>{{0, 0, 1, 1}, {0, 0, 0, 1.02F}}) {
    Keyer keyer(plate_of_room(), {});
    capture::HalfImage keyed;
    std::uint64_t seed = 1700;
    KeyReport report;
    for (int i = 0; i < 8; ++i) report = keyer.key(filmed(room(0, 0), ++seed), keyed);
    EXPECT_FALSE(report.moved);
    const Image there = room(pushed);
    for (int i = 0; i < 9; ++i) report = keyer.key(filmed(there, ++seed), keyed);
    EXPECT_EQ(report.status, KeyStatus::moved) << pushed.roll_deg;
    EXPECT_LT(report.confidence, 0.6) << pushed.roll_deg;
    EXPECT_EQ(is_of_another_lens(report.shift), pushed.scale != 1);
  }
}

// Folds that repeat themselves fit also one fold further.
TEST(PlateWatch, TakesFoldsThatRepeatForNoNearerPush) {
  const auto cloth = [](float right) {
    Image image = room(right, 0);
    for (int y = 20; y < 255; ++y) {
      for (int x = 0; x < width; ++x) {
        const float u = static_cast<float>(x) - right;
        if (u < 70 || u >= 410) continue;
        const float fold =
            1 + 0.05F * std::sin(0.5F * u + 3 * std::sin(0.04F * static_cast<float>(y)));
        for (int c = 0; c < 3; ++c) image.at(y, x, c) = (c == 1 ? 0.4F : 0.05F) * fold;
      }
    }
    return image;
  };
  std::vector<Image> shots;
  for (std::uint64_t i = 0; i < 4; ++i) shots.push_back(filmed(cloth(0), i));
  for (const float push : {-30.0F, 13.0F, 25.0F, 30.0F}) {
    PlateWatch watch(average_plate(shots));
    const PlateShift shift = look(watch, filmed(cloth(push), 77));
    ASSERT_TRUE(shift.known) << push;
    EXPECT_NEAR(shift.right_px, push, 0.3);
  }
}

// A room that was set up anew, each part of it by itself.
TEST(PlateWatch, SaysThatMuchIsElsewhereWhereNoCameraMoved) {
  Image image = room(0, 0);
  for (int part = 0; part < 15; ++part) {
    const auto angle = 2.4F * static_cast<float>(part);
    const Image moved = room(7 * std::sin(angle), 7 * std::cos(angle));
    for (int y = part / 5 * 90; y < (part / 5 + 1) * 90; ++y) {
      for (int x = part % 5 * 96; x < (part % 5 + 1) * 96; ++x) {
        for (int c = 0; c < 3; ++c) image.at(y, x, c) = moved.at(y, x, c);
      }
    }
  }
  PlateWatch watch(plate_of_room());
  const PlateShift shift = look(watch, filmed(image, 5));
  EXPECT_FALSE(shift.known) << shift.right_px << ' ' << shift.agree << " of " << shift.seen;
  EXPECT_TRUE(shift.scattered) << shift.seen << " of " << shift.patches;
  Keyer keyer(plate_of_room(), {});
  capture::HalfImage keyed;
  KeyReport report;
  for (std::uint64_t i = 0; i < 5; ++i) report = keyer.key(filmed(image, i), keyed);
  EXPECT_TRUE(report.scattered);
  EXPECT_TRUE(is_unsure(report.confidence));
}

TEST(PlateWatch, FindsNothingScatteredOrTurnedWhereNothingMoved) {
  for (const MadeScene& scene : made_scenes()) {
    if (scene.shift_px != 0) continue;
    const MadeClip clip(scene, 1, height, width);
    std::vector<Image> shots;
    for (int i = 0; i < 2; ++i) shots.push_back(light_of(clip.plate_shot(i)));
    PlateWatch watch(average_plate(shots));
    for (const int i : {0, 12, 25}) {
      const PlateShift shift = look(watch, light_of(clip.frame(i).seen));
      EXPECT_FALSE(shift.scattered) << scene.name;
      EXPECT_FALSE(shift.is_turned()) << scene.name;
      EXPECT_TRUE(!shift.known || shift.farthest_px < 1) << scene.name;
    }
  }
}

// As before a screen with folds, whose coarse picture tells little.
TEST(PlateWatch, MeasuresPushesOfAnySizeBeforeAScreenWithFolds) {
  for (const int push : {1, 4, 6, 7, 8, 9, 10, 12, 16}) {
    MadeScene scene = made_scene("plain");
    scene.shift_px = push;
    scene.uneven = 0.5F;
    scene.wrinkles = 0.4F;
    const MadeClip clip(scene, 1, height, width);
    std::vector<Image> shots;
    for (int i = 0; i < 4; ++i) shots.push_back(light_of(clip.plate_shot(i)));
    PlateWatch watch(average_plate(shots));
    const PlateShift shift = look(watch, light_of(clip.frame(3).seen));
    ASSERT_TRUE(shift.known) << push;
    EXPECT_NEAR(shift.right_px, push, 0.5);
    EXPECT_NEAR(shift.down_px, 0, 0.5);
  }
}

TEST(PlateWatch, SaysThatItCannotTellBeforeABareScreenAndBehindACrowd) {
  const MadeClip even(made_scene("plain"), 5, height, width);
  std::vector<Image> shots;
  for (int i = 0; i < 4; ++i) shots.push_back(light_of(even.plate_shot(i)));
  PlateWatch bare(average_plate(shots));
  EXPECT_FALSE(look(bare, light_of(even.frame(3).seen)).known);
  PlateWatch watch(plate_of_room());
  Image crowd = room(0, 0);
  for (const float x : {30.0F, 130.0F, 240.0F, 350.0F, 450.0F}) put_person(crowd, x);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < width; ++x)
      crowd.at(y, x, 0) = static_cast<float>((x * 7 + y * 13) % 19) / 19;
  }
  EXPECT_FALSE(look(watch, filmed(crowd, 3)).known);
  Image none = room(0, 0);
  std::fill(none.pixels.begin(), none.pixels.end(), std::nanf(""));
  EXPECT_FALSE(look(watch, none).known);
}

TEST(PlateWatch, TakesNoWavingCurtainForAPush) {
  PlateWatch watch(plate_of_room());
  for (int i = 0; i < 8; ++i) {
    Image light = room(0, 0);
    const Image waved = room(3 * std::sin(static_cast<float>(i)), 0);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < 70; ++x) {
        for (int c = 0; c < 3; ++c) light.at(y, x, c) = waved.at(y, x, c);
      }
    }
    const PlateShift shift = look(watch, filmed(light, static_cast<std::uint64_t>(i)));
    EXPECT_TRUE(!shift.known || shift.size_px() < 0.5F) << shift.right_px;
  }
}

TEST(PlateWatch, MakesTheKeySayThatTheCameraWasMovedWithinTenFramesAndTakeItBack) {
  Keyer keyer(plate_of_room(), {});
  capture::HalfImage keyed;
  std::uint64_t seed = 500;
  const auto run = [&](float right, float down, int frames) {
    KeyReport report;
    const Image empty = room(right, down);
    for (int i = 0; i < frames; ++i) {
      Image light = empty;
      put_person(light, 180 + static_cast<float>(i));
      report = keyer.key(filmed(light, ++seed), keyed);
    }
    return report;
  };
  EXPECT_NE(run(0, 0, 20).status, KeyStatus::moved);
  const KeyReport pushed = run(3, 1, 10);
  EXPECT_EQ(pushed.status, KeyStatus::moved);
  EXPECT_LT(pushed.confidence, 0.75);
  EXPECT_NEAR(pushed.shift.right_px, 3, 0.3);
  EXPECT_GE(pushed.moved_for, 7);  // every fourth frame is looked at
  EXPECT_LE(pushed.moved_for, 10);
  // A shake of one frame is none.
  EXPECT_NE(run(0, 0, 10).status, KeyStatus::moved);
  const KeyReport back = run(-5, -5, 10);
  EXPECT_EQ(back.status, KeyStatus::moved);
  EXPECT_NEAR(back.shift.down_px, -5, 0.3);
  EXPECT_NE(run(0, 0, 10).status, KeyStatus::moved);
  run(4, 0, 1);
  EXPECT_NE(run(0, 0, 8).status, KeyStatus::moved);
}

// A crowd that hides what is followed does not put the camera back.
TEST(PlateWatch, MakesTheKeyNoSurerOfAMovedCameraWhenACrowdHidesIt) {
  Keyer keyer(plate_of_room(), {});
  capture::HalfImage keyed;
  std::uint64_t seed = 700;
  const Image pushed = room(4, 2);
  KeyReport seen;
  for (int i = 0; i < 10; ++i) seen = keyer.key(filmed(pushed, ++seed), keyed);
  ASSERT_TRUE(seen.moved);
  Image crowd = pushed;
  for (const float x : {30.0F, 130.0F, 350.0F, 450.0F}) put_person(crowd, x);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < width; ++x)
      crowd.at(y, x, 0) = static_cast<float>((x * 7 + y * 13) % 19) / 19;
  }
  KeyReport hidden;
  for (int i = 0; i < 4; ++i) hidden = keyer.key(filmed(crowd, ++seed), keyed);
  EXPECT_TRUE(hidden.moved);
  EXPECT_LE(hidden.confidence, seen.confidence + 1e-3F) << name_of(hidden.status);
  EXPECT_NEAR(hidden.shift.right_px, 4, 0.3);
}

}  // namespace
}  // namespace compositing::plate_watch_test
