// platelight calibrate board: a calibration target to print.
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/board.h"
#include "calibrate/board_drawing.h"
#include "capture/files.h"
#include "studio/commands/commands.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

struct BoardOptions {
  std::string corners = "10x7";
  std::optional<double> square_m;
  bool charuco = false;
  std::optional<double> marker_m;
  std::string dictionary;
  std::string paper = "A4";
  std::string out;
  std::string pdf;
};

int whole_number(const std::string& text, const std::string& option) {
  constexpr std::size_t most_digits = 4;
  if (text.empty() || text.size() > most_digits ||
      text.find_first_not_of("0123456789") != std::string::npos) {
    throw UsageError(fmt::format("--board counts inner corners, such as 10x7, not {}", option));
  }
  return std::stoi(text);
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
  return board;
}

void calibrate_board(const BoardOptions& options, Console& console) {
  if (options.out.empty() == options.pdf.empty()) {
    throw UsageError("name one file: -o FILE.pdf or FILE.svg, or --pdf FILE");
  }
  const bool pdf = !options.pdf.empty() || options.out.ends_with(".pdf");
  if (!pdf && !options.out.ends_with(".svg")) {
    throw UsageError("-o must name a .pdf or a .svg file");
  }
  const calibrate::Board board = board_of(options);
  calibrate::BoardSheet sheet;
  std::string drawing;
  try {
    sheet = calibrate::lay_out(board, calibrate::paper_of(options.paper));
    drawing = pdf ? pdf_of(sheet) : svg_of(sheet);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  const std::string& path = options.pdf.empty() ? options.out : options.pdf;
  capture::write_file(path, std::as_bytes(std::span(drawing)));

  Json figures{{"kind", options.charuco ? "charuco" : "chessboard"},
               {"columns", board.columns},
               {"rows", board.rows},
               {"square_m", board.square_m}};
  if (options.charuco) {
    figures["marker_m"] = board.marker_m;
    figures["dictionary"] = board.dictionary;
  }
  figures["paper_mm"] = {sheet.paper.width_mm, sheet.paper.height_mm};
  console.figures(figures.dump(2));
  constexpr double mm = 1000;
  console.say(fmt::format("{}: {}x{} inner corners, squares of {} mm{}, on {}", path, board.columns,
                          board.rows, mm * board.square_m,
                          options.charuco ? fmt::format(", markers of {} mm of {}",
                                                        mm * board.marker_m, board.dictionary)
                                          : "",
                          sheet.paper.name));
  console.say("print it at 100 %, and measure its ruler: it must be 100 mm long");
}

}  // namespace

Command calibrate_board_command() {
  return {"calibrate board", "Draw a board to print, at its true size",
          "platelight calibrate board --board 10x7 --square 0.025 --charuco --pdf board.pdf",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<BoardOptions>();
            arguments.option("--board", o->corners, "inner corners: columns x rows (10x7)");
            arguments.option("--square", o->square_m, 1e-4, 9.99,
                             "side of a square in metres (0.025)");
            arguments.flag("--charuco", o->charuco,
                           "with markers, so that parts of it are recognised as well");
            arguments.option("--marker", o->marker_m, 1e-4, 9.99,
                             "side of a marker in metres (0.72 of a square)");
            arguments.option("--dictionary", o->dictionary,
                             "OpenCV's name of the set of markers (DICT_5X5_100)");
            arguments.option("--paper", o->paper, "A5 to A0, or millimetres: 900x600 (A4)");
            arguments.option("-o,--out", o->out, ".pdf or .svg file");
            arguments.option("--pdf", o->pdf, "PDF file, whatever its name");
            return [o](Console& console) { calibrate_board(*o, console); };
          }};
}

}  // namespace studio
