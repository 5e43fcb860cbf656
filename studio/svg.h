// Drawing in SVG, with numbers written the same way always.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace studio {

// Text as SVG and HTML take it.
std::string escaped(std::string_view text);

// Where text stands to its point.
enum class Anchor { start, middle, end };

struct TextStyle {
  double size = 13;
  Anchor anchor = Anchor::start;
  std::string_view colour = "#222222";
  bool bold = false;
  bool upwards = false;  // turned a quarter to the left
};

enum class Mark { disc, square, diamond, triangle, cross };

// Collects shapes; coordinates are pixels, x to the right, y down.
class Svg {
 public:
  Svg(double width, double height);

  void line(double x0, double y0, double x1, double y1, std::string_view colour, double width = 1);
  // `dashes` as SVG's stroke-dasharray: "4 3"; "" = solid.
  void polyline(const std::vector<std::pair<double, double>>& points,
                std::string_view colour,
                double width,
                std::string_view dashes = "");
  void rectangle(double x, double y, double width, double height, std::string_view fill);
  void frame(double x, double y, double width, double height, std::string_view colour);
  void text(double x, double y, std::string_view text, const TextStyle& style = {});
  // Filled, or its outline; a cross is all outline.
  void mark(
      double x, double y, Mark mark, double radius, std::string_view colour, bool filled = true);

  std::string finish() const;

 private:
  std::string body_;
};

// About the width of a text in the charts' font, in pixels.
double text_width(std::string_view text, double size);

}  // namespace studio
