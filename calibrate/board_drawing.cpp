// What is black on a board, and how it lies on paper.
#include "calibrate/board_drawing.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "calibrate/charuco.h"
#include "calibrate/marker_bits.h"

namespace calibrate {
namespace {

constexpr double mm = 1000;        // in a metre
constexpr double edge_mm = 5;      // that printers leave white
constexpr double strip_mm = 10;    // of title and ruler
constexpr double slack_mm = 1e-6;  // of sums of millimetres

const std::array papers{
    Paper{"A5", 148, 210}, Paper{"A4", 210, 297}, Paper{"A3", 297, 420},
    Paper{"A2", 420, 594}, Paper{"A1", 594, 841}, Paper{"A0", 841, 1189},
};

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

double width_mm(const Board& board) { return (board.columns + 1) * board.square_m * mm; }
double height_mm(const Board& board) { return (board.rows + 1) * board.square_m * mm; }

// The layout on a sheet as it lies, or nothing.
std::optional<BoardSheet> fit(const Board& board, const Paper& paper) {
  const double spare_x = paper.width_mm - width_mm(board) - 2 * edge_mm;
  const double spare_y = paper.height_mm - height_mm(board) - 2 * edge_mm;
  if (spare_x >= -slack_mm && spare_y >= strip_mm - slack_mm) {
    return BoardSheet{board, paper, edge_mm + spare_x / 2, edge_mm + (spare_y - strip_mm) / 2,
                      false};
  }
  if (spare_x >= strip_mm - slack_mm && spare_y >= -slack_mm) {
    return BoardSheet{board, paper, edge_mm + strip_mm + (spare_x - strip_mm) / 2,
                      edge_mm + spare_y / 2, true};
  }
  return std::nullopt;
}

std::optional<BoardSheet> fit_either_way(const Board& board, const Paper& paper) {
  const Paper turned{paper.name, paper.height_mm, paper.width_mm};
  const bool wide = board.columns > board.rows;
  const bool lies_wide = paper.width_mm > paper.height_mm;
  auto sheet = fit(board, wide == lies_wide ? paper : turned);
  return sheet ? sheet : fit(board, wide == lies_wide ? turned : paper);
}

}  // namespace

std::vector<Rectangle> black_parts(const Board& board) {
  check(board);
  const double side = board.square_m * mm;
  std::vector<Rectangle> parts;
  for (int row = 0; row <= board.rows; ++row) {
    for (int column = 0; column <= board.columns; ++column) {
      if ((row + column) % 2 == 0) parts.push_back({column * side, row * side, side, side});
    }
  }
  if (board.kind != Board::Kind::charuco) return parts;
  const std::vector<Square> squares = marker_squares(board);
  const std::vector<MarkerBits> markers =
      marker_bits(board.dictionary, static_cast<int>(squares.size()));
  const double gap = (board.square_m - board.marker_m) / 2 * mm;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const MarkerBits& bits = markers[i];
    const double cell = board.marker_m * mm / bits.side;
    const double left = squares[i].column * side + gap;
    const double top = squares[i].row * side + gap;
    for (int row = 0; row < bits.side; ++row) {
      for (int first = 0; first < bits.side; ++first) {
        if (bits.is_white(row, first)) continue;
        int end = first;
        while (end < bits.side && !bits.is_white(row, end)) ++end;
        parts.push_back({left + first * cell, top + row * cell, (end - first) * cell, cell});
        first = end;
      }
    }
  }
  return parts;
}

GreyPicture draw_board(const Board& board, int square_px, int border_px) {
  constexpr int max_square_px = 1000;
  if (square_px < 1 || square_px > max_square_px || border_px < 0) {
    throw std::invalid_argument("a board is drawn with squares of 1 to 1000 pixels");
  }
  const std::vector<Rectangle> parts = black_parts(board);
  const int width = (board.columns + 1) * square_px + 2 * border_px;
  const int height = (board.rows + 1) * square_px + 2 * border_px;
  GreyPicture picture{width, height, {}};
  std::vector<double> black(picture.index(height, 0), 0);  // share of each pixel
  const double scale = square_px / (board.square_m * mm);
  const auto covered = [](double begin, double end, int pixel) {
    return std::max(0.0, std::min(end, pixel + 1.0) - std::max(begin, static_cast<double>(pixel)));
  };
  for (const Rectangle& part : parts) {
    // Rounded, so that what should end at a pixel's edge does.
    const auto place = [&](double at) { return std::round((border_px + at * scale) * 1e6) / 1e6; };
    const double left = place(part.x);
    const double right = place(part.x + part.width);
    const double top = place(part.y);
    const double bottom = place(part.y + part.height);
    for (int y = static_cast<int>(top); y < bottom; ++y) {
      for (int x = static_cast<int>(left); x < right; ++x) {
        black[picture.index(y, x)] += covered(left, right, x) * covered(top, bottom, y);
      }
    }
  }
  picture.pixels.reserve(black.size());
  for (const double share : black) {
    picture.pixels.push_back(
        static_cast<std::uint8_t>(std::lround(255 * (1 - std::clamp(share, 0.0, 1.0)))));
  }
  return picture;
}

Paper paper_of(const std::string& name) {
  for (const Paper& paper : papers) {
    if (paper.name == name) return paper;
  }
  constexpr double max_mm = 5000;  // of what PDF viewers show
  const std::size_t cross = name.find('x');
  if (cross != std::string::npos) {
    Paper paper{name + " mm", 0, 0};
    const char* const end = name.data() + name.size();
    const auto width = std::from_chars(name.data(), end, paper.width_mm);
    const auto height = std::from_chars(name.data() + cross + 1, end, paper.height_mm);
    if (width.ec == std::errc() && width.ptr == name.data() + cross && height.ec == std::errc() &&
        height.ptr == end && std::min(paper.width_mm, paper.height_mm) > 0 &&
        std::max(paper.width_mm, paper.height_mm) <= max_mm) {
      return paper;
    }
  }
  throw std::invalid_argument("there is no paper \"" + name +
                              "\"; known are A5 to A0, and millimetres such as 900x600");
}

BoardSheet lay_out(const Board& board, const Paper& paper) {
  check(board);
  if (auto sheet = fit_either_way(board, paper)) return *sheet;
  std::string advice = "a sheet of " + number(width_mm(board) + 2 * edge_mm) + " x " +
                       number(height_mm(board) + 2 * edge_mm + strip_mm) + " mm";
  for (const Paper& larger : papers) {
    if (fit_either_way(board, larger)) {
      advice = larger.name;
      break;
    }
  }
  throw std::runtime_error("a board of " + number(width_mm(board)) + " x " +
                           number(height_mm(board)) + " mm does not fit on " + paper.name +
                           " with " + number(edge_mm) + " mm around and a line of text: it needs " +
                           advice);
}

std::string paper_with_border(const Board& board) {
  check(board);
  const double half_mm = board.square_m * mm / 2;
  for (const Paper& paper : papers) {
    const auto sheet = fit_either_way(board, paper);
    if (sheet && border_mm(*sheet) >= half_mm - slack_mm) return paper.name;
  }
  const auto whole = [](double size_mm) { return std::to_string(std::lround(std::ceil(size_mm))); };
  return whole(width_mm(board) + 2 * half_mm) + "x" +
         whole(height_mm(board) + 2 * (half_mm + edge_mm + strip_mm));
}

}  // namespace calibrate
