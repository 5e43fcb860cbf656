// Flat calibration targets.
#include "calibrate/board.h"

#include <gtest/gtest.h>

namespace calibrate {
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
}  // namespace calibrate
