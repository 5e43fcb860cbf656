// platelight calibrate board: a calibration target to print.
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/board.h"
#include "calibrate/board_drawing.h"
#include "capture/files.h"
#include "studio/commands/board_options.h"
#include "studio/commands/commands.h"
#include "studio/json_text.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

struct DrawingOptions {
  BoardOptions board;
  std::string paper = "A4";
  std::string out;
  std::string pdf;
};

void calibrate_board(const DrawingOptions& options, Console& console) {
  if (options.out.empty() == options.pdf.empty()) {
    throw UsageError("name one file: -o FILE.pdf or FILE.svg, or --pdf FILE");
  }
  const bool pdf = !options.pdf.empty() || options.out.ends_with(".pdf");
  if (!pdf && !options.out.ends_with(".svg")) {
    throw UsageError("-o must name a .pdf or a .svg file");
  }
  const calibrate::Board board = board_of(options.board);
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

  Json figures{{"kind", options.board.charuco ? "charuco" : "chessboard"},
               {"columns", board.columns},
               {"rows", board.rows},
               {"square_m", board.square_m}};
  if (options.board.charuco) {
    figures["marker_m"] = board.marker_m;
    figures["dictionary"] = board.dictionary;
  }
  figures["paper_mm"] = {sheet.paper.width_mm, sheet.paper.height_mm};
  console.figures(json_text(figures));
  constexpr double mm = 1000;
  console.say(fmt::format("{}: {}x{} inner corners, squares of {} mm{}, on {}", path, board.columns,
                          board.rows, mm * board.square_m,
                          options.board.charuco ? fmt::format(", markers of {} mm of {}",
                                                              mm * board.marker_m, board.dictionary)
                                                : "",
                          sheet.paper.name));
  if (const double border = border_mm(sheet), half = mm * board.square_m / 2; border < half) {
    console.warn(fmt::format(
        "only {:.1f} mm of white are left around the board, but finding it needs half a square, "
        "{:.1f} mm: draw it with --paper {}, or glue it onto something white",
        border, half, calibrate::paper_with_border(board)));
  }
  console.say("print it at 100 %, and measure its ruler: it must be 100 mm long");
}

}  // namespace

Command calibrate_board_command() {
  return {
      "calibrate board", "Draw a board to print, at its true size",
      "platelight calibrate board --board 10x7 --square 0.025 --charuco --paper A3 --pdf board.pdf",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<DrawingOptions>();
        declare(arguments, o->board);
        arguments.option("--paper", o->paper, "A5 to A0, or millimetres: 900x600 (A4)");
        arguments.option("-o,--out", o->out, ".pdf or .svg file");
        arguments.option("--pdf", o->pdf, "PDF file, whatever its name");
        return [o](Console& console) { calibrate_board(*o, console); };
      }};
}

}  // namespace studio
