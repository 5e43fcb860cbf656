// Charts as pictures.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "studio/chart.h"
#include "studio/chart_axes.h"
#include "studio/svg.h"

namespace studio {
namespace {

// Okabe and Ito, "Color Universal Design", 2008: told apart by everybody.
constexpr std::array<std::string_view, 8> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                  "#56b4e9", "#e69f00", "#7f7f7f", "#000000"};
// Of variants, and of peers.
constexpr std::array<Mark, 4> marks{Mark::disc, Mark::square, Mark::diamond, Mark::triangle};
constexpr std::string_view peer_dashes = "2 4";

constexpr std::string_view ink = chart_ink;
constexpr std::string_view faint_ink = faint_chart_ink;

constexpr double width = 1120;
constexpr double margin = 28;
constexpr double title_height = 74;
constexpr double panel_left = 92;
constexpr double panel_width = 760;
constexpr double panel_height = 500;
constexpr double legend_left = panel_left + panel_width + 28;
constexpr double axis_height = 62;
constexpr double small_width = 420;  // of the panels below the main one
constexpr double small_height = 230;
constexpr double small_pitch = 536;
constexpr double small_row = 350;

// What differs in one way from point to point, joined by a line.
struct Series {
  std::string method, variant;
  bool peer = false;
  std::string_view colour;
  Mark mark = Mark::disc;
  std::vector<const ChartPoint*> points;
};

template <class Texts>
std::size_t place_in(Texts& texts, const std::string& text) {
  const auto found = std::ranges::find(texts, text);
  if (found != texts.end()) return static_cast<std::size_t>(found - texts.begin());
  texts.push_back(text);
  return texts.size() - 1;
}

// Every method has a colour, and every variant a mark; peers, which come last, have open marks.
std::vector<Series> series_of(const Chart& chart) {
  std::vector<Series> all;
  std::vector<std::string> methods, variants, peers;
  for (const bool peer : {false, true}) {
    for (const ChartPoint& p : chart.points) {
      if (p.peer != peer) continue;
      const std::size_t method = place_in(methods, p.method);
      const std::size_t mark = peer ? place_in(peers, p.method) : place_in(variants, p.variant);
      auto series = std::ranges::find_if(all, [&](const Series& s) {
        return s.peer == peer && s.method == p.method && s.variant == p.variant;
      });
      if (series == all.end()) {
        series = all.insert(all.end(), {p.method,
                                        p.variant,
                                        peer,
                                        colours[method % colours.size()],
                                        marks[mark % marks.size()],
                                        {}});
      }
      series->points.push_back(&p);
    }
  }
  return all;
}

using Value = std::function<std::optional<double>(const ChartPoint&)>;

std::optional<double> error_of(const ChartPoint& p) { return p.error; }
std::optional<double> time_of(const ChartPoint& p) { return p.time_ms; }

Value figure_named(const std::string& name) {
  if (name == "error") return error_of;
  if (name == "error_p99") return [](const ChartPoint& p) { return p.error_p99; };
  return [name](const ChartPoint& p) -> std::optional<double> {
    const auto found = std::ranges::find(p.figures, name, &std::pair<std::string, double>::first);
    return found == p.figures.end() ? std::nullopt : std::optional(found->second);
  };
}

struct Box {
  double x0, y0, x1, y1;
  bool meets(const Box& other) const {
    return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1;
  }
};

// Names points where there is room: the front first, and no name over another, a mark or the front.
void label_points(Svg& svg,
                  const Chart& chart,
                  const Axis& x,
                  const Axis& y,
                  const std::vector<std::pair<double, double>>& front) {
  constexpr double size = 11;
  std::vector<Box> taken;
  for (const ChartPoint& p : chart.points) {
    const double px = x(p.time_ms);
    const double py = y(p.error);
    taken.push_back({px - 5, py - 5, px + 5, py + 5});
  }
  constexpr int pieces = 24;  // of each stretch of the front
  for (std::size_t i = 1; i < front.size(); ++i) {
    for (int j = 0; j <= pieces; ++j) {
      const double t = static_cast<double>(j) / pieces;
      const double px = front[i - 1].first + (front[i].first - front[i - 1].first) * t;
      const double py = front[i - 1].second + (front[i].second - front[i - 1].second) * t;
      taken.push_back({px - 1, py - 1, px + 1, py + 1});
    }
  }
  std::vector<const ChartPoint*> order;
  for (const ChartPoint& p : chart.points) order.push_back(&p);
  std::ranges::stable_sort(order, {}, [](const ChartPoint* p) {
    return p->by_default ? 0 : p->on_front ? 1 : p->peer ? 2 : 3;
  });
  for (const ChartPoint* p : order) {
    // Where variants crowd, the front's names and the peers' tell the others'.
    const bool strong = p->on_front || p->by_default;
    if (p->label.empty() || (!p->variant.empty() && !strong && !p->peer)) continue;
    const double w = text_width(p->label, size);
    const double px = x(p->time_ms);
    const double py = y(p->error);
    // Below left of the front is empty by its nature, so its own names go there.
    std::vector<std::pair<double, double>> places{{px + 9, py + 4},
                                                  {px + 8, py - 8},
                                                  {px - w / 2, py - 10},
                                                  {px - w - 9, py + 4},
                                                  {px - w / 2, py + 19}};
    if (strong) places.insert(places.begin(), {px - w - 8, py + 15});
    for (const auto& [tx, ty] : places) {
      const Box box{tx - 1, ty - size, tx + w + 1, ty + 2};
      const bool inside = box.x0 > x.from && box.x1 < x.to && box.y0 > y.to && box.y1 < y.from;
      if (!inside || std::ranges::any_of(taken, [&](const Box& b) { return b.meets(box); })) {
        continue;
      }
      svg.text(tx, ty, p->label, {size, Anchor::start, strong ? ink : faint_ink, strong});
      taken.push_back(box);
      break;
    }
  }
}

// The points' values against their time.
void draw_points(Svg& svg,
                 const std::vector<Series>& all,
                 const Value& value,
                 const Axis& x,
                 const Axis& y,
                 double radius,
                 const Value& across = time_of) {
  for (const bool lines : {true, false}) {
    for (const Series& series : all) {
      std::vector<std::pair<double, double>> places;
      for (const ChartPoint* p : series.points) {
        const auto u = across(*p);
        const auto v = value(*p);
        if (u && v) places.emplace_back(x(*u), y(*v));
      }
      if (lines && places.size() > 1) {
        svg.polyline(places, series.colour, series.peer ? 1.8 : 1, series.peer ? peer_dashes : "");
      }
      for (const auto& [px, py] : places) {
        if (!lines) svg.mark(px, py, series.mark, radius, series.colour, !series.peer);
      }
    }
  }
}

std::vector<double> times_of(const Chart& chart) {
  std::vector<double> times;
  for (const ChartPoint& p : chart.points) times.push_back(p.time_ms);
  return times;
}

// Of the errors of a chart, and of figures beside them.
Axis axis_of(const Chart& chart, const std::vector<double>& errors, double from, double to) {
  return chart.relative ? error_axis(errors, from, to) : log_axis(errors, from, to);
}

void draw_figures(Svg& svg,
                  const Chart& chart,
                  const std::vector<Series>& all,
                  const FigurePanel& panel,
                  double left,
                  double top) {
  const Value across = panel.across.empty() ? time_of : figure_named(panel.across);
  std::vector<double> places;
  for (const ChartPoint& p : chart.points) {
    if (const auto place = across(p)) places.push_back(*place);
  }
  const Axis x = log_axis(places, left, left + small_width);
  std::vector<double> values;
  for (const auto& [figure, word] : panel.figures) {
    for (const ChartPoint& p : chart.points) values.push_back(figure_named(figure)(p).value_or(0));
  }
  const Axis y = axis_of(chart, values, top + small_height, top);
  draw_axes(svg, x, y, panel.across.empty() ? chart.time_name : panel.across_name, panel.name,
            11.5);
  for (const auto& [figure, word] : panel.figures) {
    const Value value = figure_named(figure);
    draw_points(svg, all, value, x, y, 3.2, across);
    double highest = 0;  // of our own
    for (const ChartPoint& p : chart.points) {
      if (!p.peer) highest = std::max(highest, value(p).value_or(0));
    }
    if (!word.empty() && highest > 0) {
      svg.text(left + small_width - 8, y(highest) - 10, word, {11, Anchor::end, faint_ink});
    }
  }
}

void draw_main_panel(Svg& svg, const Chart& chart, const std::vector<Series>& all) {
  std::vector<double> errors;
  for (const ChartPoint& p : chart.points) errors.push_back(p.error);
  const Axis x = log_axis(times_of(chart), panel_left, panel_left + panel_width);
  const Axis y = axis_of(chart, errors, title_height + panel_height, title_height);
  draw_axes(svg, x, y, chart.time_name, chart.error_name, 13);
  draw_points(svg, all, error_of, x, y, 4.5);
  std::vector<std::pair<double, double>> front;
  for (const ChartPoint& p : chart.points) {
    if (p.on_front) front.emplace_back(x(p.time_ms), y(p.error));
  }
  std::ranges::sort(front);
  if (front.size() > 1) svg.polyline(front, ink, 2);
  for (const auto& [px, py] : front) svg.mark(px, py, Mark::disc, 7.5, ink, false);
  label_points(svg, chart, x, y, front);
}

void draw_legend(Svg& svg, const Chart& chart, const std::vector<Series>& all) {
  double y = title_height + 14;
  const auto entry = [&](std::string_view text) {
    svg.text(legend_left + 30, y, text, {12.5});
    y += 22;
  };
  const auto heading = [&](std::string_view text) {
    svg.text(legend_left, y, text, {13, Anchor::start, ink, true});
    y += 24;
  };
  std::vector<std::string> methods, variants, peers;
  const bool has_variants =
      std::ranges::any_of(all, [](const Series& s) { return s.variant != ""; });
  heading("method");
  for (const Series& s : all) {
    if (s.peer || std::ranges::find(methods, s.method) != methods.end()) continue;
    methods.push_back(s.method);
    svg.line(legend_left, y - 4.5, legend_left + 22, y - 4.5, s.colour, has_variants ? 4 : 1);
    if (!has_variants) svg.mark(legend_left + 11, y - 4.5, s.mark, 5, s.colour);
    entry(s.method);
  }
  if (has_variants) {
    y += 8;
    heading(chart.variant_name);
  }
  for (const Series& s : all) {
    if (s.peer || !has_variants || std::ranges::find(variants, s.variant) != variants.end())
      continue;
    variants.push_back(s.variant);
    svg.mark(legend_left + 11, y - 4.5, s.mark, 5, faint_ink);
    entry(s.variant);
  }
  for (const Series& s : all) {
    if (!s.peer) continue;
    if (peers.empty()) {
      y += 8;
      heading("for comparison");
    }
    peers.push_back(s.method);
    svg.polyline({{legend_left - 2, y - 4.5}, {legend_left + 24, y - 4.5}}, s.colour, 1.8,
                 peer_dashes);
    svg.mark(legend_left + 11, y - 4.5, s.mark, 5, s.colour, false);
    entry(s.method);
  }
  y += 10;
  svg.line(legend_left - 2, y - 4.5, legend_left + 24, y - 4.5, ink, 2);
  svg.mark(legend_left + 11, y - 4.5, Mark::disc, 7, ink, false);
  entry("Pareto front:");
  svg.text(legend_left + 30, y - 6, "nothing of ours is both", {11, Anchor::start, faint_ink});
  svg.text(legend_left + 30, y + 8, "faster and closer", {11, Anchor::start, faint_ink});
}

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
  if (stressor.floor > 0) errors.push_back(stressor.floor);
  const Axis y = axis_of(chart, errors, top + small_height, top);
  const std::string name = stressor.unit.empty()
                               ? stressor.stressor
                               : fmt::format("{}, {}", stressor.stressor, stressor.unit);
  draw_axes(svg, x, y, name, chart.stressed_error_name, 11.5);
  std::vector<std::pair<double, double>> error_line;
  std::vector<std::pair<double, double>> reported_line;
  for (const StressorSample& s : stressor.samples) {
    if (s.error > 0) error_line.emplace_back(x(s.value), y(s.error));
    if (s.reported_error && *s.reported_error > 0) {
      reported_line.emplace_back(x(s.value), y(*s.reported_error));
    }
  }
  if (stressor.floor > 0) {
    svg.polyline({{left, y(stressor.floor)}, {left + small_width, y(stressor.floor)}}, faint_ink,
                 1.2, "2 3");
    svg.text(left + 6, y(stressor.floor) + 14, stressor.floor_name, {11, Anchor::start, faint_ink});
  }
  svg.polyline(reported_line, colours[1], 1.6, "6 4");
  svg.polyline(error_line, colours[0], 2);
  for (const StressorSample& s : stressor.samples) {
    const bool good = s.status == "ok";
    if (!(s.error > 0)) continue;
    svg.mark(x(s.value), y(s.error), good ? Mark::disc : Mark::cross, good ? 4 : 5,
             good ? colours[0] : colours[1]);
  }
  const double key_y = top - 12;
  svg.line(left, key_y - 4, left + 22, key_y - 4, colours[0], 2);
  svg.text(left + 28, key_y, "error", {11.5});
  if (!reported_line.empty()) {
    svg.polyline({{left + 84, key_y - 4}, {left + 106, key_y - 4}}, colours[1], 1.6, "6 4");
    svg.text(left + 112, key_y, "the program's own estimate", {11.5});
  }
  if (std::ranges::any_of(stressor.samples, [](const auto& s) { return s.status != "ok"; })) {
    svg.mark(left + 318, key_y - 4, Mark::cross, 5, colours[1]);
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
    svg.rectangle(from, y + pitch * 0.2, across(s.error) - from, pitch * 0.6, colours[0]);
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
  using Draw = std::function<void(Svg&, double left, double top)>;
  std::vector<Draw> small;
  for (const FigurePanel& panel : chart.panels) {
    small.push_back([&](Svg& svg, double left, double top) {
      draw_figures(svg, chart, all, panel, left, top);
    });
  }
  for (const ErrorSteps& steps : chart.steps) {
    small.push_back([&](Svg& svg, double left, double top) { draw_steps(svg, steps, left, top); });
  }
  for (const Stressor& stressor : chart.stressors) {
    small.push_back(
        [&](Svg& svg, double left, double top) { draw_stressor(svg, chart, stressor, left, top); });
  }
  const double small_top = title_height + panel_height + axis_height + 46;
  const double height = title_height + panel_height + axis_height + margin / 2 +
                        static_cast<double>((small.size() + 1) / 2) * small_row;
  Svg svg(width, height);
  svg.rectangle(0, 0, width, height, "#ffffff");
  svg.text(panel_left, 32, chart.title, {19, Anchor::start, ink, true});
  svg.text(panel_left, 55, chart.subtitle, {12.5, Anchor::start, faint_ink});
  draw_main_panel(svg, chart, all);
  draw_legend(svg, chart, all);
  for (std::size_t i = 0; i < small.size(); ++i) {
    small[i](svg, panel_left + static_cast<double>(i % 2) * small_pitch,
             small_top + static_cast<double>(i / 2) * small_row);
  }
  return svg.finish();
}

}  // namespace studio
