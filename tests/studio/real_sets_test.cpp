// The sets of real pictures: what the car does to the plate is where, and as deep, as in the real
// place. Skipped where the data folder is missing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "calibrate/lens.h"
#include "studio/frame_maker.h"
#include "studio/set.h"
#include "studio/start.h"

namespace studio {
namespace {

using calibrate::Vec3;

bool has_data() {
  return std::filesystem::exists(std::string(PLATELIGHT_SOURCE_DIR) +
                                 "/../shared/data/MANIFEST.md");
}

std::string set_path(const std::string& name) {
  return std::string(PLATELIGHT_SOURCE_DIR) + "/studio/sets/" + name;
}

struct Shot {
  Set set;
  PreparedFrame frame;
  render::FrameResult result;

  float value(int y, int x, int c) const {
    return capture::float_from_half(result.rgba.pixels[result.rgba.index(y, x, c)]);
  }
  float plate(int y, int x, int c) const {
    return capture::float_from_half(frame.plate->pixels[frame.plate->index(y, x, c)]);
  }
  // Where a pixel's ray meets the plane z = 0 of the set.
  std::optional<Vec3> on_floor(int y, int x) const {
    const auto v_cam =
        calibrate::unproject(set.camera.lens, {static_cast<double>(x), static_cast<double>(y)});
    if (!v_cam) return std::nullopt;
    const calibrate::Pose set_from_cam = inverse(frame.job.cam_from_set);
    const Vec3 v = set_from_cam.R * *v_cam;
    if (!(v.z < 0)) return std::nullopt;
    return set_from_cam.t + v * (-set_from_cam.t.z / v.z);
  }
};

Shot make_shot(const std::string& name) {
  start();
  Shot shot{read_set(set_path(name)), {}, {}};
  FrameMaker maker(shot.set);
  shot.frame = maker.make(0).value();
  render_frame(shot.frame.inputs(), shot.frame.job, *shot.frame.plate, shot.result);
  return shot;
}

TEST(DeskCar, CastsItsShadowAwayFromTheRealWindow) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  const Shot shot = make_shot("desk_car.toml");
  const Vec3 car = shot.set.objects.at(0).pose.position;
  double weight = 0, x_sum = 0, y_sum = 0;
  float deepest = 1;
  int covered = 0, left = 10000, right = 0, top = 10000, bottom = 0;
  for (int y = 0; y < shot.result.rgba.height; ++y) {
    for (int x = 0; x < shot.result.rgba.width; ++x) {
      if (shot.value(y, x, 3) > 0) {
        ++covered;
        left = std::min(left, x), right = std::max(right, x);
        top = std::min(top, y), bottom = std::max(bottom, y);
        continue;
      }
      const float ratio = shot.value(y, x, 1) / std::max(1e-4F, shot.plate(y, x, 1));
      const auto p = shot.on_floor(y, x);
      if (!p || ratio > 0.98F) continue;
      deepest = std::min(deepest, ratio);
      // Weighted by the area of desk that the pixel shows, so that the far side counts in full.
      const auto q = shot.on_floor(y, x + 1), r = shot.on_floor(y + 1, x);
      if (!q || !r) continue;
      const double area = length(cross(*q - *p, *r - *p));
      weight += (1 - ratio) * area;
      x_sum += (1 - ratio) * area * (p->x - car.x);
      y_sum += (1 - ratio) * area * (p->y - car.y);
    }
  }
  EXPECT_GT(covered, 5000);
  // The place that was measured for it: pixels (1171..1331, 1431..1597) of the whole picture.
  EXPECT_NEAR(left + 900, 1171, 12);
  EXPECT_NEAR(right + 900, 1331, 12);
  EXPECT_NEAR(top + 1170, 1431, 20);
  EXPECT_NEAR(bottom + 1170, 1597, 20);
  ASSERT_GT(weight, 0);
  double azimuth = std::atan2(x_sum, y_sum) * 180 / std::numbers::pi;  // clockwise from ahead
  if (azimuth < 0) azimuth += 360;
  EXPECT_NEAR(azimuth, 249, 15) << "the window is to the right and ahead";
  // Under the sills hardly any light arrives.
  EXPECT_GT(deepest, 0.02F);
  EXPECT_LT(deepest, 0.60F);
  RecordProperty("azimuth", std::to_string(azimuth));
  RecordProperty("deepest", std::to_string(deepest));
}

// The sheet's albedo as the set's light implies it, against its colour: bluish white.
TEST(DeskCar, FindsPaperBrighterThanWood) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  const Shot shot = make_shot("desk_car.toml");
  Vec3 irradiance;
  for (const render::DirectionalLight& light : shot.frame.job.lights.lights) {
    if (light.direction.z > 0) {
      irradiance += calibrate::to_double(light.irradiance) * static_cast<double>(light.direction.z);
    }
  }
  const auto albedo_at = [&](int left, int top, int c) {
    double sum = 0;
    for (int y = top; y < top + 20; ++y) {
      for (int x = left; x < left + 20; ++x) sum += shot.plate(y, x, c);
    }
    const double e = c == 0 ? irradiance.x : c == 1 ? irradiance.y : irradiance.z;
    return std::numbers::pi * sum / (20 * 20) / e;
  };
  for (int c = 0; c < 3; ++c) {
    const double paper = albedo_at(520, 324, c), wood = albedo_at(400, 540, c);
    EXPECT_GT(paper, 0.45) << "channel " << c;
    EXPECT_LT(paper, 0.95) << "channel " << c;
    EXPECT_LT(wood, 0.8 * paper) << "channel " << c;
    RecordProperty("paper_" + std::to_string(c), std::to_string(paper));
  }
}

TEST(RealCar, StandsAtItsRealSizeOnTheFreeSpot) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  const Shot shot = make_shot("real_car.toml");
  double x_sum = 0, y_sum = 0;
  int covered = 0, shadowed = 0;
  for (int y = 0; y < shot.result.rgba.height; ++y) {
    for (int x = 0; x < shot.result.rgba.width; ++x) {
      if (shot.value(y, x, 3) > 0.5F) {
        ++covered;
        x_sum += x;
        y_sum += y;
      } else if (shot.value(y, x, 1) < 0.9F * shot.plate(y, x, 1)) {
        ++shadowed;
      }
    }
  }
  EXPECT_NEAR(x_sum / covered, 80, 25);
  EXPECT_NEAR(y_sum / covered, 210, 30);
  // 4.2 m at 35 m through a lens of 1190 px: some 140 px long, 60 px high.
  EXPECT_GT(covered, 3000);
  EXPECT_LT(covered, 10000);
  EXPECT_GT(shadowed, 300) << "it stands on the road, not above it";
}

}  // namespace
}  // namespace studio
