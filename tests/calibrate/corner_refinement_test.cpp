// Corners to a fraction of a pixel, against the truth.
#include "calibrate/corner_refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibrate/angles.h"
#include "tests/calibrate/made_board_picture.h"

namespace calibrate::corner_refinement_test {
namespace {

const Board board{Board::Kind::chessboard, 7, 5, .04, 0, ""};
const Lens fisheye{"kannala_brandt", 640, 640, {205, 205, 318.3, 321.6, -.01, .002}};

BoardView shifted(const std::vector<std::optional<Vec2>>& truth,
                  double by_px,
                  std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-by_px, by_px);
  BoardView view{"", truth};
  for (auto& q : view.corners) {
    if (q) q = Vec2{q->x + uniform(random), q->y + uniform(random)};
  }
  return view;
}

TEST(RefineCorners, FindsTheTruthFromAPixelAway) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    std::mt19937 random(seed);
    const double off_axis = (seed % 2 == 0 ? 20 : 65) * degree;
    const Pose pose =
        made::make_board_pose(board,
                              {std::sin(off_axis) * std::cos(seed),
                               std::sin(off_axis) * std::sin(seed), std::cos(off_axis)},
                              .3, .4, 3, random);
    const auto truth = made::true_corners(board, pose, fisheye);
    made::BoardPictureOptions options;
    options.seed = seed;
    const GreyPicture picture = made::render_board(board, pose, fisheye, options);
    const BoardView start = shifted(truth, 1, random);
    const BoardView view = refine_corners(picture, start, board, fisheye);
    const made::CornerErrors errors = made::corner_errors(view, truth);
    EXPECT_GE(errors.count, .9 * static_cast<double>(count_corners(start))) << seed;
    EXPECT_LT(errors.rms_px, .12) << seed;
    EXPECT_LT(errors.max_px, .5) << seed;
  }
}

TEST(RefineCorners, IsNearerToTheTruthWithTheLens) {
  // A large board close by at the rim, little noise: what is left is how edges bend.
  double with = 0, without = 0;
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    const Pose pose = made::make_board_pose(board, {.9, .1, .5}, .2, .2, 1, random);
    const auto truth = made::true_corners(board, pose, fisheye);
    made::BoardPictureOptions options;
    options.noise = .5;
    const GreyPicture picture = made::render_board(board, pose, fisheye, options);
    const BoardView start{"", truth};
    with += made::corner_errors(refine_corners(picture, start, board, fisheye), truth).rms_px;
    without += made::corner_errors(refine_corners(picture, start, board), truth).rms_px;
  }
  EXPECT_LT(with, without);
}

TEST(RefineCorners, DropsWhatIsNoCorner) {
  std::mt19937 random(1);
  const Pose pose = made::make_board_pose(board, {0, 0, 1}, .3, .2, .3, random);
  const GreyPicture picture = made::render_board(board, pose, fisheye);
  BoardView view{"", made::true_corners(board, pose, fisheye)};
  const auto middle_of_square = [&](std::size_t i) {
    const Vec2 a = *view.corners[i];
    const Vec2 b = *view.corners[i + 8];
    return Vec2{(a.x + b.x) / 2, (a.y + b.y) / 2};
  };
  view.corners[9] = middle_of_square(9);
  view.corners[20].reset();
  const BoardView refined = refine_corners(picture, view, board, fisheye);
  EXPECT_FALSE(refined.corners[9]);
  EXPECT_FALSE(refined.corners[20]);
  EXPECT_GE(count_corners(refined), 32u);
}

TEST(RefineCorners, DropsAllInNoise) {
  GreyPicture noise{640, 640, {}};
  std::mt19937 random(1);
  for (int i = 0; i < 640 * 640; ++i) {
    noise.pixels.push_back(static_cast<std::uint8_t>(random() % 256));
  }
  const Pose pose = made::make_board_pose(board, {0, 0, 1}, .3, .2, .3, random);
  const BoardView view{"", made::true_corners(board, pose, fisheye)};
  EXPECT_LE(count_corners(refine_corners(noise, view, board, fisheye)), 2u);
  const GreyPicture even{640, 640, std::vector<std::uint8_t>(640 * 640, 100)};
  EXPECT_EQ(count_corners(refine_corners(even, view, board)), 0u);
}

TEST(RefineCorners, RefusesWhatDoesNotBelongTogether) {
  const GreyPicture even{640, 640, std::vector<std::uint8_t>(640 * 640, 100)};
  const BoardView view{"", std::vector<std::optional<Vec2>>(board.corner_count())};
  EXPECT_THROW(refine_corners(even, {}, board), std::invalid_argument);
  EXPECT_THROW(refine_corners(even, view, board, resized(fisheye, 320, 320)),
               std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::corner_refinement_test
