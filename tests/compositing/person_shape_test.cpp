// What a person is shown as: stated errors, and the choice between billboards and the hull.
#include "compositing/person_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "calibrate/angles.h"

namespace compositing::person_shape_test {
namespace {

using calibrate::degree;

double hull_error_at(std::vector<double> cameras_deg, double view_deg) {
  for (double& camera : cameras_deg) camera *= degree;
  return hull_error_m(cameras_deg, view_deg * degree);
}

TEST(BillboardErrorM, GrowsTillTheSideIsSeenAndStays) {
  EXPECT_EQ(billboard_error_m(0, 0.2), 0);
  double before = 0;
  for (int i = 1; i <= 180; ++i) {
    const double error = billboard_error_m(i * degree, 0.2);
    EXPECT_GE(error, before);
    EXPECT_EQ(error, billboard_error_m(-i * degree, 0.2));
    before = error;
  }
  EXPECT_DOUBLE_EQ(before, 0.2);
}

TEST(HullErrorM, IsNothingFromTheCamerasAndTurnsWithThem) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-720, 720);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<double> cameras{angle(random), angle(random), angle(random)};
    for (const double camera : cameras) EXPECT_LT(hull_error_at(cameras, camera), 1e-6);
    const double view = angle(random), turn = angle(random);
    std::vector<double> turned = cameras;
    for (double& camera : turned) camera += turn;
    const double error = hull_error_at(cameras, view);
    EXPECT_NEAR(hull_error_at(turned, view + turn), error, 1e-9);
    EXPECT_GE(error, 0);
    EXPECT_LE(error, 1);
    // Another camera beside the view never makes it worse.
    std::vector<double> more = cameras;
    more.push_back(view + 10);
    EXPECT_LE(hull_error_at(more, view), error + 1e-9);
  }
}

TEST(HullErrorM, IsThatOfACylindersPolygon) {
  EXPECT_NEAR(hull_error_at({0, 60}, 30), half_width_m * (1 / std::cos(30 * degree) - 1), 1e-9);
  // Beyond them the corner between both pictures stands out.
  EXPECT_NEAR(hull_error_at({0, 60}, 120), half_width_m, 1e-9);
  EXPECT_NEAR(hull_error_at({0, 90}, 45), half_width_m * (std::sqrt(2) - 1), 1e-9);
  EXPECT_NEAR(hull_error_at({0, 60, 120}, 90), hull_error_at({0, 60, 120}, 30), 1e-9);
  // From behind, what is seen is the other side.
  EXPECT_DOUBLE_EQ(hull_error_at({0, 60}, 210), off_foot_m);
}

TEST(HullErrorM, IsAMetreForWhatIsNoHull) {
  EXPECT_EQ(hull_error_at({}, 0), 1);
  EXPECT_EQ(hull_error_at({0}, 0), 1);
  EXPECT_EQ(hull_error_at({0, 180}, 90), 1);
  EXPECT_EQ(hull_error_at({0, 0}, 45), 1);
  EXPECT_EQ(hull_error_at({0, std::numeric_limits<double>::quiet_NaN()}, 45), 1);
}

ShapeChoice chosen(double view_deg,
                   const std::optional<ShapeChoice>& before = std::nullopt,
                   std::vector<ShapeCamera> cameras = {{0, true}, {60 * degree, true}},
                   PersonShape wanted = PersonShape::automatic) {
  ShapeQuestion question;
  question.wanted = wanted;
  question.cameras = cameras;
  question.view_rad = view_deg * degree;
  return choose_shape(question, before);
}

TEST(ChooseShape, IsTheNearestBillboardNearCamerasAndTheHullBetweenThem) {
  for (const double view : {0.0, 10.0, 14.0, -14.0}) {
    EXPECT_FALSE(chosen(view).hull) << view;
    EXPECT_EQ(chosen(view).camera, 0U) << view;
    EXPECT_TRUE(chosen(view).holds) << view;
  }
  for (const double view : {15.0, 30.0, 45.0}) {
    EXPECT_TRUE(chosen(view).hull) << view;
    EXPECT_LT(chosen(view).error_m, 0.03) << view;
  }
  EXPECT_FALSE(chosen(60).hull);
  EXPECT_EQ(chosen(60).camera, 1U);
  // Beyond the cameras a hull of two is too wide, and so is the billboard.
  for (const double view : {80.0, 100.0, -25.0}) {
    EXPECT_FALSE(chosen(view).hull) << view;
    EXPECT_FALSE(chosen(view).holds) << view;
    EXPECT_GT(chosen(view).hull_error_m, chosen(view).error_m) << view;
  }
}

TEST(ChooseShape, SaysWhatOfCertainKindErrs) {
  const auto billboard = chosen(30, {}, {{0, true}, {60 * degree, true}}, PersonShape::billboard);
  EXPECT_FALSE(billboard.hull);
  EXPECT_FALSE(billboard.holds);
  EXPECT_NEAR(billboard.error_m, 0.1, 1e-9);
  const auto hull = chosen(0, {}, {{0, true}, {60 * degree, true}}, PersonShape::hull);
  EXPECT_TRUE(hull.hull);
  EXPECT_LT(hull.error_m, 1e-6);
}

TEST(ChooseShape, ChangesOnceWhereAViewGoesByAndTrembles) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> tremble(-0.8, 0.8);
  std::optional<ShapeChoice> before;
  int changes = 0;
  for (int i = 0; i <= 6000; ++i) {
    const ShapeChoice now = chosen(i * 0.01 + tremble(random), before);
    changes += before && (before->hull != now.hull || (!now.hull && before->camera != now.camera));
    EXPECT_TRUE(now.holds) << i;
    before = now;
  }
  EXPECT_EQ(changes, 2);  // to the hull, and to the other billboard
  // Where nothing holds, too.
  before.reset(), changes = 0;
  for (int i = 0; i <= 12000; ++i) {
    const ShapeChoice now = chosen(60 + i * 0.01 + tremble(random), before);
    changes += before && before->hull != now.hull;
    before = now;
  }
  EXPECT_LE(changes, 2);
}

TEST(ChooseShape, LeavesOutCamerasThatAreNotGood) {
  const std::vector<ShapeCamera> one{{0, false}, {60 * degree, true}};
  EXPECT_FALSE(chosen(0, {}, one).hull);
  EXPECT_EQ(chosen(0, {}, one).camera, 1U);
  EXPECT_FALSE(chosen(30, {}, one, PersonShape::hull).hull);
  const std::vector<ShapeCamera> two{{0, true}, {30 * degree, false}, {60 * degree, true}};
  EXPECT_TRUE(chosen(30, {}, two).hull);
  EXPECT_GT(chosen(30, {}, two).error_m, 0.02);
  const std::vector<ShapeCamera> none{{0, false}, {60 * degree, false}};
  EXPECT_FALSE(chosen(50, {}, none).hull);
  EXPECT_EQ(chosen(50, {}, none).camera, 1U);
  // Nor is what was chosen before kept for loyalty.
  EXPECT_EQ(chosen(0, chosen(0), one).camera, 1U);
  EXPECT_THROW(chosen(0, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::person_shape_test
