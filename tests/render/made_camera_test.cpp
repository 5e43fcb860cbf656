// made: cameras give the studio's pictures, each always the same.
#include "render/made_camera.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "capture/camera.h"

namespace render::made_camera_test {
namespace {

std::unique_ptr<capture::Camera> open(const std::string& rest,
                                      const capture::CameraOptions& options = {}) {
  static const bool registered = (register_made_cameras(), true);
  EXPECT_TRUE(registered);
  return capture::open_camera("made:" + rest, options);
}

double mean_of(const capture::Image& image) {
  double sum = 0;
  for (const float value : image.pixels) sum += value;
  return sum / static_cast<double>(image.pixels.size());
}

TEST(MadeCamera, GivesAsManyFramesAsAskedAtItsRate) {
  const auto camera = open("plate?width=64&height=48&frames=3&samples=1");
  EXPECT_EQ(camera->info().width, 64);
  EXPECT_EQ(camera->info().rate, (capture::Rational{25, 1}));
  for (int n = 0; n < 3; ++n) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, n);
    EXPECT_EQ(frame->time, capture::time_of_frame(n, {25, 1}));
    EXPECT_GT(mean_of(*frame->image), 0.05);
  }
  EXPECT_FALSE(camera->next());
}

TEST(MadeCamera, GivesTheSameFrameFromWhereverItStarts) {
  const auto first = open("plate?width=64&height=48&samples=1");
  first->next();
  first->next();
  const auto second = first->next();
  capture::CameraOptions options;
  options.frame = 2;
  const auto again = open("plate?width=64&height=48&samples=1", options)->next();
  ASSERT_TRUE(second && again);
  EXPECT_EQ(second->image->pixels, again->image->pixels);
  EXPECT_EQ(second->time, again->time);
}

TEST(MadeCamera, TurnsThroughTheProbesExposures) {
  capture::CameraOptions options;
  options.colour.transfer = capture::Transfer::srgb;
  const auto camera = open("probe?size=64&samples=1&frames=6", options);
  double before_s = 1;
  for (int n = 0; n < 6; ++n) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame);
    if (n % 3 > 0) {
      EXPECT_LT(frame->exposure_s, before_s);
    }
    before_s = frame->exposure_s;
  }
}

TEST(MadeCamera, CutsOutWhatIsAsked) {
  const auto whole = open("plate?width=64&height=48&samples=1")->next();
  capture::CameraOptions options;
  options.crop = {10, 20, 30, 8};
  const auto part = open("plate?width=64&height=48&samples=1", options)->next();
  ASSERT_TRUE(whole && part);
  ASSERT_EQ(part->image->width, 30);
  ASSERT_EQ(part->image->height, 8);
  EXPECT_EQ(part->image->at(3, 5, 1), whole->image->at(23, 15, 1));
}

TEST(MadeCamera, RefusesWhatItIsNot) {
  for (const std::string rest :
       {"", "window", "plate?colour=red", "plate?width=3", "plate?width=abc", "plate?width"}) {
    EXPECT_THROW(open(rest), std::runtime_error) << rest;
  }
  capture::CameraOptions options;
  options.crop = {60, 0, 10, 10};
  EXPECT_THROW(open("plate?width=64&height=48&samples=1", options), std::runtime_error);
}

}  // namespace
}  // namespace render::made_camera_test
