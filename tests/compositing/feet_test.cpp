// Feet: found in mattes of made walkers and of a real dancer, and followed over the floor.
#include "compositing/feet.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>

#include "capture/camera.h"
#include "made_walker.h"

namespace compositing {
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
  std::optional<std::pair<Lowest, Vec3>> before;
  for (double t = 0; t <= seconds; t += frame_s) {
    capture::Image matte = matte_of(view, walker, t);
    if (noise > 0)
      for (float& a : matte.pixels) a = std::clamp(a + grain(random), 0.0F, 1.0F);
    const Feet feet = find_feet(matte);
    const auto standing = tracker.update(t, feet);
    ++result.frames;
    if (feet.status != FeetStatus::seen || !standing || standing->held) {
      ++result.unseen;
      before.reset();
      continue;
    }
    const Lowest lowest = lowest_of(view, walker, t);
    result.drawn_m =
        std::max(result.drawn_m, std::abs(drawn_height_m(view, standing->p_set, lowest)));
    if (std::getenv("SHOW_WALK"))
      std::printf("%.2f q %.2f %.2f p %.3f %.3f truth %.3f %.3f %s drawn %.3f sigma %.3f\n", t,
                  feet.q.x, feet.q.y, standing->p_set.x, standing->p_set.y, lowest.centre.x,
                  lowest.centre.y, lowest.planted ? "planted" : "swings",
                  drawn_height_m(view, standing->p_set, lowest), standing->sigma_m);
    if (lowest.planted) {
      ++result.planted;
      const Vec3 off = standing->p_set - lowest.centre;
      result.contact_m = std::max(result.contact_m, calibrate::hypotenuse(off.x, off.y));
      if (before && before->first.side == lowest.side && before->first.planted)
        result.slide_m = std::max(result.slide_m, calibrate::length(standing->p_set - before->second));
    }
    before = std::pair(lowest, standing->p_set);
  }
  return result;
}

TEST(Feet, StayWithinTwoCentimetresOfTheFloorContactWalkingFourMetres) {
  for (const auto& lens : {pinhole_lens(), bent_lens()}) {
    const Walk w = walk(made_view(lens), {}, 4 / 1.2);
    std::printf("%s: contact %.4f drawn %.4f slide %.4f planted %d of %d, unseen %d\n",
                lens.model.c_str(), w.contact_m, w.drawn_m, w.slide_m, w.planted, w.frames,
                w.unseen);
    EXPECT_LT(w.contact_m, 0.02);
    EXPECT_LT(w.drawn_m, 0.02);
    EXPECT_LT(w.slide_m, 0.01);
    EXPECT_EQ(w.unseen, 0);
    EXPECT_GT(w.planted, 50);
  }
}

TEST(Feet, StayWithinTwoCentimetresWalkingAwaySidewaysAndInNoise) {
  const MadeView view = made_view(pinhole_lens());
  for (const auto& [walker, noise] :
       {std::pair(MadeWalker{{0.3, 3, 0}, {0, 1, 0}}, 0.0),
        std::pair(MadeWalker{{-1.8, 4.5, 0}, {1, 0, 0}}, 0.0),
        std::pair(MadeWalker{{1, 6.5, 0}, {-0.6, -0.8, 0}}, 0.0),
        std::pair(MadeWalker{}, 0.03)}) {
    const Walk w = walk(view, walker, 3, noise);
    std::printf("contact %.4f drawn %.4f slide %.4f planted %d of %d, unseen %d\n", w.contact_m,
                w.drawn_m, w.slide_m, w.planted, w.frames, w.unseen);
    EXPECT_LT(w.drawn_m, 0.02);
    EXPECT_EQ(w.unseen, 0);
  }
}

}  // namespace
}  // namespace compositing
