// The box about a person: nothing of it sticks out, and it is not much larger.
#include "compositing/person_box.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "calibrate/angles.h"
#include "compositing/made_walker.h"

namespace compositing::person_box_test {
namespace {

using calibrate::degree;

// Seen by cameras about the origin. Nobody: no view.
std::vector<OutlinedView> views_of(const std::vector<Capsule>& shape,
                                   const std::vector<double>& round_deg,
                                   const calibrate::Lens& lens,
                                   double distance_m) {
  std::vector<OutlinedView> views;
  for (const double round : round_deg) {
    const double angle = round * degree;
    const MadeView view{
        lens, calibrate::look_at({distance_m * std::sin(angle), -distance_m * std::cos(angle), 1.4},
                                 {0, 0, 0.9}, 0)};
    capture::Image matte = capture::make_image(lens.height, lens.width, 1);
    draw(matte, view, shape);
    if (const auto box = outline_box(matte)) views.push_back({lens, view.cam_from_set, *box});
  }
  return views;
}

std::vector<Capsule> with_arms_out(Vec3 at) {
  return {{at + Vec3{0, 0, 0.3}, at + Vec3{0, 0, 1.38}, 0.17},
          {at + Vec3{0, 0, 1.6}, at + Vec3{0, 0, 1.63}, 0.1},
          {at + Vec3{0, 0, 1.42}, at + Vec3{0.85, 0, 1.5}, 0.045},
          {at + Vec3{0, 0, 1.42}, at + Vec3{-0.6, -0.6, 1.9}, 0.045},
          {at + Vec3{-0.1, 0, 0.3}, at + Vec3{-0.1, 0.5, 0.045}, 0.045},
          {at + Vec3{0.1, 0, 0.3}, at + Vec3{0.1, -0.4, 0.045}, 0.045}};
}

void expect_inside(const PersonBox& box, const std::vector<Capsule>& shape, const char* what) {
  for (const Capsule& c : shape) {
    for (const Vec3 end : {c.a, c.b}) {
      EXPECT_LE(box.lower.x, end.x - c.radius) << what;
      EXPECT_LE(box.lower.y, end.y - c.radius) << what;
      EXPECT_LE(box.lower.z, std::max(end.z - c.radius, 0.002)) << what;
      EXPECT_GE(box.upper.x, end.x + c.radius) << what;
      EXPECT_GE(box.upper.y, end.y + c.radius) << what;
      EXPECT_GE(box.upper.z, end.z + c.radius) << what;
    }
  }
}

const std::vector<std::vector<double>> rings{{0, 60}, {0, 90, 200}, {10, 70, 130, 300}};

TEST(PersonBox, HoldsArmsThatReachOutAndLegs) {
  for (const auto& ring : rings) {
    for (const calibrate::Lens& lens : {pinhole_lens(), bent_lens()}) {
      const Vec3 at{0.3, -0.2, 0};
      const auto shape = with_arms_out(at);
      const auto box = person_box(views_of(shape, ring, lens, 5), at);
      ASSERT_TRUE(box);
      expect_inside(*box, shape, lens.model.c_str());
      // Two cameras leave room before and behind; the more there are, the less.
      EXPECT_LT(box->upper.x - box->lower.x, ring.size() == 2 ? 4 : 2.7);
      EXPECT_LT(box->upper.z - box->lower.z, 2.9);
      EXPECT_NEAR(box->lower.z, 0.001, 0.06);
    }
  }
}

TEST(PersonBox, FollowsTheWalker) {
  const MadeWalker walker{.start = {0, 0.8, 0}};
  for (double t = 0; t < 1.4; t += 0.2) {
    const auto shape = walker.shape(t);
    const Vec3 at = walker.start + walker.speed_m_s * t * walker.way;
    const auto box = person_box(views_of(shape, {0, 60}, pinhole_lens(), 5), at);
    ASSERT_TRUE(box);
    expect_inside(*box, shape, "walker");
    EXPECT_LT(box->upper.x - box->lower.x, 1.6);
    EXPECT_LT(box->upper.y - box->lower.y, 2.4);
  }
}

// A hand beyond the picture's edge is seen by the other camera alone.
TEST(PersonBox, GoesOnBeyondAPicturesEdge) {
  const Vec3 at{0, 0, 0};
  const auto shape = with_arms_out(at);
  auto narrow = views_of(shape, {0}, {"pinhole", 200, 720, {900, 900, 99.5, 359.5}}, 5);
  ASSERT_EQ(narrow.size(), 1U);
  EXPECT_LT(narrow[0].box[0], 3);
  auto views = views_of(shape, {90}, pinhole_lens(), 5);
  views.push_back(narrow[0]);
  const auto box = person_box(views, at);
  ASSERT_TRUE(box);
  expect_inside(*box, shape, "narrow");
}

// Head and shoulders say nothing of how wide somebody is below the picture.
TEST(PersonBox, HoldsFeetThatACloseCameraDoesNotSee) {
  const Vec3 at{0, 0, 0};
  const std::vector<Capsule> shape{{{0, 0, 0.9}, {0, 0, 1.38}, 0.17},
                                   {{0, 0, 1.6}, {0, 0, 1.63}, 0.1},
                                   {{0, 0, 0.9}, {0, 0.6, 0.045}, 0.045},
                                   {{0, 0, 0.9}, {0, -0.5, 0.045}, 0.045}};
  auto views = views_of(shape, {90}, {"pinhole", 1280, 300, {1500, 1500, 639.5, 299.5}}, 5);
  ASSERT_EQ(views.size(), 1U);
  EXPECT_GT(views[0].box[3], 296);
  views.push_back(views_of(shape, {0}, pinhole_lens(), 5).at(0));
  const auto box = person_box(views, at);
  ASSERT_TRUE(box);
  expect_inside(*box, shape, "close");
  EXPECT_LT(box->upper.y - box->lower.y, 3.5);
  // The same on their sides.
  for (OutlinedView& view : views) {
    const auto [left, top, right, bottom] = view.box;
    const auto height = static_cast<float>(view.lens.height);
    view.box = {height - 1 - bottom, left, height - 1 - top, right};
    std::swap(view.lens.width, view.lens.height);
    std::swap(view.lens.parameters[2], view.lens.parameters[3]);
    view.lens.parameters[2] = static_cast<double>(height) - 1 - view.lens.parameters[2];
    const calibrate::Mat3 turned{{0, -1, 0, 1, 0, 0, 0, 0, 1}};
    view.cam_from_set = {turned * view.cam_from_set.R, turned * view.cam_from_set.t};
  }
  const auto aside = person_box(views, at);
  ASSERT_TRUE(aside);
  EXPECT_NEAR(aside->lower.y, box->lower.y, 0.02);
  EXPECT_NEAR(aside->upper.x, box->upper.x, 0.02);
}

TEST(PersonBox, IsNoneWhereOutlinesDoNotMeetOrNumbersAreNone) {
  const auto left = views_of(with_arms_out({-1.5, 0, 0}), {0}, pinhole_lens(), 6);
  const auto right = views_of(with_arms_out({1.5, 0, 0}), {10}, pinhole_lens(), 6);
  ASSERT_EQ(left.size() + right.size(), 2U);
  EXPECT_TRUE(person_box(std::vector{left[0]}, {}));  // as far as it reaches
  EXPECT_FALSE(person_box(std::vector{left[0], right[0]}, {1.5, 0, 0}));
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(person_box(std::vector{left[0]}, {nan, 0, 0}));
  OutlinedView bad = left[0];
  bad.cam_from_set.t.x = nan;
  const auto box = person_box(std::vector{bad}, {});
  EXPECT_TRUE(!box || std::isfinite(box->upper.x));
}

TEST(OutlineBox, IsOfAllThatMayBeSomebody) {
  capture::Image matte = capture::make_image(20, 30, 1);
  EXPECT_FALSE(outline_box(matte));
  matte.at(3, 4) = 0.2F, matte.at(15, 20) = 1;
  matte.at(0, 0) = 0.05F, matte.at(19, 29) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(outline_box(matte), (std::array<float, 4>{2, 1, 22, 17}));
  EXPECT_THROW(outline_box(capture::make_image(2, 2, 3)), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::person_box_test
