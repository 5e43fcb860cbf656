// The live set: its cameras, their packets, their exposures, and the light that comes of them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "calibrate/lens.h"
#include "render/made_studio.h"
#include "studio/set.h"

namespace studio {
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
  EXPECT_EQ(set.probe->exposures_s, studio.probe.exposures_s);
}

}  // namespace
}  // namespace studio
