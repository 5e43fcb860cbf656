// Points of charts as marks and lines: the panels of error against time, and of other figures.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "studio/chart.h"
#include "studio/chart_axes.h"
#include "studio/svg.h"

namespace studio {

// Okabe and Ito, "Color Universal Design", 2008: told apart by everybody.
inline constexpr std::array<std::string_view, 8> chart_colours{
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7f7f7f", "#000000"};

// A panel's frame, in pixels; its numbers and names lie outside.
struct PanelPlace {
  double left = 0, top = 0, width = 0, height = 0;
};

// What differs in one way from point to point, joined by a line. Points into its chart.
struct Series {
  std::string scene, method, variant;
  bool peer = false;
  std::string_view colour;
  Mark mark = Mark::disc;
  std::vector<const ChartPoint*> points;
};

// Every method has a colour, and every variant a mark, the same in all scenes; peers, which come
// last, have open marks.
std::vector<Series> series_of(const Chart& chart);

// In the order in which points first have them; one without a name if there are no points.
std::vector<std::string> scenes_of(const Chart& chart);

// Of the errors of a chart, and of figures beside them.
Axis axis_of(const Chart& chart, const std::vector<double>& errors, double from, double to);

// A scene's points, error against time, with its front.
void draw_scene(Svg& svg,
                const Chart& chart,
                const std::vector<Series>& all,
                const std::string& scene,
                const PanelPlace& place,
                double text_size);
void draw_figures(Svg& svg,
                  const Chart& chart,
                  const std::vector<Series>& all,
                  const FigurePanel& panel,
                  const PanelPlace& place);
void draw_legend(
    Svg& svg, const Chart& chart, const std::vector<Series>& all, double left, double top);

}  // namespace studio
