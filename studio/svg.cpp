// SVG text.
#include "studio/svg.h"

#include <utility>

#include <fmt/format.h>

namespace studio {
namespace {

constexpr std::string_view font = "DejaVu Sans, Verdana, sans-serif";

std::string_view name_of(Anchor anchor) {
  return anchor == Anchor::start ? "start" : anchor == Anchor::middle ? "middle" : "end";
}

std::string path_of(const std::vector<std::pair<double, double>>& points) {
  std::string list;
  for (const auto& [x, y] : points) list += fmt::format("{:.2f},{:.2f} ", x, y);
  if (!list.empty()) list.pop_back();
  return list;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

double text_width(std::string_view text, double size) {
  std::size_t letters = 0;
  for (const char c : text) letters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  return static_cast<double>(letters) * size * 0.6;
}

Svg::Svg(double width, double height) {
  body_ = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"{2}\">\n",
      width, height, font);
}

void Svg::line(double x0, double y0, double x1, double y1, std::string_view colour, double width) {
  body_ += fmt::format(
      "<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"{}\" "
      "stroke-width=\"{:.2f}\"/>\n",
      x0, y0, x1, y1, colour, width);
}

void Svg::polyline(const std::vector<std::pair<double, double>>& points,
                   std::string_view colour,
                   double width,
                   std::string_view dashes) {
  body_ += fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2f}\" "
      "stroke-linejoin=\"round\"{}/>\n",
      path_of(points), colour, width,
      dashes.empty() ? "" : fmt::format(" stroke-dasharray=\"{}\"", dashes));
}

void Svg::rectangle(double x, double y, double width, double height, std::string_view fill) {
  body_ += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"/>\n", x, y,
      width, height, fill);
}

void Svg::frame(double x, double y, double width, double height, std::string_view colour) {
  body_ += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"none\" "
      "stroke=\"{}\"/>\n",
      x, y, width, height, colour);
}

void Svg::text(double x, double y, std::string_view text, const TextStyle& style) {
  const std::string turned =
      style.upwards ? fmt::format(" transform=\"rotate(-90 {:.2f} {:.2f})\"", x, y) : "";
  body_ += fmt::format(
      "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\"{}{}>{}"
      "</text>\n",
      x, y, style.size, name_of(style.anchor), style.colour,
      style.bold ? " font-weight=\"bold\"" : "", turned, escaped(text));
}

void Svg::mark(double x, double y, Mark mark, double r, std::string_view colour, bool filled) {
  const bool solid = filled && mark != Mark::cross;
  const std::string paint =
      fmt::format("fill=\"{}\" stroke=\"{}\" stroke-width=\"{}\"", solid ? colour : "none",
                  solid ? "#ffffff" : colour, solid ? 0.8 : 1.8);
  const auto shape = [&](std::string_view path) {
    body_ += fmt::format("<path d=\"{}\" {}/>\n", path, paint);
  };
  switch (mark) {
    case Mark::disc:
      body_ +=
          fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" {}/>\n", x, y, r, paint);
      break;
    case Mark::square:
      shape(fmt::format("M{0:.2f} {1:.2f}h{2:.2f}v{2:.2f}h-{2:.2f}z", x - r, y - r, 2 * r));
      break;
    case Mark::diamond:
      shape(fmt::format("M{0:.2f} {1:.2f}l{2:.2f} {2:.2f}l-{2:.2f} {2:.2f}l-{2:.2f} -{2:.2f}z", x,
                        y - 1.3 * r, 1.3 * r));
      break;
    case Mark::triangle:
      shape(fmt::format("M{0:.2f} {1:.2f}l{2:.2f} {3:.2f}h-{4:.2f}z", x, y - 1.2 * r, 1.15 * r,
                        2 * r, 2.3 * r));
      break;
    case Mark::cross:
      shape(fmt::format("M{0:.2f} {1:.2f}l{2:.2f} {2:.2f}m0 -{2:.2f}l-{2:.2f} {2:.2f}", x - r,
                        y - r, 2 * r));
      break;
  }
}

std::string Svg::finish() const { return body_ + "</svg>\n"; }

}  // namespace studio
