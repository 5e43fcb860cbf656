// Feet followed over the floor: at any frame rate, and what is out of reach.
#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "compositing/feet.h"
#include "compositing/made_walker.h"

namespace compositing::feet_tracker_test {
namespace {

constexpr double frame_s = 0.04;

// Over the floor, from a foot's line from heel to toe.
double distance_to(const MadeFoot& foot, const Standing& standing) {
  double distance = 1e9;
  for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const Vec3 p = foot.heel + s * (foot.toe - foot.heel) - standing.p_set;
    distance = std::min(distance, calibrate::hypotenuse(p.x, p.y));
  }
  return distance;
}

TEST(FeetTracker, IsFiniteForShallowViewsAndHostileFeet) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double height : {0.0, 1e-9, 0.01, 0.3, 1.5, -1.0, 300.0}) {
    FeetTracker tracker(pinhole_lens(), calibrate::look_at({0, 0, height}, {0, 5, height}, 0), 0);
    std::mt19937 random(5);
    for (int i = 0; i < 500; ++i) {
      Feet feet;
      feet.status = static_cast<FeetStatus>(random() % 4);
      feet.q = {static_cast<double>(random() % 1400) - 50, static_cast<double>(random() % 800)};
      feet.sigma_px = i % 7 ? 0.3 : nan;
      if (i % 11 == 0) feet.q.x = nan;
      const auto standing = tracker.update(i % 13 ? 0.04 * (i % 200) : nan, feet);
      if (!standing) continue;
      ASSERT_TRUE(std::isfinite(standing->p_set.x) && std::isfinite(standing->p_set.y));
      ASSERT_TRUE(std::isfinite(standing->sigma_m) && standing->sigma_m >= 0);
      ASSERT_EQ(standing->p_set.z, 0);
    }
  }
}

// From 1.5 m above the floor, and from 1.5 cm, where a pixel is metres of floor.
TEST(FeetTracker, SaysHowUncertainAndRefusesWhatItCannotTell) {
  Feet feet{{639.5, 500}, 0.3, FeetStatus::seen, {}};
  const MadeView view = made_view(pinhole_lens());
  FeetTracker high(view.lens, view.cam_from_set, 0);
  const auto seen = high.update(0, feet);
  ASSERT_TRUE(seen);
  EXPECT_GT(seen->sigma_m, 0.001);
  EXPECT_LT(seen->sigma_m, 0.02);
  FeetTracker low(view.lens, calibrate::look_at({0, 0, 0.015}, {0, 5, 0.015}, 0), 0);
  feet.q.y = 361;
  EXPECT_FALSE(low.update(0, feet));
  feet.q.y = 300;  // above the horizon
  EXPECT_FALSE(high.update(0.04, feet)->status == FeetStatus::seen);
}

TEST(FeetTracker, IgnoresAGlimpseOfAnotherPlaceAndFollowsThereIfItStays) {
  const MadeView view = made_view(pinhole_lens());
  FeetTracker tracker(view.lens, view.cam_from_set, 0);
  const auto at = [&](double y) {
    return Feet{*project(view.lens, view.cam_from_set * Vec3{0, y, 0}), 0.3, FeetStatus::seen, {}};
  };
  double t = 0;
  for (; t < 0.4; t += frame_s) tracker.update(t, at(6));
  const auto glimpse = tracker.update(t, at(3.5));
  EXPECT_TRUE(glimpse->held);
  EXPECT_NEAR(glimpse->p_set.y, 6, 0.01);
  std::optional<Standing> standing;
  for (const double end = t + 0.5; t < end; t += frame_s) standing = tracker.update(t, at(3.5));
  EXPECT_FALSE(standing->held);
  EXPECT_NEAR(standing->p_set.y, 3.5, 0.01);
}

// Half the pixels of the other walks. The place is on a foot, from heel to toe, at any rate.
TEST(FeetTracker, FollowsWhoWalksOrRunsAtAnyFrameRate) {
  const calibrate::Lens lens{"pinhole", 640, 360, {450, 450, 319.5, 179.5}};
  const MadeView view = made_view(lens);
  struct Walk {
    MadeWalker walker;
    double seconds, frame_s;
  };
  std::vector<Walk> walks{{{{0, 9, 0}, {0, -1, 0}, 3.5, 1.2}, 1.6, 0.04},
                          {{{0, 3, 0}, {0, 1, 0}, 3.5, 1.2}, 1.6, 0.04}};
  for (const double seconds : {0.08, 0.12, 0.2, 0.3}) {
    walks.push_back({{}, 3.3, seconds});
    walks.push_back({{{0, 3, 0}, {0, 1, 0}}, 3.3, seconds});
    walks.push_back({{{0, 8, 0}, {0, -1, 0}, 1.8, 0.8}, 2.6, seconds});
  }
  for (const Walk& walk : walks) {
    const MadeWalker& walker = walk.walker;
    FeetTracker tracker(view.lens, view.cam_from_set, 0);
    for (double t = 0; t <= walk.seconds; t += walk.frame_s) {
      const auto standing = tracker.update(t, find_feet(matte_of(view, walker, t)));
      ASSERT_TRUE(standing);
      EXPECT_FALSE(standing->held) << walker.speed_m_s << " m/s, " << walk.frame_s << " s, " << t;
      double off = 1e9;
      for (const int side : {0, 1}) {
        off = std::min(off, distance_to(walker.foot(side, walker.speed_m_s * t), *standing));
      }
      EXPECT_LT(off, 0.2) << walker.speed_m_s << " m/s, " << walk.frame_s << " s, " << t;
    }
  }
}

// As the dancer's axe, which hangs 90 pixels lower: .9 m nearer, now and then for a tenth of a
// second.
TEST(FeetTracker, IsNotDrawnToAnAxeThatIsTakenForAFootNowAndThen) {
  const MadeView view = made_view(pinhole_lens());
  const auto at = [&](double x, double y) {
    return Feet{*project(view.lens, view.cam_from_set * Vec3{x, y, 0}), 0.3, FeetStatus::seen, {}};
  };
  FeetTracker tracker(view.lens, view.cam_from_set, 0);
  for (int i = 0; i < 100; ++i) {
    const bool axe = i % 10 >= 7;
    const auto standing = tracker.update(frame_s * i, axe ? at(-0.3, 3.1) : at(0, 4));
    ASSERT_TRUE(standing);
    EXPECT_NEAR(standing->p_set.y, 4, 0.02) << i;
    EXPECT_EQ(standing->held, axe) << i;
  }
}

// A camera that is turned to portrait, or hangs upside down.
TEST(FeetTracker, StandsOnTheFloorWhicheverWayTheCameraIsTurned) {
  const calibrate::Lens lens{"pinhole", 640, 360, {450, 450, 319.5, 179.5}};
  const MadeWalker walker{{0, 6, 0}};
  for (const double roll_deg : {-180.0, -97.0, -90.0, 0.0, 12.0, 90.0}) {
    const double roll = roll_deg * std::numbers::pi / 180;
    const MadeView view{lens, calibrate::look_at({0, 0, 1.5}, {0, 5, 0.9}, roll)};
    const int turns = turns_to_upright(view.cam_from_set);
    FeetTracker tracker(lens, view.cam_from_set, 0);
    for (double t = 0; t < 1; t += 0.2) {
      const auto standing = tracker.update(t, find_feet(matte_of(view, walker, t), turns));
      ASSERT_TRUE(standing) << roll_deg;
      EXPECT_EQ(standing->status, FeetStatus::seen) << roll_deg;
      double off = 1e9;
      for (const int side : {0, 1}) {
        off = std::min(off, distance_to(walker.foot(side, walker.speed_m_s * t), *standing));
      }
      EXPECT_LT(off, 0.05) << roll_deg;
    }
  }
}

// What is lowest in such pictures need be no foot: it is followed, but not trusted.
TEST(FeetTracker, IsUncertainWhereTheCameraLooksDownSteeplyOrLeans) {
  const auto status = [](Vec3 camera, double roll_deg) {
    const Vec3 feet{0, 5, 0};
    const calibrate::Pose pose =
        calibrate::look_at(camera, {0, 5, 0.5}, roll_deg * std::numbers::pi / 180);
    FeetTracker tracker(pinhole_lens(), pose, 0);
    const auto q = project(pinhole_lens(), pose * feet);
    const auto standing = tracker.update(0, {*q, 0.3, FeetStatus::seen, {}});
    EXPECT_NEAR(standing->p_set.y, 5, 1e-6);
    EXPECT_FALSE(standing->held);
    return standing->status;
  };
  EXPECT_EQ(status({0, 0, 1.5}, 0), FeetStatus::seen);
  EXPECT_EQ(status({0, 0, 4.5}, 0), FeetStatus::seen);
  EXPECT_EQ(status({0, 0, 5.5}, 0), FeetStatus::uncertain);
  EXPECT_EQ(status({0, 4.9, 5}, 0), FeetStatus::uncertain);
  for (const double quarter : {-90.0, 0.0, 90.0, 180.0}) {
    EXPECT_EQ(status({0, 0, 1.5}, quarter + 20), FeetStatus::seen);
    EXPECT_EQ(status({0, 0, 1.5}, quarter - 30), FeetStatus::uncertain);
    EXPECT_EQ(status({0, 0, 1.5}, quarter + 44), FeetStatus::uncertain);
  }
}

}  // namespace
}  // namespace compositing::feet_tracker_test
