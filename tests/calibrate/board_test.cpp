// Flat calibration targets.
#include "calibrate/board.h"

#include <gtest/gtest.h>

namespace calibrate::board_test {
namespace {

TEST(Board, CountsItsCornersRowByRow) {
  const Board board{Board::Kind::chessboard, 9, 6, .025, 0, ""};
  EXPECT_EQ(board.corner_count(), 54u);
  EXPECT_EQ(corner_of(board, 0), (Vec3{0, 0, 0}));
  EXPECT_EQ(corner_of(board, 8), (Vec3{.2, 0, 0}));
  EXPECT_EQ(corner_of(board, 9), (Vec3{0, .025, 0}));
}

TEST(Board, KnowsHowManyCornersWereSeen) {
  EXPECT_EQ(count_corners({"a.png", {Vec2{1, 2}, std::nullopt, Vec2{3, 4}}}), 2u);
}

// Whichever corners a ChArUco board shows, its middle is where it is.
TEST(Board, KnowsItsMiddleFromThoseCornersThatWereSeen) {
  const Board board{Board::Kind::charuco, 9, 6, .025, .018, "DICT_5X5_100"};
  const auto seen = [](Vec3 p) {  // tilted, before a pinhole
    const double depth = 0.6 + 0.7 * p.x - 0.4 * p.y;
    return Vec2{400 + 900 * (p.x - .1) / depth, 300 + 900 * (p.y + .2 * p.x) / depth};
  };
  const Vec2 truth = seen({.1, .0625, 0});
  BoardView view{"", {}};
  for (std::size_t i = 0; i < board.corner_count(); ++i)
    view.corners.push_back(seen(corner_of(board, i)));
  for (const std::size_t first : {0U, 8U, 20U}) {
    BoardView part = view;
    for (std::size_t i = 0; i < first; ++i) part.corners[i].reset();
    const auto middle = middle_of(board, part);
    ASSERT_TRUE(middle) << first;
    EXPECT_NEAR(middle->x, truth.x, 1e-6) << first;
    EXPECT_NEAR(middle->y, truth.y, 1e-6) << first;
  }
  for (std::size_t i = 0; i < 27; ++i) view.corners[i].reset();  // the upper half
  EXPECT_FALSE(middle_of(board, view));
}

TEST(Board, KnowsAfterWhichTurnItLooksTheSame) {
  const auto of = [](int columns, int rows) {
    return quarters_alike({Board::Kind::chessboard, columns, rows, .025, 0, ""});
  };
  EXPECT_EQ(of(9, 6), 0);
  EXPECT_EQ(of(8, 6), 2);
  EXPECT_EQ(of(9, 7), 2);
  EXPECT_EQ(of(7, 7), 2);
  EXPECT_EQ(of(8, 8), 1);
  EXPECT_EQ(quarters_alike({Board::Kind::charuco, 8, 6, .025, .018, "DICT_5X5_100"}), 0);
}

TEST(Board, IsRefusedIfItCannotBe) {
  const Board good{Board::Kind::charuco, 9, 6, .025, .018, "DICT_5X5_100"};
  EXPECT_NO_THROW(check(good));
  Board board = good;
  board.columns = 2;
  EXPECT_THROW(check(board), std::invalid_argument);
  board = good;
  board.rows = 201;
  EXPECT_THROW(check(board), std::invalid_argument);
  board = good;
  board.square_m = 0;
  EXPECT_THROW(check(board), std::invalid_argument);
  board = good;
  board.marker_m = .025;
  EXPECT_THROW(check(board), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::board_test
