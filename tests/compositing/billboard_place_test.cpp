// Billboards: upright, on the floor, turned to the viewer, and as large as the person.
#include "compositing/billboard_place.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <vector>

#include "compositing/feet.h"
#include "compositing/made_walker.h"

namespace compositing::billboard_place_test {
namespace {

Vec3 at(const BillboardPlace& place, double x, double z) {
  const auto& m = place.set_from_object;
  return {m[0] * x + m[2] * z + m[3], m[4] * x + m[6] * z + m[7], m[8] * x + m[10] * z + m[11]};
}
Vec3 front(const BillboardPlace& place) {
  const auto& m = place.set_from_object;
  return {-m[1], -m[5], -m[9]};
}

constexpr std::array<float, 4> box{560, 150, 700, 520};
const Vec3 standing{0.2, 5, 0};

TEST(PlaceBillboard, StandsUprightOnTheFloorThroughTheFeet) {
  for (const auto& lens : {pinhole_lens(), bent_lens()}) {
    const MadeView view = made_view(lens);
    for (const double side : {-3.0, -1.0, 0.0, 2.0, 6.0}) {
      const auto place =
          place_billboard(lens, view.cam_from_set, standing, box, {side, -1, 1.7}, 0.5);
      ASSERT_TRUE(place);
      const Vec3 n = front(*place), low = at(*place, -0.5, 0), up = at(*place, -0.5, 1) - low;
      EXPECT_NEAR(length(n), 1, 1e-6);
      EXPECT_EQ(n.z, 0);
      EXPECT_NEAR(dot(standing - low, n), 0, 1e-5);
      EXPECT_GE(low.z, 0);
      EXPECT_NEAR(up.x, 0, 1e-6);
      EXPECT_NEAR(up.y, 0, 1e-6);
      EXPECT_GT(dot(n, view.camera() - standing), 0);
      // Right, as seen from the front, is right in the object.
      EXPECT_GT(dot(cross(at(*place, 0.5, 0) - low, up), n), 0);
    }
  }
}

TEST(PlaceBillboard, IsJustAsLargeAsTheBoxThatFallsOnIt) {
  for (const auto& lens : {pinhole_lens(), bent_lens()}) {
    const MadeView view = made_view(lens);
    const auto place = place_billboard(lens, view.cam_from_set, standing, box, view.camera(), 0.5);
    ASSERT_TRUE(place);
    double left = 1e9, right = -1e9, top = 1e9;
    for (int i = 0; i <= 40; ++i) {
      const double s = i / 40.0;
      left = std::min(left, project(lens, view.cam_from_set * at(*place, -0.5, s))->x);
      right = std::max(right, project(lens, view.cam_from_set * at(*place, 0.5, s))->x);
      top = std::min(top, project(lens, view.cam_from_set * at(*place, s - 0.5, 1))->y);
    }
    EXPECT_LE(left, box[0] + 0.1);
    EXPECT_GE(right, box[2] - 0.1);
    EXPECT_LE(top, box[1] + 0.1);
    EXPECT_GT(left, box[0] - 40);  // an upright rectangle round a tapering one
    EXPECT_LT(right, box[2] + 40);
    EXPECT_GT(top, box[1] - 20);
  }
}

TEST(PlaceBillboard, TurnsToTheViewerAsFarAsAskedAndSaysWhenThatIsTooLittle) {
  const MadeView view = made_view(pinhole_lens());
  const Vec3 to = view.camera() - standing;
  const double camera_at = std::atan2(to.y, to.x);
  for (double off = -3.1; off < 3.1; off += 0.1) {
    const Vec3 viewer =
        standing + 4.0 * Vec3{std::cos(camera_at + off), std::sin(camera_at + off), 0.4};
    const auto place = place_billboard(view.lens, view.cam_from_set, standing, box, viewer, 0.45);
    ASSERT_TRUE(place);
    EXPECT_NEAR(place->view_angle_rad, std::abs(off), 1e-9);
    EXPECT_EQ(place->shallow, std::abs(off) > 0.45);
    const Vec3 n = front(*place);
    const double turned = std::remainder(std::atan2(n.y, n.x) - camera_at, 2 * std::numbers::pi);
    EXPECT_NEAR(turned, std::clamp(off, -0.45, 0.45), 1e-5);
  }
}

TEST(Face, IsNotShallowForWhatNobodySees) {
  EXPECT_FALSE(face(1, 1 + 1e-3, 0).shallow);
  EXPECT_TRUE(face(1, 1 + 0.01, 0).shallow);
  EXPECT_FALSE(face(1, 1 - 0.505, 0.5).shallow);
  EXPECT_TRUE(face(1, 1 - 0.51, 0.5).shallow);
}

// Across the picture, with the feet up to a step apart: none of both falls below the floor, and the
// person's own camera sees the same.
TEST(PlaceBillboard, CutsNoFootOffHoweverItTurns) {
  const MadeView view = made_view(pinhole_lens());
  const MadeWalker walker{{-1.8, 4.5, 0}, {1, 0, 0}};
  const Vec3 camera = view.camera();
  for (const double t : {0.2, 0.36, 1.3, 2.4}) {
    const Feet feet = find_feet(matte_of(view, walker, t));
    ASSERT_EQ(feet.status, FeetStatus::seen) << t;
    FeetTracker tracker(view.lens, view.cam_from_set, 0);
    const Vec3 stands = tracker.update(t, feet)->p_set;
    for (const double degrees : {-60.0, -30.0, 0.0, 15.0, 30.0}) {
      const double angle = degrees * std::numbers::pi / 180;
      const Vec3 viewer = stands + Vec3{4.5 * std::sin(angle), -4.5 * std::cos(angle), 1.5};
      const auto place = place_billboard(view.lens, view.cam_from_set, stands, feet.box, viewer,
                                         std::numbers::pi / 6, feet.lower);
      ASSERT_TRUE(place);
      const Vec3 n = front(*place), on_plane = at(*place, 0, 0);
      for (const int side : {0, 1}) {
        const MadeFoot foot = walker.foot(side, walker.speed_m_s * t);
        for (const Vec3 centre : {foot.heel, foot.toe}) {
          const Vec3 v = centre - Vec3{0, 0, foot_radius_m} - camera;
          const double k = dot(on_plane - camera, n) / dot(v, n);
          EXPECT_GT(camera.z + k * v.z, -0.01) << t << ' ' << degrees;
        }
      }
      // No further forward than the other foot asks for.
      EXPECT_LT(dot(on_plane - stands, n), walker.step_m) << t << ' ' << degrees;
      EXPECT_GT(dot(on_plane - stands, n), -1e-5) << t << ' ' << degrees;
    }
  }
}

TEST(PlaceBillboard, ComesNoMoreThanAMetreNearerForWhatHangsLow) {
  const MadeView view = made_view(pinhole_lens());
  const std::vector<Vec2> low{{600, 519}, {700, 710}};
  const auto place =
      place_billboard(view.lens, view.cam_from_set, standing, box, view.camera(), 0.5, low);
  ASSERT_TRUE(place);
  EXPECT_NEAR(dot(at(*place, 0, 0) - standing, front(*place)), 1, 1e-5);
}

TEST(PlaceBillboard, GivesNothingForWhatHasNoPlaceAndNeverNaN) {
  const MadeView view = made_view(pinhole_lens());
  const auto place = [&](Vec3 stand, const std::array<float, 4>& b, Vec3 viewer, double turn) {
    return place_billboard(view.lens, view.cam_from_set, stand, b, viewer, turn);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Vec3 viewer{1, 0, 1.5};
  EXPECT_FALSE(place(standing, {}, viewer, 0.5));
  EXPECT_FALSE(place(standing, {700, 150, 560, 520}, viewer, 0.5));
  EXPECT_FALSE(place(standing, {560, 150, std::nanf(""), 520}, viewer, 0.5));
  EXPECT_FALSE(place({nan, 5, 0}, box, viewer, 0.5));
  EXPECT_FALSE(place(standing, box, {nan, 0, 0}, 0.5));
  EXPECT_FALSE(place(standing, box, viewer, nan));
  EXPECT_FALSE(place({0, 0, 0}, box, viewer, 0.5));                  // straight below
  EXPECT_FALSE(place({0, -5, 0}, box, viewer, 0.5));                 // behind the camera
  EXPECT_FALSE(place(standing, {560, 600, 700, 700}, viewer, 0.5));  // below the floor
  EXPECT_TRUE(place(standing, box, standing + Vec3{0, 0, 9}, 0.5));  // viewer straight above
  EXPECT_TRUE(place(standing, {-0.5F, -0.5F, 1279.5F, 719.5F}, {9, 5, 1}, 1.3));
}

TEST(Parallax, IsThatOfAPointOffThePlane) {
  EXPECT_EQ(parallax_m(0.2, 0), 0);
  EXPECT_NEAR(parallax_m(0.2, std::numbers::pi / 6), 0.1, 1e-12);
  EXPECT_NEAR(parallax_m(-0.2, -std::numbers::pi / 6), 0.1, 1e-12);
  EXPECT_EQ(parallax_m(std::numeric_limits<double>::infinity(), 1), 0);
  // A far viewer sees the point beside its picture by so much.
  const double angle = 0.4, far = 1e6;
  const Vec3 point{0, -0.15, 1}, drawn{0, 0, 1},
      eye{far * std::sin(angle), -far * std::cos(angle), 1};
  const Vec3 v = normalize(eye - drawn);
  EXPECT_NEAR(length(cross(point - drawn, v)), parallax_m(0.15, angle), 1e-6);
}

}  // namespace
}  // namespace compositing::billboard_place_test
