// Charts as pictures.
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "studio/chart.h"
#include "studio/chart_axes.h"
#include "studio/chart_points.h"
#include "studio/svg.h"

namespace studio {
namespace {

constexpr std::string_view ink = chart_ink;
constexpr std::string_view faint_ink = faint_chart_ink;

constexpr double margin = 28;
constexpr double title_height = 74;
constexpr double panel_left = 92;
constexpr double panel_width = 760;
constexpr double panel_height = 500;
constexpr double legend_gap = 28;
constexpr double legend_width = 240;
constexpr double axis_height = 62;
constexpr double small_width = 420;  // of the panels below the main one
constexpr double small_height = 230;
constexpr double small_pitch = 536;
constexpr double small_row = 350;
constexpr double scene_height = 300;  // of the panels of error against time, if there are several
constexpr double scene_row = 420;

void draw_stressor(
    Svg& svg, const Chart& chart, const Stressor& stressor, double left, double top) {
  std::vector<double> values;
  std::vector<double> errors;
  for (const StressorSample& s : stressor.samples) {
    values.push_back(s.value);
    errors.push_back(s.error);
    if (s.reported_error) errors.push_back(*s.reported_error);
  }
  Axis x = log_axis(values, left, left + small_width);
  if (!stressor.logarithmic && !values.empty()) {
    const auto [low, high] = std::ranges::minmax(values);
    x = {low, high > low ? high : low + 1, false, left, left + small_width};
  }
  const auto figure_of = [](const StressorSample& s, const std::string& name) {
    const auto found = std::ranges::find(s.figures, name, [](const auto& f) { return f.first; });
    return found == s.figures.end() ? 0.0 : found->second;
  };
  for (const auto& [figure, word] : stressor.beside) {
    for (const StressorSample& s : stressor.samples) {
      if (const double value = figure_of(s, figure); value > 0) errors.push_back(value);
    }
  }
  if (stressor.floor > 0) errors.push_back(stressor.floor);
  Axis y = axis_of(chart, errors, top + small_height, top);
  if (!stressor.beside.empty()) {
    // Above the lines there is room for their names.
    const double most = errors.empty() ? 0 : *std::ranges::max_element(errors);
    y = {0, most > 0 ? 1.6 * most : 1, false, top + small_height, top};
  }
  const std::string name = stressor.unit.empty()
                               ? stressor.stressor
                               : fmt::format("{}, {}", stressor.stressor, stressor.unit);
  draw_axes(svg, x, y, name,
            stressor.error_name.empty() ? chart.stressed_error_name : stressor.error_name, 11.5);
  for (std::size_t i = 0; i < stressor.beside.size(); ++i) {
    const auto& colour = chart_colours[(i + 1) % chart_colours.size()];
    std::vector<std::pair<double, double>> line;
    for (const StressorSample& s : stressor.samples) {
      const double value = figure_of(s, stressor.beside[i].first);
      line.emplace_back(x(s.value), y(value));
    }
    svg.polyline(line, colour, 1.6);
    for (const auto& [px, py] : line) svg.mark(px, py, Mark::square, 3, colour);
    const double word_y = top + 16 + 14 * static_cast<double>(i);
    svg.line(left + 10, word_y - 4, left + 26, word_y - 4, colour, 1.6);
    svg.text(left + 32, word_y, stressor.beside[i].second, {10.5});
  }
  const auto has_place = [&](const StressorSample& s) {
    return s.error > 0 || !stressor.beside.empty();
  };
  std::vector<std::pair<double, double>> error_line;
  std::vector<std::pair<double, double>> reported_line;
  for (const StressorSample& s : stressor.samples) {
    if (has_place(s)) error_line.emplace_back(x(s.value), y(s.error));
    if (s.reported_error && *s.reported_error > 0) {
      reported_line.emplace_back(x(s.value), y(*s.reported_error));
    }
  }
  if (stressor.floor > 0) {
    svg.polyline({{left, y(stressor.floor)}, {left + small_width, y(stressor.floor)}}, faint_ink,
                 1.2, "2 3");
    svg.text(left + 6, y(stressor.floor) + 14, stressor.floor_name, {11, Anchor::start, faint_ink});
  }
  svg.polyline(reported_line, chart_colours[1], 1.6, "6 4");
  svg.polyline(error_line, chart_colours[0], 2);
  for (const StressorSample& s : stressor.samples) {
    const bool good = s.status == "ok";
    if (!has_place(s)) continue;
    svg.mark(x(s.value), y(s.error), good ? Mark::disc : Mark::cross, good ? 4 : 5,
             good ? chart_colours[0] : chart_colours[1]);
    if (!s.label.empty()) {
      svg.text(x(s.value), y(s.error) - 9, s.label, {10.5, Anchor::middle, faint_ink});
    }
  }
  const double key_y = top - 12;
  svg.line(left, key_y - 4, left + 22, key_y - 4, chart_colours[0], 2);
  svg.text(left + 28, key_y, stressor.own_name.empty() ? "error" : stressor.own_name, {11.5});
  if (!reported_line.empty()) {
    svg.polyline({{left + 84, key_y - 4}, {left + 106, key_y - 4}}, chart_colours[1], 1.6, "6 4");
    svg.text(left + 112, key_y, "the program's own estimate", {11.5});
  }
  if (std::ranges::any_of(stressor.samples, [](const auto& s) { return s.status != "ok"; })) {
    svg.mark(left + 318, key_y - 4, Mark::cross, 5, chart_colours[1]);
    svg.text(left + 330, key_y, "its status is not ok", {11.5});
  }
}

// One bar a step, from 0, with its standard error.
void draw_steps(Svg& svg, const ErrorSteps& split, double left, double top) {
  svg.text(left, top - 12, split.title, {12.5, Anchor::start, ink, true});
  constexpr double name_width = 150;
  constexpr double value_width = 96;
  const double from = left + name_width;
  const double room = small_width + 66 - name_width - value_width;
  double most = 0;
  for (const ErrorStep& s : split.steps) most = std::max(most, s.error + s.standard_error);
  const auto across = [&](double error) { return from + (most > 0 ? error / most : 0) * room; };
  const auto count = static_cast<double>(std::max<std::size_t>(split.steps.size(), 1));
  const double pitch = std::min(36.0, small_height / count);
  double y = top + 6;
  for (const ErrorStep& s : split.steps) {
    const double middle = y + pitch / 2;
    svg.text(from - 10, middle + 4, s.name, {11.5, Anchor::end, ink});
    svg.rectangle(from, y + pitch * 0.2, across(s.error) - from, pitch * 0.6, chart_colours[0]);
    svg.line(across(std::max(0.0, s.error - s.standard_error)), middle,
             across(s.error + s.standard_error), middle, ink, 1.6);
    svg.text(across(s.error + s.standard_error) + 8, middle + 4,
             fmt::format("{:.2f} % ± {:.2f}", 100 * s.error, 100 * s.standard_error),
             {11.5, Anchor::start, ink});
    y += pitch;
  }
  svg.line(from, top + 6, from, y, "#999999");
}

}  // namespace

std::string chart_svg(const Chart& chart) {
  const std::vector<Series> all = series_of(chart);
  const std::vector<std::string> scenes = scenes_of(chart);
  using Draw = std::function<void(Svg&, double left, double top)>;
  std::vector<Draw> small;
  for (const FigurePanel& panel : chart.panels) {
    small.push_back([&](Svg& svg, double left, double top) {
      draw_figures(svg, chart, all, panel, {left, top, small_width, small_height});
    });
  }
  for (const ErrorSteps& steps : chart.steps) {
    small.push_back([&](Svg& svg, double left, double top) { draw_steps(svg, steps, left, top); });
  }
  for (const Stressor& stressor : chart.stressors) {
    small.push_back(
        [&](Svg& svg, double left, double top) { draw_stressor(svg, chart, stressor, left, top); });
  }
  const bool several = scenes.size() > 1;
  const auto rows = [](std::size_t panels) { return static_cast<double>((panels + 1) / 2); };
  const double scenes_height =
      several ? rows(scenes.size()) * scene_row : panel_height + axis_height;
  const double small_top = title_height + scenes_height + 46;
  const double height = title_height + scenes_height + margin / 2 + rows(small.size()) * small_row;
  const double legend_left =
      panel_left + (several ? small_pitch + small_width : panel_width) + legend_gap;
  Svg svg(legend_left + legend_width, height);
  svg.rectangle(0, 0, legend_left + legend_width, height, "#ffffff");
  svg.text(panel_left, 32, chart.title, {19, Anchor::start, ink, true});
  svg.text(panel_left, 55, chart.subtitle, {12.5, Anchor::start, faint_ink});
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (!several) {
      draw_scene(svg, chart, all, scenes[i], {panel_left, title_height, panel_width, panel_height},
                 13);
      continue;
    }
    const double left = panel_left + static_cast<double>(i % 2) * small_pitch;
    const double top = title_height + 26 + static_cast<double>(i / 2) * scene_row;
    svg.text(left, top - 10, scenes[i], {13, Anchor::start, ink, true});
    draw_scene(svg, chart, all, scenes[i], {left, top, small_width, scene_height}, 11.5);
  }
  draw_legend(svg, chart, all, legend_left, title_height);
  for (std::size_t i = 0; i < small.size(); ++i) {
    small[i](svg, panel_left + static_cast<double>(i % 2) * small_pitch,
             small_top + static_cast<double>(i / 2) * small_row);
  }
  return svg.finish();
}

}  // namespace studio
