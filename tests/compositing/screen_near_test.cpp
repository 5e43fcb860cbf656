// How near the screen is, against distances counted one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "compositing/keyer.h"
#include "compositing/made_clip.h"
#include "compositing/screen_near.h"

namespace compositing::screen_near_test {
namespace {

TEST(ScreenNear, FallsWithTheDistanceFromTheNearestCellThatShowsTheScreen) {
  constexpr int rows = 23, columns = 37;
  constexpr float near = 2, deep = 9;
  std::vector<float> shows(rows * columns);
  const auto at = [](int r, int c) { return static_cast<std::size_t>(r * columns + c); };
  shows[at(3, 30)] = shows[at(20, 5)] = shows[at(0, 0)] = 1;
  ScreenNear found{rows, columns, std::vector<float>(shows.size()), {}, {}};
  find_near(shows, near, deep, found);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      double least = 1e9;
      for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
          if (shows[at(i, j)] > 0) least = std::min(least, std::hypot(i - r, j - c));
        }
      }
      const double value = std::clamp((deep - least) / (deep - near), 0.0, 1.0);
      EXPECT_NEAR(found.cells[at(r, c)], value, 1e-5);
    }
  }
}

TEST(ScreenNear, IsDeepWhereNoCellShowsTheScreen) {
  ScreenNear found{4, 5, std::vector<float>(20, 7.0F), {}, {}};
  find_near(std::vector<float>(20), 1, 3, found);
  for (const float value : found.cells) EXPECT_EQ(value, 0);
}

TEST(ScreenNear, LanesArePixelsBetweenCells) {
  ScreenNear near{3, 4, {}, std::vector<std::uint8_t>(12), {}};
  for (int i = 0; i < 12; ++i) near.cells.push_back(std::fmod(0.37F * static_cast<float>(i), 1.0F));
  for (int y = 0; y < 24; ++y) {
    const NearRow row(near, y);
    for (int x = 0; x < 32; x += 8) {
      const F8 lanes = row.at(x);
      for (int i = 0; i < 8; ++i) EXPECT_NEAR(lanes[i], near.at(y, x + i), 1e-6) << y << " " << x;
    }
  }
}

// Of a grey person whose middle is farther than hair reaches.
TEST(ScreenNear, FollowsThePersonInEachFrame) {
  const MadeClip clip(made_scene("uneven"), 5, 160, 240);
  std::vector<capture::Image> shots;
  for (int i = 0; i < 4; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  const CleanPlate plate = average_plate(shots);
  Keyer keyer(plate, {});
  capture::HalfImage half;
  for (const int left : {24, 104}) {
    capture::Image frame = plate.light;
    for (int y = 32; y < 128; ++y) {
      for (int x = left; x < left + 96; ++x) {
        for (int c = 0; c < 3; ++c) frame.at(y, x, c) = 0.3F;
      }
    }
    const std::shared_ptr<const LitPlate> before = keyer.shared_lit();
    const float was_in_the_middle = before->near.at(80, left + 48);
    keyer.key(frame, half);
    const ScreenNear& near = keyer.lit().near;
    EXPECT_EQ(near.at(80, left + 48), 0);
    EXPECT_EQ(near.at(80, left + 1), 1);
    EXPECT_EQ(near.at(80, left - 10), 1);
    EXPECT_EQ(near.at(80, left == 24 ? 180 : 60), 1);
    EXPECT_EQ(before->near.at(80, left + 48), was_in_the_middle) << "held, so it stays";
  }
}

}  // namespace
}  // namespace compositing::screen_near_test
