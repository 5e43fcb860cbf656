// Boards to print.
#include "calibrate/board_drawing.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <opencv2/aruco/charuco.hpp>

#include "calibrate/charuco.h"

namespace calibrate::board_drawing_test {
namespace {

using testing::HasSubstr;

const Board chessboard{Board::Kind::chessboard, 10, 7, .025, 0, ""};
const Board charuco{Board::Kind::charuco, 10, 7, .025, .018, "DICT_5X5_100"};

// The rectangles of a PDF page's "re" operators, in its own millimetres.
std::vector<Rectangle> rectangles_in(const std::string& pdf) {
  std::vector<Rectangle> found;
  std::istringstream lines(pdf);
  for (std::string line; std::getline(lines, line);) {
    if (!line.ends_with(" re")) continue;
    Rectangle r;
    std::istringstream(line) >> r.x >> r.y >> r.width >> r.height;
    found.push_back(r);
  }
  return found;
}

TEST(DrawBoard, AlternatesFromABlackSquare) {
  const GreyPicture drawn = draw_board(chessboard, 10, 5);
  ASSERT_EQ(drawn.width, 11 * 10 + 2 * 5);
  ASSERT_EQ(drawn.height, 8 * 10 + 2 * 5);
  for (int y = 0; y < drawn.height; ++y) {
    for (int x = 0; x < drawn.width; ++x) {
      const bool on_board = x >= 5 && y >= 5 && x < 115 && y < 85;
      const bool black = on_board && ((x - 5) / 10 + (y - 5) / 10) % 2 == 0;
      ASSERT_EQ(drawn.at(y, x), black ? 0 : 255) << x << ", " << y;
    }
  }
}

// OpenCV 4.6 begins with a black square if the number of rows of squares is odd.
TEST(DrawBoard, IsOpenCvsBoard) {
  constexpr int cell = 7;  // a marker of 7 cells in a square of 9
  const int square_px = 9 * cell;
  const Board board{Board::Kind::charuco, 5, 6, .09, .07, "DICT_5X5_100"};
  const GreyPicture drawn = draw_board(board, square_px, 0);
  const auto theirs = cv::aruco::CharucoBoard::create(
      6, 7, .09F, .07F, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
  cv::Mat expected;
  theirs->draw({drawn.width, drawn.height}, expected, 0, 1);
  // Edges of theirs are rounded to pixels in their own way: middles of cells tell.
  for (int y = cell / 2; y < drawn.height; y += cell) {
    for (int x = cell / 2; x < drawn.width; x += cell) {
      ASSERT_EQ(drawn.at(y, x), expected.at<unsigned char>(y, x)) << x << ", " << y;
    }
  }
}

TEST(DrawBoard, SharesPixelsThatAMarkersCellCrosses) {
  Board board = charuco;
  board.marker_m = .0175;
  const GreyPicture drawn = draw_board(board, 20, 0);
  double black = 0;
  for (const std::uint8_t code : drawn.pixels) black += 1 - code / 255.0;
  double area = 0;
  for (const Rectangle& part : black_parts(board)) area += part.width * part.height;
  EXPECT_NEAR(black / (20 * 20), area / (25 * 25), .01 * area / (25 * 25));
}

TEST(MarkerSquares, AreTheWhiteOnes) {
  const std::vector<Square> squares = marker_squares(charuco);
  ASSERT_EQ(squares.size(), 44u);
  EXPECT_EQ(squares[0], (Square{1, 0}));
  EXPECT_EQ(squares[5], (Square{0, 1}));
  EXPECT_EQ(marker_squares(charuco, FirstSquare::white)[0], (Square{0, 0}));
}

TEST(LayOut, TurnsTheSheetAndKeepsTheEdge) {
  const BoardSheet sheet = lay_out(chessboard, paper_of("A4"));
  EXPECT_EQ(sheet.paper.width_mm, 297);
  EXPECT_GE(sheet.left_mm, 15);  // the strip is beside the board: below is no room
  EXPECT_TRUE(sheet.upright_strip);
  EXPECT_GE(sheet.paper.width_mm - sheet.left_mm - 275, 5);
  EXPECT_GE(sheet.top_mm, 5);
  EXPECT_GE(sheet.paper.height_mm - sheet.top_mm - 200, 5);
  EXPECT_FALSE(lay_out(chessboard, paper_of("A3")).upright_strip);
}

TEST(LayOut, SaysWhichPaperABoardNeeds) {
  Board large = chessboard;
  large.square_m = .03;
  try {
    lay_out(large, paper_of("A4"));
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("330.0 x 240.0 mm does not fit on A4"));
    EXPECT_THAT(error.what(), HasSubstr("it needs A3"));
  }
  large.square_m = .2;
  try {
    lay_out(large, paper_of("A0"));
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("a sheet of 2210.0 x 1620.0 mm"));
  }
}

TEST(BorderMm, IsTheLeastWhiteToTheEdgeOrTheText) {
  EXPECT_NEAR(border_mm(lay_out(chessboard, paper_of("A4"))), 4.8, 1e-9);
  EXPECT_NEAR(border_mm(lay_out(chessboard, paper_of("A3"))), 42.3, 1e-9);
}

TEST(PaperWithBorder, LeavesHalfASquare) {
  EXPECT_EQ(paper_with_border(chessboard), "A3");
  for (const double square_m : {.01, .02, .025, .04, .1, .2}) {
    Board board = chessboard;
    board.square_m = square_m;
    const BoardSheet sheet = lay_out(board, paper_of(paper_with_border(board)));
    EXPECT_GE(border_mm(sheet), 500 * square_m - 1e-6) << square_m;
  }
}

TEST(PaperOf, KnowsMillimetres) {
  EXPECT_EQ(paper_of("900x600.5").height_mm, 600.5);
  for (const char* name : {"A7", "a4", "900x", "x600", "900x600mm", "-1x5", "0x5", "nanx5", ""}) {
    EXPECT_THROW(paper_of(name), std::invalid_argument) << name;
  }
}

TEST(PdfOf, HasTheBoardAtItsTrueSize) {
  const BoardSheet sheet = lay_out(charuco, paper_of("A3"));
  const std::string pdf = pdf_of(sheet);
  const std::vector<Rectangle> drawn = rectangles_in(pdf);
  const std::vector<Rectangle> parts = black_parts(charuco);
  ASSERT_EQ(drawn.size(), parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_NEAR(drawn[i].x, sheet.left_mm + parts[i].x, 1e-4);
    EXPECT_NEAR(drawn[i].y, sheet.top_mm + parts[i].y, 1e-4);
    EXPECT_NEAR(drawn[i].width, parts[i].width, 1e-4);
    EXPECT_NEAR(drawn[i].height, parts[i].height, 1e-4);
  }
  // 72 points in an inch, and a page of A3 on its side.
  EXPECT_THAT(pdf, HasSubstr("2.834645669 0 0 -2.834645669 0 841.889764 cm"));
  EXPECT_THAT(pdf, HasSubstr("/MediaBox[0 0 1190.551181 841.889764]"));
  EXPECT_THAT(pdf, HasSubstr("ChArUco board 10x7 inner corners, square 25 mm, marker 18 mm"));
}

TEST(PdfOf, HasItsTableOfObjectsRight) {
  const std::string pdf = pdf_of(lay_out(chessboard, paper_of("A4")));
  const std::size_t table = pdf.find("xref\n0 5\n");
  ASSERT_NE(table, std::string::npos);
  EXPECT_THAT(pdf, HasSubstr("startxref\n" + std::to_string(table) + "\n%%EOF\n"));
  for (int i = 1; i <= 4; ++i) {
    const std::size_t entry = table + 9 + 20 * static_cast<std::size_t>(i);
    const std::size_t at = std::stoul(pdf.substr(entry, 10));
    const std::string name = std::to_string(i) + " 0 obj";
    EXPECT_EQ(pdf.substr(at, name.size()), name);
  }
  const std::size_t stream = pdf.find("stream\n") + 7;
  const std::size_t length = pdf.find("endstream") - stream;
  EXPECT_THAT(pdf, HasSubstr("/Length " + std::to_string(length) + ">>"));
}

TEST(SvgOf, HasTheBoardAtItsTrueSize) {
  const std::string svg = svg_of(lay_out(chessboard, paper_of("A3")));
  EXPECT_THAT(svg, HasSubstr("width=\"420mm\" height=\"297mm\" viewBox=\"0 0 420 297\""));
  EXPECT_THAT(svg, HasSubstr("M72.5000 43.5000h25.0000v25.0000h-25.0000z"));
}

TEST(BlackParts, RefusesWhatCannotBe) {
  Board board = charuco;
  board.dictionary = "DICT_5X5_51";
  EXPECT_THROW(black_parts(board), std::invalid_argument);
  board.dictionary = "DICT_5X5_50";
  board.columns = 20;
  EXPECT_THROW(black_parts(board), std::invalid_argument);
  EXPECT_THROW(draw_board(charuco, 0, 0), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::board_drawing_test
