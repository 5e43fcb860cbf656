// The sets of real pictures: what the car does to the plate is where, and as deep, as in the real
// place. Skipped where the data folder is missing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibrate/lens.h"
#include "studio/frame_maker.h"
#include "studio/set.h"
#include "studio/start.h"

namespace studio::real_sets_test {
namespace {

using calibrate::Vec3;

bool has_data() {
  return std::filesystem::exists(PLATELIGHT_SOURCE_DIR "/../shared/data/MANIFEST.md");
}

std::string set_path(const std::string& name) {
  return PLATELIGHT_SOURCE_DIR "/studio/sets/" + name;
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

Shot make_shot(Set set) {
  Shot shot{std::move(set), {}, {}};
  FrameMaker maker(shot.set);
  shot.frame = maker.make(0).value();
  render_frame(shot.frame.inputs(), shot.frame.job, *shot.frame.plate, shot.result);
  return shot;
}

Set read(const std::string& name) {
  start();
  return read_set(set_path(name));
}

// What the difference of the pictures with and without the car shows at a pixel of the desk.
struct DeskPoint {
  Vec3 p;          // on the desk
  double area_m2;  // that the pixel shows
  double ratio;    // with / without
};

// Of all pixels that show desk and not the car. Blacker desk tells no ratio.
std::vector<DeskPoint> desk_points(const Shot& with, const Shot& without) {
  constexpr float darkest = 0.005F;
  std::vector<DeskPoint> points;
  for (int y = 0; y < with.result.rgba.height; ++y) {
    for (int x = 0; x < with.result.rgba.width; ++x) {
      if (with.value(y, x, 3) > 0 || without.value(y, x, 1) < darkest) continue;
      const auto p = with.on_floor(y, x);
      const auto q = with.on_floor(y, x + 1), r = with.on_floor(y + 1, x);
      if (!p || !q || !r) continue;
      const double ratio = static_cast<double>(with.value(y, x, 1) / without.value(y, x, 1));
      points.push_back({*p, length(cross(*q - *p, *r - *p)), ratio});
    }
  }
  return points;
}

// The car's box, x across, y along, z up, metres: 38.38 x 18.71 x 11.62 mm at scale 3.
constexpr Vec3 car_box{0.05613, 0.11514, 0.03486};

Vec3 from_car(const PlacementSettings& pose, Vec3 p) {
  const double c = std::cos(pose.yaw_rad), s = std::sin(pose.yaw_rad);
  return {pose.position.x + c * p.x - s * p.y, pose.position.y + s * p.x + c * p.y, p.z};
}

bool under_car(const PlacementSettings& pose, Vec3 p) {
  const double c = std::cos(pose.yaw_rad), s = std::sin(pose.yaw_rad);
  const double dx = p.x - pose.position.x, dy = p.y - pose.position.y;
  return std::abs(c * dx + s * dy) < car_box.x / 2 && std::abs(c * dy - s * dx) < car_box.y / 2;
}

// The deepest that a spot of a diameter finds on the desk beside the car, by area.
double deepest_spot(const std::vector<DeskPoint>& points,
                    const PlacementSettings& pose,
                    double diameter_m) {
  std::vector<DeskPoint> near;
  constexpr double reach_m = 0.15;
  for (const DeskPoint& point : points) {
    if (length(point.p - pose.position) < reach_m && !under_car(pose, point.p)) {
      near.push_back(point);
    }
  }
  constexpr double whole = 0.9;  // of the spot must be seen
  const double radius_m = diameter_m / 2;
  const double spot_m2 = std::numbers::pi * radius_m * radius_m;
  double deepest = 1;
  for (const DeskPoint& middle : near) {
    if (middle.ratio > 0.5) continue;
    double area = 0, sum = 0;
    for (const DeskPoint& point : near) {
      const double dx = point.p.x - middle.p.x, dy = point.p.y - middle.p.y;
      if (std::abs(dx) > radius_m || dx * dx + dy * dy > radius_m * radius_m) continue;
      area += point.area_m2;
      sum += point.area_m2 * point.ratio;
    }
    if (area > whole * spot_m2) deepest = std::min(deepest, sum / area);
  }
  return deepest;
}

TEST(DeskCar, StandsWhereTheFreeWoodWasMeasured) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  Set set = read("desk_car.toml");
  set.effort.light_samples = 16;  // no matter where it stands
  const Shot shot = make_shot(std::move(set));
  const auto& crop = shot.set.camera.crop.value();
  const PlacementSettings& pose = shot.set.objects.at(0).pose;
  double left = 1e4, right = 0, top = 1e4, bottom = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p{((corner & 1) - 0.5) * car_box.x, ((corner >> 1 & 1) - 0.5) * car_box.y,
                 (corner >> 2) * car_box.z};
    const auto q =
        calibrate::project(shot.set.camera.lens, shot.frame.job.cam_from_set * from_car(pose, p));
    ASSERT_TRUE(q);
    left = std::min(left, q->x + crop[0]), right = std::max(right, q->x + crop[0]);
    top = std::min(top, q->y + crop[1]), bottom = std::max(bottom, q->y + crop[1]);
  }
  EXPECT_NEAR(left, 1171, 1);
  EXPECT_NEAR(right, 1331, 1);
  EXPECT_NEAR(top, 1431, 1);
  EXPECT_NEAR(bottom, 1597, 1);
  int covered = 0;
  for (int y = 0; y < shot.result.rgba.height; ++y) {
    for (int x = 0; x < shot.result.rgba.width; ++x) {
      if (!(shot.value(y, x, 3) > 0)) continue;
      ++covered;
      EXPECT_TRUE(x + crop[0] > left - 1 && x + crop[0] < right + 1 && y + crop[1] > top - 1 &&
                  y + crop[1] < bottom + 1)
          << x << ", " << y << " is outside the car's box";
    }
  }
  EXPECT_GT(covered, 0.4 * (right - left) * (bottom - top));
}

// From the pictures with and without the car.
TEST(DeskCar, CastsItsShadowAwayFromTheRealWindow) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  const Shot with = make_shot(read("desk_car.toml"));
  Set empty = with.set;
  empty.objects.clear();
  const Shot without = make_shot(empty);
  const PlacementSettings& pose = with.set.objects.at(0).pose;
  const std::vector<DeskPoint> points = desk_points(with, without);
  double weight = 0, x_sum = 0, y_sum = 0;
  double contact = 1;
  for (const DeskPoint& point : points) {
    if (under_car(pose, point.p)) contact = std::min(contact, point.ratio);
    if (point.ratio > 0.98) continue;
    const double lost = (1 - point.ratio) * point.area_m2;  // the far side counts in full
    weight += lost;
    x_sum += lost * (point.p.x - pose.position.x);
    y_sum += lost * (point.p.y - pose.position.y);
  }
  ASSERT_GT(weight, 0);
  double azimuth = std::atan2(x_sum, y_sum) * 180 / std::numbers::pi;  // clockwise from ahead
  if (azimuth < 0) azimuth += 360;
  EXPECT_NEAR(azimuth, 249, 15) << "the window is to the right and ahead";
  // Of the shadow that is cast on the desk beside the car, as a spot of 5 mm takes it: under the
  // bumpers, where the car itself covers the desk, hardly any light arrives.
  const double deepest = deepest_spot(points, pose, 0.005);
  EXPECT_GE(deepest, 0.25);
  EXPECT_LE(deepest, 0.60);
  EXPECT_LT(contact, deepest);
  EXPECT_GT(contact, 0);
  RecordProperty("azimuth", std::to_string(azimuth));
  RecordProperty("deepest", std::to_string(deepest));
  RecordProperty("contact", std::to_string(contact));
}

// Plate and probe are one camera, and a white sheet is white: so the light is of the right
// strength.
TEST(DeskCar, FindsTheSheetWhiteAtGainOne) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  const Set set = read("desk_car.toml");
  FrameMaker maker(set);
  const render::MatchResult match = maker.make(0).value().match;
  constexpr std::size_t shot_of_plate = 4;  // of the probe's nine
  for (std::size_t c = 0; c < 3; ++c) {
    const double gain = match.gain[c] / set.probe->exposures_s.at(shot_of_plate);
    EXPECT_NEAR(gain, 1, 0.03) << "channel " << c;
    // At the found gain, and at gain 1 itself.
    for (const double albedo : {1.0 * match.implied_albedo[c], gain * match.implied_albedo[c]}) {
      EXPECT_GE(albedo, 0.60) << "channel " << c;
      EXPECT_LE(albedo, 0.95) << "channel " << c;
    }
    RecordProperty("sheet_" + std::to_string(c), std::to_string(match.implied_albedo[c]));
  }
}

TEST(RealCar, StandsAtItsRealSizeOnTheFreeSpot) {
  if (!has_data()) GTEST_SKIP() << "no data folder: " << PLATELIGHT_SOURCE_DIR << "/../shared/data";
  const Shot shot = make_shot(read("real_car.toml"));
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
}  // namespace studio::real_sets_test
