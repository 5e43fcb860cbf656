// Charts as pictures.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "studio/chart.h"
#include "studio/svg.h"

namespace studio {
namespace {

// Okabe and Ito, "Color Universal Design", 2008: told apart by everybody.
constexpr std::array<std::string_view, 8> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                  "#56b4e9", "#e69f00", "#7f7f7f", "#000000"};
constexpr std::array<Mark, 4> peer_marks{Mark::square, Mark::triangle, Mark::diamond, Mark::cross};

constexpr std::string_view ink = "#222222";
constexpr std::string_view faint_ink = "#666666";
constexpr std::string_view grid = "#e4e4e4";
constexpr std::string_view fine_grid = "#f3f3f3";
constexpr std::string_view front_ink = "#222222";

constexpr double width = 1120;
constexpr double margin = 28;
constexpr double title_height = 74;
constexpr double panel_left = 92;
constexpr double panel_width = 760;
constexpr double panel_height = 500;
constexpr double legend_left = panel_left + panel_width + 28;
constexpr double axis_height = 62;
constexpr double stressor_width = 420;
constexpr double stressor_height = 230;
constexpr double stressor_pitch = 536;
constexpr double stressor_row = 350;

// One axis: values to pixels.
struct Axis {
  double low = 0, high = 1;  // of values
  bool logarithmic = true;
  double from = 0, to = 1;  // pixels of low and high

  double operator()(double value) const {
    const double share =
        logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from + std::clamp(share, 0.0, 1.0) * (to - from);
  }
};

struct Tick {
  double value;
  bool major;
};

// Of a logarithmic axis: powers of ten, and 2 and 5 between where there is room; the rest fine.
std::vector<Tick> log_ticks(const Axis& axis) {
  const double decades = std::log10(axis.high / axis.low);
  std::vector<Tick> ticks;
  const int first = static_cast<int>(std::floor(std::log10(axis.low)));
  const int last = static_cast<int>(std::ceil(std::log10(axis.high)));
  for (int power = first; power <= last; ++power) {
    for (int digit = 1; digit < 10; ++digit) {
      const double value = digit * std::pow(10.0, power);
      if (value < axis.low * 0.999 || value > axis.high * 1.001) continue;
      const bool named = digit == 1 || (decades < 3 && (digit == 2 || digit == 5));
      ticks.push_back({value, named});
    }
  }
  return ticks;
}

std::vector<Tick> linear_ticks(const Axis& axis) {
  const double rough = (axis.high - axis.low) / 5;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double share = rough / power;
  const double step = power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
  std::vector<Tick> ticks;
  for (double v = std::ceil(axis.low / step) * step; v <= axis.high + step * 1e-6; v += step) {
    ticks.push_back({v, true});
  }
  return ticks;
}

// Short, without exponents where people do not expect them: 0.002, 50, 2000, 1e-6.
std::string number_text(double value) {
  const double size = std::abs(value);
  return size != 0 && (size < 1e-4 || size >= 1e6) ? fmt::format("{:.0e}", value)
                                                   : fmt::format("{:.6g}", value);
}

// A range that holds all values with some air; whole decades are not needed.
Axis log_axis(const std::vector<double>& values, double from, double to) {
  double low = INFINITY;
  double high = 0;
  for (const double v : values) {
    if (!(v > 0)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (!(high > 0)) low = 0.1, high = 1;
  const double air = std::max(1.25, std::pow(high / low, 0.06));
  return {low / air, high * air, true, from, to};
}

void draw_axes(Svg& svg,
               const Axis& x,
               const Axis& y,
               const std::string& x_name,
               const std::string& y_name,
               double text_size) {
  const double left = x.from;
  const double right = x.to;
  const double bottom = y.from;
  const double top = y.to;
  for (const bool major : {false, true}) {
    const std::string_view colour = major ? grid : fine_grid;
    for (const Tick& tick : x.logarithmic ? log_ticks(x) : linear_ticks(x)) {
      if (tick.major == major) svg.line(x(tick.value), top, x(tick.value), bottom, colour);
    }
    for (const Tick& tick : y.logarithmic ? log_ticks(y) : linear_ticks(y)) {
      if (tick.major == major) svg.line(left, y(tick.value), right, y(tick.value), colour);
    }
  }
  svg.frame(left, top, right - left, bottom - top, "#999999");
  double last_end = -INFINITY;
  for (const Tick& tick : x.logarithmic ? log_ticks(x) : linear_ticks(x)) {
    const std::string text = number_text(tick.value);
    const double half = text_width(text, text_size) / 2;
    if (!tick.major || x(tick.value) - half < last_end + 6) continue;
    last_end = x(tick.value) + half;
    svg.text(x(tick.value), bottom + text_size + 6, text, {text_size, Anchor::middle, ink});
  }
  for (const Tick& tick : y.logarithmic ? log_ticks(y) : linear_ticks(y)) {
    if (!tick.major) continue;
    svg.text(left - 8, y(tick.value) + text_size * 0.36, number_text(tick.value),
             {text_size, Anchor::end, ink});
  }
  svg.text((left + right) / 2, bottom + 2 * text_size + 18, x_name,
           {text_size + 1, Anchor::middle, ink});
  svg.text(left - 66, (top + bottom) / 2, y_name,
           {text_size + 1, Anchor::middle, ink, false, true});
}

// How a method is drawn.
struct Style {
  std::string_view colour;
  Mark mark;
};

std::vector<std::string> methods_of(const Chart& chart) {
  std::vector<std::string> methods;
  for (const bool peer : {false, true}) {
    for (const ChartPoint& p : chart.points) {
      if (p.peer == peer && std::ranges::find(methods, p.method) == methods.end()) {
        methods.push_back(p.method);
      }
    }
  }
  return methods;
}

std::map<std::string, Style> styles_of(const Chart& chart) {
  std::map<std::string, Style> styles;
  std::size_t colour = 0;
  std::size_t peers = 0;
  for (const std::string& method : methods_of(chart)) {
    const bool peer = std::ranges::find(chart.points, method, &ChartPoint::method)->peer;
    const Mark mark = peer ? peer_marks[peers++ % peer_marks.size()] : Mark::disc;
    styles[method] = {colours[colour++ % colours.size()], mark};
  }
  return styles;
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
    return p->on_front ? 0 : p->peer ? 1 : 2;
  });
  for (const ChartPoint* p : order) {
    if (p->label.empty()) continue;
    const double w = text_width(p->label, size);
    const double px = x(p->time_ms);
    const double py = y(p->error);
    // Below left of the front is empty by its nature, so its own names go there.
    std::vector<std::pair<double, double>> places{{px + 9, py + 4},
                                                  {px + 8, py - 8},
                                                  {px - w / 2, py - 10},
                                                  {px - w - 9, py + 4},
                                                  {px - w / 2, py + 19}};
    if (p->on_front) places.insert(places.begin(), {px - w - 8, py + 15});
    for (const auto& [tx, ty] : places) {
      const Box box{tx - 1, ty - size, tx + w + 1, ty + 2};
      const bool inside = box.x0 > x.from && box.x1 < x.to && box.y0 > y.to && box.y1 < y.from;
      if (!inside || std::ranges::any_of(taken, [&](const Box& b) { return b.meets(box); })) {
        continue;
      }
      svg.text(tx, ty, p->label, {size, Anchor::start, p->on_front ? ink : faint_ink, p->on_front});
      taken.push_back(box);
      break;
    }
  }
}

void draw_main_panel(Svg& svg, const Chart& chart, const std::map<std::string, Style>& styles) {
  std::vector<double> times;
  std::vector<double> errors;
  for (const ChartPoint& p : chart.points) {
    times.push_back(p.time_ms);
    errors.push_back(p.error);
  }
  const double top = title_height;
  const Axis x = log_axis(times, panel_left, panel_left + panel_width);
  const Axis y = log_axis(errors, top + panel_height, top);
  draw_axes(svg, x, y, chart.time_name, chart.error_name, 13);

  for (const auto& [method, style] : styles) {
    std::vector<std::pair<double, double>> line;
    for (const ChartPoint& p : chart.points) {
      if (p.method == method) line.emplace_back(x(p.time_ms), y(p.error));
    }
    std::ranges::sort(line);
    const bool peer = style.mark != Mark::disc;
    if (peer && line.size() > 1) svg.polyline(line, style.colour, 1, "3 4");
  }
  std::vector<std::pair<double, double>> front;
  for (const ChartPoint& p : chart.points) {
    if (p.on_front) front.emplace_back(x(p.time_ms), y(p.error));
  }
  std::ranges::sort(front);
  if (front.size() > 1) svg.polyline(front, front_ink, 2);
  for (const ChartPoint& p : chart.points) {
    const Style& style = styles.at(p.method);
    if (p.on_front) svg.mark(x(p.time_ms), y(p.error), Mark::ring, 8.5, front_ink);
    svg.mark(x(p.time_ms), y(p.error), style.mark, 5, style.colour);
  }
  label_points(svg, chart, x, y, front);
}

void draw_legend(Svg& svg, const Chart& chart, const std::map<std::string, Style>& styles) {
  double y = title_height + 14;
  const auto heading = [&](std::string_view text) {
    svg.text(legend_left, y, text, {13, Anchor::start, ink, true});
    y += 24;
  };
  bool peers = false;
  heading("method");
  for (const std::string& method : methods_of(chart)) {
    const Style& style = styles.at(method);
    if (style.mark != Mark::disc && !peers) {
      peers = true;
      y += 10;
      heading("other tools");
    }
    svg.mark(legend_left + 8, y - 4.5, style.mark, 5, style.colour);
    svg.text(legend_left + 24, y, method, {12.5});
    y += 22;
  }
  y += 14;
  svg.line(legend_left - 2, y - 4.5, legend_left + 18, y - 4.5, front_ink, 2);
  svg.mark(legend_left + 8, y - 4.5, Mark::ring, 7, front_ink);
  svg.text(legend_left + 24, y, "Pareto front:", {12.5});
  svg.text(legend_left + 24, y + 16, "nothing of ours is both", {11, Anchor::start, faint_ink});
  svg.text(legend_left + 24, y + 30, "faster and closer", {11, Anchor::start, faint_ink});
}

void draw_stressor(Svg& svg, const Stressor& stressor, double left, double top) {
  std::vector<double> values;
  std::vector<double> errors;
  for (const StressorSample& s : stressor.samples) {
    values.push_back(s.value);
    errors.push_back(s.error);
    if (s.reported_error) errors.push_back(*s.reported_error);
  }
  Axis x = log_axis(values, left, left + stressor_width);
  if (!stressor.logarithmic && !values.empty()) {
    const auto [low, high] = std::ranges::minmax(values);
    x = {low, high > low ? high : low + 1, false, left, left + stressor_width};
  }
  const Axis y = log_axis(errors, top + stressor_height, top);
  const std::string name = stressor.unit.empty()
                               ? stressor.stressor
                               : fmt::format("{}, {}", stressor.stressor, stressor.unit);
  draw_axes(svg, x, y, name, "error", 11.5);
  std::vector<std::pair<double, double>> error_line;
  std::vector<std::pair<double, double>> reported_line;
  for (const StressorSample& s : stressor.samples) {
    if (s.error > 0) error_line.emplace_back(x(s.value), y(s.error));
    if (s.reported_error && *s.reported_error > 0) {
      reported_line.emplace_back(x(s.value), y(*s.reported_error));
    }
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
  svg.polyline({{left + 84, key_y - 4}, {left + 106, key_y - 4}}, colours[1], 1.6, "6 4");
  svg.text(left + 112, key_y, "the program's own estimate", {11.5});
  if (std::ranges::any_of(stressor.samples, [](const auto& s) { return s.status != "ok"; })) {
    svg.mark(left + 318, key_y - 4, Mark::cross, 5, colours[1]);
    svg.text(left + 330, key_y, "refused or failed", {11.5});
  }
}

// One bar a step, from 0, with its standard error.
void draw_steps(Svg& svg, const ErrorSteps& split, double left, double top) {
  svg.text(left, top - 12, split.title, {12.5, Anchor::start, ink, true});
  constexpr double name_width = 150;
  constexpr double value_width = 96;
  const double from = left + name_width;
  const double room = stressor_width + 66 - name_width - value_width;
  double most = 0;
  for (const ErrorStep& s : split.steps) most = std::max(most, s.error + s.standard_error);
  const auto across = [&](double error) { return from + (most > 0 ? error / most : 0) * room; };
  const auto count = static_cast<double>(std::max<std::size_t>(split.steps.size(), 1));
  const double pitch = std::min(36.0, stressor_height / count);
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
  const std::size_t splits = chart.steps.size();
  const auto rows = (splits + chart.stressors.size() + 1) / 2;
  const double stressors_top = title_height + panel_height + axis_height + 46;
  const double height = title_height + panel_height + axis_height + margin / 2 +
                        static_cast<double>(rows) * stressor_row;
  Svg svg(width, height);
  svg.rectangle(0, 0, width, height, "#ffffff");
  svg.text(panel_left, 32, chart.title, {19, Anchor::start, ink, true});
  svg.text(panel_left, 55, chart.subtitle, {12.5, Anchor::start, faint_ink});
  const std::map<std::string, Style> styles = styles_of(chart);
  draw_main_panel(svg, chart, styles);
  draw_legend(svg, chart, styles);
  for (std::size_t i = 0; i < splits + chart.stressors.size(); ++i) {
    const double left = panel_left + static_cast<double>(i % 2) * stressor_pitch;
    const double top = stressors_top + static_cast<double>(i / 2) * stressor_row;
    if (i < splits) {
      draw_steps(svg, chart.steps[i], left, top);
    } else {
      draw_stressor(svg, chart.stressors[i - splits], left, top);
    }
  }
  return svg.finish();
}

}  // namespace studio
