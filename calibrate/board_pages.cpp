// Boards as SVG and PDF.
#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include "calibrate/board_drawing.h"

namespace calibrate {
namespace {

constexpr double points_in_mm = 72 / 25.4;
constexpr double margin_mm = 5;
constexpr double text_mm = 3;  // size of letters
constexpr double ruler_mm = 100;
constexpr double tick_mm = 10;
constexpr double line_mm = 0.2;

[[gnu::format(printf, 1, 2)]] std::string print(const char* format, ...) {
  std::array<char, 256> text{};
  va_list values;
  va_start(values, format);
  std::vsnprintf(text.data(), text.size(), format, values);
  va_end(values);
  return text.data();
}

// Short numbers: 25, 12.5.
std::string brief(double value) { return print("%.6g", value); }

std::string title_of(const Board& board) {
  std::string title = board.kind == Board::Kind::charuco ? "ChArUco board " : "Chessboard ";
  title += print("%dx%d inner corners, square %s mm", board.columns, board.rows,
                 brief(board.square_m * 1000).c_str());
  if (board.kind == Board::Kind::charuco) {
    title += ", marker " + brief(board.marker_m * 1000) + " mm, " + board.dictionary;
  }
  return title;
}

// Where title and ruler stand. In their own frame x runs along the text, y to the next line.
struct Strip {
  double x = 0, y = 0;   // of its begin on the sheet
  bool upright = false;  // it runs upwards
  double length = 0;
  bool has_ruler() const { return length >= ruler_mm; }
};

Strip strip_of(const BoardSheet& sheet) {
  if (sheet.upright_strip) {
    return {margin_mm, sheet.paper.height_mm - margin_mm, true,
            sheet.paper.height_mm - 2 * margin_mm};
  }
  return {margin_mm, sheet.paper.height_mm - margin_mm - 2 * text_mm - line_mm, false,
          sheet.paper.width_mm - 2 * margin_mm};
}

// Lines of the ruler within the strip, as x0 y0 x1 y1.
std::vector<std::array<double, 4>> ruler_lines() {
  constexpr double base = 2 * text_mm;
  std::vector<std::array<double, 4>> lines{{0, base, ruler_mm, base}};
  for (double x = 0; x <= ruler_mm; x += tick_mm) lines.push_back({x, base, x, base - 1.5});
  return lines;
}

constexpr const char* ruler_text = "100 mm: measure it, printers scale";

}  // namespace

double border_mm(const BoardSheet& sheet) {
  constexpr double strip_mm = margin_mm + 2 * text_mm + line_mm;
  const double width_mm = (sheet.board.columns + 1) * sheet.board.square_m * 1000;
  const double height_mm = (sheet.board.rows + 1) * sheet.board.square_m * 1000;
  const double left = sheet.left_mm - (sheet.upright_strip ? strip_mm : 0);
  const double right = sheet.paper.width_mm - sheet.left_mm - width_mm;
  const double bottom =
      sheet.paper.height_mm - sheet.top_mm - height_mm - (sheet.upright_strip ? 0 : strip_mm);
  return std::min({left, right, sheet.top_mm, bottom});
}

std::string svg_of(const BoardSheet& sheet) {
  const Paper& paper = sheet.paper;
  std::string svg = print(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%smm\" height=\"%smm\" "
      "viewBox=\"0 0 %s %s\">\n",
      brief(paper.width_mm).c_str(), brief(paper.height_mm).c_str(), brief(paper.width_mm).c_str(),
      brief(paper.height_mm).c_str());
  svg += "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<path d=\"";
  for (const Rectangle& part : black_parts(sheet.board)) {
    svg += print("M%.4f %.4fh%.4fv%.4fh%.4fz\n", sheet.left_mm + part.x, sheet.top_mm + part.y,
                 part.width, part.height, -part.width);
  }
  svg += "\"/>\n";
  const Strip strip = strip_of(sheet);
  svg += print("<g transform=\"translate(%.4f %.4f)%s\" font-family=\"sans-serif\" ", strip.x,
               strip.y, strip.upright ? " rotate(-90)" : "");
  svg += print("font-size=\"%.1f\" stroke-width=\"%.1f\">\n", text_mm, line_mm);
  svg += print("<text x=\"0\" y=\"%.1f\">", text_mm) + title_of(sheet.board) + "</text>\n";
  if (strip.has_ruler()) {
    for (const auto& [x0, y0, x1, y1] : ruler_lines()) {
      svg += print("<path d=\"M%.4f %.4fL%.4f %.4f\" stroke=\"#000\"/>\n", x0, y0, x1, y1);
    }
    svg += print("<text x=\"%.1f\" y=\"%.1f\">%s</text>\n", ruler_mm + 2, 2 * text_mm, ruler_text);
  }
  return svg + "</g>\n</svg>\n";
}

// Adobe, "PDF Reference", sixth edition, version 1.7: the least file there can be, of four objects.
std::string pdf_of(const BoardSheet& sheet) {
  const double height_pt = sheet.paper.height_mm * points_in_mm;
  // Millimetres from the top left from here on.
  std::string drawing = print("%.9f 0 0 %.9f 0 %.6f cm\n", points_in_mm, -points_in_mm, height_pt);
  for (const Rectangle& part : black_parts(sheet.board)) {
    drawing += print("%.4f %.4f %.4f %.4f re\n", sheet.left_mm + part.x, sheet.top_mm + part.y,
                     part.width, part.height);
  }
  drawing += "f\n";
  const Strip strip = strip_of(sheet);
  drawing +=
      print(strip.upright ? "q 0 -1 1 0 %.4f %.4f cm %.1f w\n" : "q 1 0 0 1 %.4f %.4f cm %.1f w\n",
            strip.x, strip.y, line_mm);
  const auto text = [&](double x, double y, const std::string& words) {
    drawing += print("BT /F %.1f Tf 1 0 0 -1 %.4f %.4f Tm (", text_mm, x, y) + words + ") Tj ET\n";
  };
  text(0, text_mm, title_of(sheet.board));
  if (strip.has_ruler()) {
    for (const auto& [x0, y0, x1, y1] : ruler_lines()) {
      drawing += print("%.4f %.4f m %.4f %.4f l S\n", x0, y0, x1, y1);
    }
    text(ruler_mm + 2, 2 * text_mm, ruler_text);
  }
  drawing += "Q\n";

  const std::array objects{
      std::string("<</Type/Catalog/Pages 2 0 R>>"),
      std::string("<</Type/Pages/Kids[3 0 R]/Count 1>>"),
      print("<</Type/Page/Parent 2 0 R/MediaBox[0 0 %.6f %.6f]/Contents 4 0 R"
            "/Resources<</Font<</F<</Type/Font/Subtype/Type1/BaseFont/Helvetica>>>>>>>>",
            sheet.paper.width_mm * points_in_mm, height_pt),
      print("<</Length %zu>>stream\n", drawing.size()) + drawing + "endstream",
  };
  std::string pdf = "%PDF-1.4\n";
  std::string table = print("xref\n0 %zu\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += print("%010zu 00000 n \n", pdf.size());
    pdf += print("%zu 0 obj\n", i + 1) + objects[i] + "\nendobj\n";
  }
  const std::size_t table_begin = pdf.size();
  return pdf + table + print("trailer<</Size %zu/Root 1 0 R>>\n", objects.size() + 1) +
         print("startxref\n%zu\n%%%%EOF\n", table_begin);
}

}  // namespace calibrate
