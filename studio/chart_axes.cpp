// Axes of charts.
#include "studio/chart_axes.h"

#include <fmt/format.h>

namespace studio {
namespace {

constexpr std::string_view grid = "#e4e4e4";
constexpr std::string_view fine_grid = "#f3f3f3";

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

// Short, without exponents where people do not expect them: 0.002, 50, 2000, 1e-6, 5 %.
std::string number_text(const Axis& axis, double value) {
  if (axis.percent) return fmt::format("{:.6g} %", 100 * value);
  const double size = std::abs(value);
  return size != 0 && (size < 1e-4 || size >= 1e6) ? fmt::format("{:.0e}", value)
                                                   : fmt::format("{:.6g}", value);
}

}  // namespace

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

Axis error_axis(const std::vector<double>& errors, double from, double to) {
  Axis axis = log_axis(errors, from, to);
  axis.percent = true;
  return axis;
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
    const std::string text = number_text(x, tick.value);
    const double half = text_width(text, text_size) / 2;
    if (!tick.major || x(tick.value) - half < last_end + 6) continue;
    last_end = x(tick.value) + half;
    svg.text(x(tick.value), bottom + text_size + 6, text, {text_size, Anchor::middle, chart_ink});
  }
  for (const Tick& tick : y.logarithmic ? log_ticks(y) : linear_ticks(y)) {
    if (!tick.major) continue;
    svg.text(left - 8, y(tick.value) + text_size * 0.36, number_text(y, tick.value),
             {text_size, Anchor::end, chart_ink});
  }
  svg.text((left + right) / 2, bottom + 2 * text_size + 18, x_name,
           {text_size + 1, Anchor::middle, chart_ink});
  svg.text(left - 66, (top + bottom) / 2, y_name,
           {text_size + 1, Anchor::middle, chart_ink, false, true});
}

}  // namespace studio
