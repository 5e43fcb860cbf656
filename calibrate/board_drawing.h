// Boards to print, at their true size.
#pragma once

#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/grey_picture.h"

namespace calibrate {

// Millimetres.
struct Rectangle {
  double x = 0, y = 0, width = 0, height = 0;
};

// What of a board is black: its squares and the cells of its markers, none over another, from the
// top left of its first square on, which is black. Markers are numbered row by row from 0. Throws
// std::invalid_argument if the board cannot be, or its dictionary is unknown or has too few
// markers.
std::vector<Rectangle> black_parts(const Board& board);

// Black on white with a white border, (rows + 1) squares and two borders high. Throws
// std::invalid_argument as black_parts(), and if a square is not from 1 to 1000 pixels.
GreyPicture draw_board(const Board& board, int square_px, int border_px);

struct Paper {
  std::string name;
  double width_mm = 0;
  double height_mm = 0;
};

// A5 to A0, upright, or millimetres such as "900x600". Throws std::invalid_argument for other
// names.
Paper paper_of(const std::string& name);

// A board on a sheet, which is turned to its side if that fits better.
struct BoardSheet {
  Board board;
  Paper paper;         // as it lies
  double left_mm = 0;  // of the board's first square
  double top_mm = 0;
  bool upright_strip = false;  // title and ruler stand to the left, not below
};

// Throws std::invalid_argument if the board cannot be, and std::runtime_error if it does not fit,
// saying on which paper it would.
BoardSheet lay_out(const Board& board, const Paper& paper);

// The least white around the board, to the sheet's edge or to title and ruler, millimetres. Finders
// need half a square.
double border_mm(const BoardSheet& sheet);

// The name, as paper_of() takes it, of a paper on which half a square stays white. Throws
// std::invalid_argument if the board cannot be.
std::string paper_with_border(const Board& board);

// The sheet with a title that tells the board's numbers, and a ruler of 100 mm to check the printer
// with (left out on papers too small for it).
std::string svg_of(const BoardSheet& sheet);
std::string pdf_of(const BoardSheet& sheet);

}  // namespace calibrate
