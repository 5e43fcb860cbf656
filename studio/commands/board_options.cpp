// Which board: options that several commands share.
#include "studio/commands/board_options.h"

#include <cmath>

#include <fmt/format.h>

#include "calibrate/board_drawing.h"

namespace studio {
namespace {

int whole_number(const std::string& text, const std::string& option) {
  constexpr std::size_t most_digits = 4;
  if (text.empty() || text.size() > most_digits ||
      text.find_first_not_of("0123456789") != std::string::npos) {
    throw UsageError(fmt::format("--board counts inner corners, such as 10x7, not {}", option));
  }
  return std::stoi(text);
}

}  // namespace

void declare(Arguments& arguments, BoardOptions& options) {
  arguments.option("--board", options.corners, "inner corners: columns x rows (10x7)");
  arguments.option("--square", options.square_m, 1e-4, 9.99, "side of a square in metres (0.025)");
  arguments.flag("--charuco", options.charuco,
                 "with markers, so that parts of it are recognised as well");
  arguments.option("--marker", options.marker_m, 1e-4, 9.99,
                   "side of a marker in metres (0.72 of a square)");
  arguments.option("--dictionary", options.dictionary,
                   "OpenCV's name of the set of markers (DICT_5X5_100)");
}

calibrate::Board board_of(const BoardOptions& options) {
  const std::size_t cross = options.corners.find('x');
  const std::string rows = cross == std::string::npos ? "" : options.corners.substr(cross + 1);
  calibrate::Board board;
  board.columns = whole_number(options.corners.substr(0, cross), options.corners);
  board.rows = whole_number(rows, options.corners);
  constexpr double usual_square_m = 0.025;
  board.square_m = options.square_m.value_or(usual_square_m);
  if (options.charuco) {
    constexpr double usual_marker = 0.72;  // of a square
    constexpr double tenth_mm = 1e4;
    board.kind = calibrate::Board::Kind::charuco;
    board.marker_m =
        options.marker_m.value_or(std::floor(usual_marker * board.square_m * tenth_mm) / tenth_mm);
    if (!options.dictionary.empty()) board.dictionary = options.dictionary;
  } else if (options.marker_m || !options.dictionary.empty()) {
    throw UsageError("--marker and --dictionary are of ChArUco boards: add --charuco");
  }
  try {
    black_parts(board);  // its dictionary, too
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  return board;
}

}  // namespace studio
