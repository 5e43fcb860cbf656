// The light of a still probe under a plate that changes.
#include "studio/light_feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "calibrate/angles.h"
#include "capture/camera.h"
#include "render/environment.h"

namespace studio::light_feed_test {
namespace {

using testing::HasSubstr;
using testing::Not;

// One even picture.
class StillCamera final : public capture::Camera {
 public:
  explicit StillCamera(float radiance) {
    info_.width = info_.height = 64;
    image_ = std::make_shared<capture::Image>(capture::make_image(64, 64));
    for (float& value : image_->pixels) value = radiance;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (!image_) return std::nullopt;
    capture::Frame frame;
    frame.image = std::move(image_);
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::shared_ptr<capture::Image> image_;
};

// A probe that looks up and sees the upper half, or more.
Set set_of(float radiance, double max_angle_rad = std::numbers::pi / 2) {
  capture::register_camera("still", [radiance](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<StillCamera>(radiance);
  });
  Set set;
  set.probe.emplace();
  set.probe->kind = ProbeSettings::Kind::camera;
  set.probe->source = "still:";
  set.probe->lens = calibrate::Lens{"equisolid", 64, 64, {22, 31.5, 31.5}, max_angle_rad};
  set.probe->match.method = MatchSettings::Method::given;
  return set;
}

// What a camera films of even radiance: down at the floor, or up.
class Plate {
 public:
  explicit Plate(double looks_at_z, double focal_px = 60)
      : directions_(
            calibrate::make_direction_table({"pinhole", 64, 64, {focal_px, focal_px, 31.5, 31.5}})),
        cam_from_set_(calibrate::look_at({0, -4, 1}, {0, 0, looks_at_z}, 0)) {}
  LightRequest request(float radiance) {
    pictures_.push_back(std::make_unique<capture::Image>(capture::make_image(64, 64)));
    for (float& value : pictures_.back()->pixels) value = radiance;
    LightRequest request;
    request.plate = pictures_.back().get();
    request.directions = &directions_;
    request.cam_from_set = cam_from_set_;
    return request;
  }

 private:
  calibrate::DirectionTable directions_;
  calibrate::Pose cam_from_set_;
  std::vector<std::unique_ptr<capture::Image>> pictures_;  // each has an address of its own
};

TEST(LightFeed, FillsTheFloorAsThePresentPlateHasIt) {
  const Set set = set_of(0.1F, std::numbers::pi / 3);
  Plate plate(0);
  LightFeed faded(set);
  EXPECT_EQ(faded.at(plate.request(0)).table.unseen_share, 0);
  const Light late = faded.at(plate.request(0.6F));
  const Light early = LightFeed(set).at(plate.request(0.6F));
  EXPECT_GT(late.table.unseen_share, 0.1);
  EXPECT_EQ(late.table.unseen_share, early.table.unseen_share);
  EXPECT_EQ(late.environment->radiance.pixels, early.environment->radiance.pixels);
}

TEST(LightFeed, KeepsItsEnvironmentUnderAPlateThatHardlyChanges) {
  Plate plate(0);
  LightFeed light(set_of(0.1F));
  const auto first = light.at(plate.request(0.5F)).environment;
  EXPECT_EQ(light.at(plate.request(0.502F)).environment, first);
  EXPECT_NE(light.at(plate.request(0.51F)).environment, first);
}

// Walls, too, that the floor lights: it is in the plate's units, whatever the gain.
TEST(LightFeed, GivesAPatchItsAlbedoWhereverItFaces) {
  for (const float radiance : {0.01F, 1.0F, 100.0F}) {
    for (const calibrate::Vec3 normal : {calibrate::Vec3{0, 0, 1}, {0, -1, 0}, {0, -0.7, 0.7}}) {
      Set set = set_of(radiance);
      MatchSettings& match = set.probe->match;
      match.method = MatchSettings::Method::patch;
      match.patch = {10, 10, 20, 20};
      match.albedo = {0.5F, 0.5F, 0.5F};
      match.normal = normal;
      Plate plate(1);
      LightFeed feed(set);
      const Light light = feed.at(plate.request(0.3F));
      const render::Vec3f n = calibrate::to_float(calibrate::normalize(normal));
      const float needed = calibrate::pi_f * 0.3F / 0.5F;
      EXPECT_NEAR(render::irradiance_of(*light.environment, n).y / needed, 1, 0.002)
          << radiance << ", " << normal.z;
    }
  }
}

TEST(LightFeed, SaysThatTheLastGainIsHeldWhileThePlateIsDark) {
  Set set = set_of(100);
  set.probe->match = {};
  Plate plate(4, 220);  // some pixels to a texel
  LightFeed feed(set);
  EXPECT_THAT(feed.at(plate.request(0)).match.note, HasSubstr("gain left at 1"));
  const Light found = feed.at(plate.request(0.5F));
  EXPECT_NEAR(found.match.gain[1], 0.005, 1e-4);
  const Light dark = feed.at(plate.request(0));
  EXPECT_EQ(dark.match.gain, found.match.gain);
  EXPECT_THAT(dark.match.note, HasSubstr("the last gain is held"));
  EXPECT_THAT(dark.match.note, Not(HasSubstr("left at 1")));
}

}  // namespace
}  // namespace studio::light_feed_test
