// Straight lines of the scene, and the pixels in which they are seen.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/vec.h"

namespace calibrate {

// A straight edge in a picture.
struct MarkedLine {
  std::string name;
  std::string parallel;      // lines of the same word have one direction in the scene; may be empty
  std::vector<Vec2> pixels;  // on it, in any order
};

// A flat thing with four right angles, by its sides, one after the other around it.
struct MarkedRectangle {
  std::string name;
  std::array<std::size_t, 4> sides{};  // indices of lines
  std::string across;  // the word of parallel lines that are perpendicular to it; may be empty
};

// What is marked in one picture.
struct LineMarks {
  int width = 0;
  int height = 0;
  std::optional<Vec2> centre;           // where the lens's axis meets the picture, if it is known
  std::optional<double> max_angle_rad;  // that the lens sees off its axis
  std::vector<MarkedLine> lines;
  std::vector<MarkedRectangle> rectangles;
};

// Throws std::invalid_argument: sizes below 1, no line, a line of fewer than three pixels or none
// that are 5 px apart, pixels that are not finite or lie beyond 1e6, a rectangle of lines that are
// not there, a word that fewer than two lines have as `parallel`.
void check(const LineMarks& marks);

// Reads [[line]] and [[rectangle]] tables (files.md). Throws std::runtime_error with path, line and
// key.
LineMarks read_line_marks(const std::string& path);

}  // namespace calibrate
