// Feet: found in mattes of made walkers and of a real dancer, and followed over the floor.
#include "compositing/feet.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <random>

#include "capture/camera.h"
#include "compositing/made_walker.h"
#include "tests/made_files.h"

namespace compositing::feet_test {
namespace {

constexpr double frame_s = 0.04;

// What a whole walk gave.
struct Walk {
  double contact_m = 0;  // furthest from the planted foot's contact
  double drawn_m = 0;    // highest above or below the floor that the lowest edge is drawn
  double slide_m = 0;    // furthest between two pictures in which the same foot stands lowest
  int planted = 0, frames = 0, unseen = 0;
};

Walk walk(const MadeView& view, const MadeWalker& walker, double seconds, double noise = 0) {
  Walk result;
  FeetTracker tracker(view.lens, view.cam_from_set, 0);
  std::mt19937 random(7);
  std::normal_distribution<float> grain(0, static_cast<float>(noise));
  Vec3 before;
  int stood_on = -1;  // the side of the foot that stood lowest before
  for (double t = 0; t <= seconds; t += frame_s) {
    capture::Image matte = matte_of(view, walker, t);
    if (noise > 0)
      for (float& a : matte.pixels) a = std::clamp(a + grain(random), 0.0F, 1.0F);
    const Feet feet = find_feet(matte);
    const auto standing = tracker.update(t, feet);
    ++result.frames;
    const Lowest lowest = lowest_of(view, walker, t);
    if (standing) {
      result.drawn_m =
          std::max(result.drawn_m, std::abs(drawn_height_m(view, standing->p_set, lowest)));
    }
    if (feet.status != FeetStatus::seen || !standing || standing->held) {
      ++result.unseen;
      stood_on = -1;
      continue;
    }
    if (lowest.planted) {
      ++result.planted;
      const Vec3 off = standing->p_set - lowest.centre;
      result.contact_m = std::max(result.contact_m, calibrate::hypotenuse(off.x, off.y));
      if (stood_on == lowest.side)
        result.slide_m = std::max(result.slide_m, length(standing->p_set - before));
    }
    stood_on = lowest.planted ? lowest.side : -1;
    before = standing->p_set;
  }
  return result;
}

void report(const char* what, const Walk& w) {
  const auto text = [](double metres) { return std::to_string(1e3 * metres); };
  testing::Test::RecordProperty(std::string(what) + "_contact_mm", text(w.contact_m));
  testing::Test::RecordProperty(std::string(what) + "_drawn_mm", text(w.drawn_m));
  testing::Test::RecordProperty(std::string(what) + "_slide_mm", text(w.slide_m));
  std::cout << what << ": contact " << 1e3 * w.contact_m << " mm, drawn " << 1e3 * w.drawn_m
            << " mm, slide " << 1e3 * w.slide_m << " mm; " << w.planted << " of " << w.frames
            << " on the floor, " << w.unseen << " held\n";
}

// The contact: the ball of the planted foot that is lowest in the picture. While the foot that is
// lowest swings, there is none, and only where it is drawn counts.
TEST(Feet, StayWithinTwoCentimetresOfTheFloorContactWalkingFourMetres) {
  for (const auto& lens : {pinhole_lens(), bent_lens()}) {
    const Walk w = walk(made_view(lens), {}, 4 / 1.2);
    report(lens.model.c_str(), w);
    EXPECT_LT(w.contact_m, 0.02);
    EXPECT_LT(w.drawn_m, 0.02);
    EXPECT_LT(w.slide_m, 0.01);
    EXPECT_EQ(w.unseen, 0);
    EXPECT_GT(w.planted, 50);
  }
}

TEST(Feet, StayOnTheFloorWalkingAwayAndInNoise) {
  const MadeView view = made_view(pinhole_lens());
  const Walk away = walk(view, {{0.3, 3, 0}, {0, 1, 0}}, 3);
  report("away", away);
  const Walk noisy = walk(view, {}, 3, 0.03);
  report("noise", noisy);
  for (const Walk& w : {away, noisy}) {
    EXPECT_LT(w.contact_m, 0.02);
    EXPECT_LT(w.drawn_m, 0.02);
    EXPECT_EQ(w.unseen, 0);
  }
}

// Seen from the side both feet are at nearly one depth. Where the lifted one is lowest, the other
// is drawn above the floor: by less than the lift.
TEST(Feet, StayOnTheFloorWalkingAcrossThePicture) {
  const MadeView view = made_view(pinhole_lens());
  const Walk across = walk(view, {{-1.8, 4.5, 0}, {1, 0, 0}}, 3);
  report("across", across);
  const Walk aslant = walk(view, {{1, 6.5, 0}, {-0.6, -0.8, 0}}, 3);
  report("aslant", aslant);
  for (const Walk& w : {across, aslant}) {
    EXPECT_LT(w.drawn_m, 0.06);
    EXPECT_LE(w.unseen, 3);
  }
}

// From the hand of a walker whose body is there, to below his feet in the picture.
void hang_axe(capture::Image& matte, const MadeView& view, Vec3 body) {
  const Vec3 head = body + Vec3{0.55, -0.75, 0.3};
  draw(matte, view,
       {{body + Vec3{-0.1, -0.2, 0.85}, head, 0.03},
        {head, head + Vec3{0.05, 0, -0.2}, 0.08},
        {head + Vec3{0.05, 0, -0.2}, head + Vec3{0.06, 0, -0.28}, 0.05}});
}

TEST(Feet, AreNotTheAxeThatHangsLower) {
  const MadeView view = made_view(pinhole_lens());
  const MadeWalker walker{{0, 5, 0}};
  int seen = 0;
  for (double t = 0; t < 1.2; t += 0.12) {
    capture::Image matte = matte_of(view, walker, t);
    const Feet without = find_feet(matte);
    hang_axe(matte, view, walker.start + 1.2 * t * walker.way);
    const Feet with = find_feet(matte);
    ASSERT_GT(with.box[3], without.box[3] + 20) << t;  // it does hang lower
    if (with.status != FeetStatus::seen) continue;
    ++seen;
    EXPECT_NEAR(with.q.x, without.q.x, 3) << t;
    EXPECT_NEAR(with.q.y, without.q.y, 1) << t;
  }
  EXPECT_GE(seen, 8) << "of 10";
}

TEST(Feet, AreCutOffByTheLowerEdgeAndHeld) {
  const MadeView view = made_view(pinhole_lens());
  const MadeWalker walker{{0, 3.4, 0}};
  FeetTracker tracker(view.lens, view.cam_from_set, 0);
  Vec3 last;
  int cut = 0;
  double sigma = 0;
  for (double t = 0; t < 1.2; t += frame_s) {
    const Feet feet = find_feet(matte_of(view, walker, t));
    const auto standing = tracker.update(t, feet);
    ASSERT_TRUE(standing);
    EXPECT_EQ(standing->held, feet.status != FeetStatus::seen) << t;
    if (cut > 0) {
      EXPECT_EQ(feet.status, FeetStatus::cut_off) << t;
      EXPECT_EQ(standing->p_set, last) << t;
      EXPECT_GT(standing->sigma_m, sigma);
    }
    cut += feet.status == FeetStatus::cut_off;
    last = standing->p_set;
    sigma = standing->sigma_m;
  }
  EXPECT_GT(cut, 5);
  const auto gone = tracker.update(1.3, find_feet(capture::make_image(720, 1280, 1)));
  ASSERT_TRUE(gone);
  EXPECT_EQ(gone->status, FeetStatus::absent);
  EXPECT_EQ(gone->p_set, last);
}

TEST(Feet, AreCutOffWhereAMaskEndsTheLegs) {
  const MadeView view = made_view(pinhole_lens());
  const capture::Image whole = matte_of(view, {{0, 5, 0}}, 0.3);
  const Feet seen = find_feet(whole);
  ASSERT_EQ(seen.status, FeetStatus::seen);
  const auto status_with = [&](int first_row) {
    capture::Image matte = whole, mask = capture::make_image(matte.height, matte.width, 1);
    for (int y = first_row; y < matte.height; ++y) {
      for (int x = 0; x < matte.width; ++x) {
        mask.at(y, x) = y == first_row ? 0.5F : 1;
        matte.at(y, x) *= 1 - mask.at(y, x);
      }
    }
    return find_feet(matte, 0, mask).status;
  };
  const int lowest = static_cast<int>(seen.q.y);
  EXPECT_EQ(status_with(lowest - 80), FeetStatus::cut_off);
  EXPECT_EQ(status_with(lowest - 10), FeetStatus::cut_off);
  EXPECT_EQ(status_with(lowest + 8), FeetStatus::seen);
  EXPECT_EQ(find_feet(whole, 0, capture::make_image(whole.height, whole.width, 1)).q, seen.q);
  EXPECT_THROW(find_feet(whole, 0, capture::make_image(9, 9, 1)), std::invalid_argument);
}

// Where a picture is turned, all that is found turns with it.
TEST(Feet, AreTheSameInTurnedPictures) {
  const MadeView view = made_view(pinhole_lens());
  capture::Image matte = matte_of(view, {{0.4, 5, 0}}, 0.3);
  const Feet upright = find_feet(matte);
  std::vector<Vec2> places = upright.lower;
  places.push_back(upright.q);
  std::array<float, 4> box = upright.box;
  for (const int turns : {3, 2, 1}) {  // what it takes after one turn more to the right each
    const int height = matte.height;
    capture::Image to = capture::make_image(matte.width, height, 1);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < matte.width; ++x) to.at(x, height - 1 - y) = matte.at(y, x);
    matte = std::move(to);
    for (Vec2& q : places) q = {height - 1 - q.y, q.x};
    const auto below = static_cast<float>(height - 1);
    box = {below - box[3], box[0], below - box[1], box[2]};
    const Feet feet = find_feet(matte, turns);
    EXPECT_EQ(feet.status, FeetStatus::seen);
    EXPECT_EQ(feet.q, places.back()) << turns;
    ASSERT_EQ(feet.lower.size() + 1, places.size());
    for (std::size_t i = 0; i < feet.lower.size(); ++i) EXPECT_EQ(feet.lower[i], places[i]);
    EXPECT_EQ(feet.box, box) << turns;
  }
}

TEST(Feet, AreAbsentFromEmptyMattesAndSpecks) {
  capture::Image matte = capture::make_image(90, 160, 1);
  EXPECT_EQ(find_feet(matte).status, FeetStatus::absent);
  matte.at(30, 40) = matte.at(50, 60) = 1;
  EXPECT_EQ(find_feet(matte).status, FeetStatus::absent);
  EXPECT_EQ(find_feet(matte).box, (std::array<float, 4>{}));
  EXPECT_EQ(find_feet({}).status, FeetStatus::absent);
  EXPECT_THROW(find_feet(capture::make_image(9, 9, 3)), std::invalid_argument);
}

// Two who walk past each other at different depths: uncertain while they are apart; where they are
// one silhouette, the place never leaves the floor between both.
TEST(Feet, OfTwoPersonsAreUncertainAndStayBetweenThem) {
  const MadeView view = made_view(pinhole_lens());
  const MadeWalker near{{-1.3, 4.2, 0}, {1, 0, 0}}, behind{{1.5, 5.2, 0}, {-1, 0, 0}};
  FeetTracker tracker(view.lens, view.cam_from_set, 0);
  ASSERT_TRUE(tracker.update(-0.04, find_feet(matte_of(view, near, 0))));
  int uncertain = 0;
  for (double t = 0; t < 2.2; t += 0.08) {
    capture::Image matte = matte_of(view, near, t);
    draw(matte, view, behind.shape(t));
    const Feet feet = find_feet(matte);
    uncertain += feet.status == FeetStatus::uncertain;
    const auto standing = tracker.update(t, feet);
    ASSERT_TRUE(standing);
    EXPECT_TRUE(std::isfinite(standing->sigma_m));
    EXPECT_GT(standing->p_set.y, 3.8) << t;
    EXPECT_LT(standing->p_set.y, 5.6) << t;
  }
  EXPECT_GT(uncertain, 8);
}

// Both feet end on the lower edge or above it, but for a pixel; the axe hangs below it.
TEST(Feet, HaveALowerEdgeThatHoldsBothAndNotTheAxe) {
  const MadeView view = made_view(pinhole_lens());
  for (const Vec3 way : {Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{-0.6, -0.8, 0}}) {
    const MadeWalker walker{{0, 5, 0}, way};
    for (double t = 0; t < 1.1; t += 0.12) {
      capture::Image matte = matte_of(view, walker, t);
      if (way.x == 0) hang_axe(matte, view, walker.start + 1.2 * t * walker.way);
      const Feet feet = find_feet(matte);
      if (feet.status != FeetStatus::seen) continue;
      ASSERT_GE(feet.lower.size(), 2U);
      const auto edge_at = [&](double x) {
        for (std::size_t i = 1; i < feet.lower.size(); ++i) {
          const Vec2 a = feet.lower[i - 1], b = feet.lower[i];
          if (x <= b.x) return a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x);
        }
        return feet.lower.back().y;
      };
      for (const int side : {0, 1}) {
        const MadeFoot foot = walker.foot(side, 1.2 * t);
        for (const Vec3 centre : {foot.heel, foot.toe}) {
          const auto q =
              project(view.lens, view.cam_from_set * (centre - Vec3{0, 0, foot_radius_m}));
          EXPECT_GT(edge_at(q->x), q->y - 1.5) << way.x << ' ' << t;
        }
      }
      for (const Vec2 q : feet.lower) EXPECT_LT(q.y, feet.q.y + 1) << way.x << ' ' << t;
    }
  }
}

TEST(Feet, AreFiniteWhateverTheMatteHolds) {
  std::mt19937 random(3);
  const std::array<float, 8> values{0, 1, 0.5F, -7, 1e30F, std::nanf(""), INFINITY, -INFINITY};
  for (int trial = 0; trial < 300; ++trial) {
    capture::Image matte = capture::make_image(1 + static_cast<int>(random() % 40),
                                               1 + static_cast<int>(random() % 40), 1);
    const unsigned most = trial % 2 ? 2 : 8;
    for (float& a : matte.pixels) a = values[random() % most];
    const Feet feet = find_feet(matte);
    ASSERT_TRUE(std::isfinite(feet.q.x) && std::isfinite(feet.q.y));
    ASSERT_TRUE(std::isfinite(feet.sigma_px));
    for (const float edge : feet.box) ASSERT_TRUE(std::isfinite(edge));
    for (const Vec2 q : feet.lower) ASSERT_TRUE(std::isfinite(q.x) && std::isfinite(q.y));
  }
}

// The lowest row of the front foot, and its left and right, read off enlarged frames by eye.
TEST(Feet, OfTheDancerAreHisAndNotTheAxes) {
  const std::string path = made::real_data() / "greenscreen/aframe_dancer_360x640.mp4";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no clip: PLATELIGHT_DATA";
  struct Truth {
    int frame;
    double left, right, y;
  };
  const std::vector<Truth> truths{
      {0, 284, 310, 524},    {55, 273, 286, 498.8}, {60, 270, 283, 494.7},  {64, 270, 283, 495.5},
      {75, 279, 294, 507.3}, {95, 280, 304, 516.5}, {100, 280, 303, 516.5}, {130, 281, 308, 522}};
  const auto camera = capture::open_camera("file:" + path);
  int lower = 0;
  for (int n = 0; const auto frame = camera->next(); ++n) {
    const capture::Image& picture = *frame->image;
    capture::Image matte = capture::make_image(picture.height, picture.width, 1);
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const float green =
            picture.at(y, x, 1) - std::max(picture.at(y, x, 0), picture.at(y, x, 2));
        matte.at(y, x) = 1 - std::clamp((green - 0.1F) / 0.6F, 0.0F, 1.0F);
      }
    }
    const Feet feet = find_feet(matte);
    EXPECT_EQ(feet.status, FeetStatus::seen) << n;
    EXPECT_GT(feet.q.x, 265) << n;  // the axe is further left in all frames
    lower += feet.box[3] > feet.q.y + 10;
    for (const Truth& truth : truths) {
      if (truth.frame != n) continue;
      EXPECT_GT(feet.q.x, truth.left) << n;
      EXPECT_LT(feet.q.x, truth.right) << n;
      EXPECT_NEAR(feet.q.y, truth.y, 2) << n;
    }
  }
  EXPECT_GT(lower, 25);
}

}  // namespace
}  // namespace compositing::feet_test
