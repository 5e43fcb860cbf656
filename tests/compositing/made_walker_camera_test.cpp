// The made walker as a source of frames.
#include "compositing/made_walker_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "capture/camera.h"

namespace compositing::made_walker_camera_test {
namespace {

std::unique_ptr<capture::Camera> open(const std::string& uri, std::int64_t frame = 0) {
  static const bool registered = (register_made_walkers(), true);
  EXPECT_TRUE(registered);
  capture::CameraOptions options;
  options.colour.transfer = capture::Transfer::srgb;
  options.frame = frame;
  return capture::open_camera("made_walker:" + uri, options);
}

TEST(MadeWalkerCamera, ShowsNobodyAndThenTheWalkerWhereItIs) {
  const auto camera = open("round=60&width=64&height=80&frames=12");
  const calibrate::Pose pose = walker_camera_pose(60);
  const calibrate::Lens lens = walker_camera_lens(64, 80);
  EXPECT_EQ(camera->info().width, 64);
  for (int n = 0; n < 12; ++n) {
    const auto frame = camera->next();
    ASSERT_TRUE(frame) << n;
    EXPECT_EQ(frame->time, capture::time_of_frame(n, {25, 1}));
    const auto truth = photograph_of(lens, pose, filmed_walker(), walk_time_s(n), 3);
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 64; ++x) {
        const bool person = n >= frames_of_nobody && truth.at(y, x, 3) > 0.99F;
        const bool nobody = n < frames_of_nobody || truth.at(y, x, 3) == 0;
        const bool green = frame->image->at(y, x, 1) > 3 * frame->image->at(y, x, 0) &&
                           frame->image->at(y, x, 1) > 0.3F;
        if (nobody) {
          EXPECT_TRUE(green) << n << " " << x << " " << y;
        } else if (person) {
          EXPECT_NEAR(frame->image->at(y, x, 0), truth.at(y, x, 0), 0.06) << n << " " << x;
        }
      }
    }
  }
  EXPECT_FALSE(camera->next());
}

TEST(MadeWalkerCamera, GivesTheSameFrameHoweverItIsAskedFor) {
  const auto camera = open("width=32&height=40");
  for (int n = 0; n < 9; ++n) static_cast<void>(camera->next());
  EXPECT_EQ(camera->next()->image->pixels, open("width=32&height=40", 9)->next()->image->pixels);
}

TEST(MadeWalkerCamera, RefusesWhatItDoesNotKnow) {
  for (const char* uri : {"round", "round=", "round=x", "round=361", "width=15", "height=5000",
                          "frames=-1", "detail=0", "speed=3", "=", "&", "round=60&&width=64"}) {
    EXPECT_THROW(open(uri), std::runtime_error) << uri;
  }
}

}  // namespace
}  // namespace compositing::made_walker_camera_test
